# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A simulated train: scenarios, the true motion, the sensors and the node that publishes them."""
