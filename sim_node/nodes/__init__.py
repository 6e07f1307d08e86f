# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The simulators as ROS nodes."""
