# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A rail on which EM and smoothers have something to do."""

from __future__ import annotations

import numpy as np
from oracles import Linear
from oracles_kappa import Conditioned

from adhesion_node.core.methods.rail_condition.smoother import KappaSearch

SEEN = Linear(c0=0.79, c1=0.02, q_s=1e-4, q_v=2e-3)
"""Loud and measured well: a window's positions hold a good share of what its states do."""
RAIL = Conditioned(SEEN, 0.05)
STATE = np.array([[0.04, 0.005], [0.005, 0.01]])
SEARCH = KappaSearch(start=0.3, lowest=0.0, tolerance=1e-9, iterations=50)
