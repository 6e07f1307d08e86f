# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The train on its track: forces, motion and braking, Xie et al. 2019."""
