# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Onboard identification of the wheel-rail adhesion coefficient for ROS 2."""
