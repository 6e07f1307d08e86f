# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What the nodes share of rclpy: start and end, parameters, quality of service, diagnostics."""
