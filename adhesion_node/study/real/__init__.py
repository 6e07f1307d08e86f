# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""`study real`: the estimator on a train that shares no model with it, held against goals."""
