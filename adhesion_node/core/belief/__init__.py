# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What is believed of train and rail, and how measurements change it."""
