# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The bank's arithmetic as compiled loops over the hypotheses; `motion`, `seeing` and `branching` give them names."""
