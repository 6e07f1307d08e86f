# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Topics, messages and settings: how the outside speaks to the core, without ROS."""
