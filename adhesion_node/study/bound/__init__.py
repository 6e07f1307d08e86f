# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""`study bound`: what no estimator can beat."""
