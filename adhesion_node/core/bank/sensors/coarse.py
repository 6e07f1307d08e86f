# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Positions in coarse steps, as of whole metres: what is rounded off is no noise, and no receiver's wandering."""

from __future__ import annotations

import math
from typing import NamedTuple

STEPS_M = (100.0, 50.0, 25.0, 20.0, 10.0, 5.0, 2.5, 2.0, 1.0, 0.5, 0.25, 0.2)
"""Steps that positions may come in, the coarsest first; finer ones are within what any receiver errs by."""

EXACT_M, SURE = 1e-4, 20
"""How far from a step none lies, and so many positions that lie on steps do so by no chance."""

ROUNDED = 0.5
"""Standard deviation of what is rounded off, over the step: no more is lost, but for seconds the same."""


class Coarse(NamedTuple):
    """How far the positions are multiples of a step from the first one on."""

    first_m: float = math.nan
    last_m: float = math.nan
    moves: int = 0
    """How many differed from the one before."""
    steps_m: tuple[float, ...] = STEPS_M
    """Steps that all of them fit."""

    def after(self, position_m: float) -> Coarse:
        """Note the next position; where none of the steps fits there is none any more."""
        if not self.steps_m or position_m == self.last_m:
            return self
        first_m = position_m if math.isnan(self.first_m) else self.first_m
        way_m = position_m - first_m
        steps_m = tuple(each for each in self.steps_m if abs(way_m - each * round(way_m / each)) < EXACT_M)
        return Coarse(first_m, position_m, self.moves + 1, steps_m)

    @property
    def std_m(self) -> float:
        """Least standard deviation of a position."""
        return ROUNDED * self.steps_m[0] if self.steps_m and self.moves > SURE else 0.0
