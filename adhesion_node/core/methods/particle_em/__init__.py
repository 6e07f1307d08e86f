# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The paper's method: constant adhesion by EM with particles, Xie et al. 2019."""
