# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A run of the estimators from samples to results, the same live and offline."""
