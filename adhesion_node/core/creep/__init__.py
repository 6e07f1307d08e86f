# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Identification of the creep curve, He et al. 2017."""
