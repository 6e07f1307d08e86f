# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Supervision of a target by the braking curve, in the manner of ETCS."""
