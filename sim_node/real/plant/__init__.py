# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The physics alone, from the literature; it shares no code with the estimator that is judged by it."""
