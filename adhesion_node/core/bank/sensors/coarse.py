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
"""Steps that positions mostly come in, the coarsest first; finer ones are within what any receiver errs by."""

FINEST_M, ROUND_M = 0.05, (0.05, 0.0625, 0.03048, 0.1609344)
"""The finest step that is looked for. One that is no multiple of 5 cm, 1/16 m, a tenth of a foot or 1/10000 mile is
what a wheel rolls from pulse to pulse: nobody rounds so."""

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
    step_m: float = math.inf
    """The greatest that all of them fit; 0 where it is finer than any that counts."""
    move_m: float = math.nan
    """How far the first one moved; infinite once another moved by more or less."""

    def after(self, position_m: float) -> Coarse:
        """Note the next position; where none of the steps fits there is none any more."""
        if self.step_m == 0.0:
            return self
        if position_m == self.last_m:
            return self if math.isinf(self.move_m) else self._replace(move_m=math.inf)
        if math.isnan(self.first_m):
            return Coarse(position_m, position_m, 1)
        step_m = _common(self.step_m, abs(position_m - self.first_m))
        moved_m = abs(position_m - self.last_m)
        is_first = math.isnan(self.move_m)
        move_m = moved_m if is_first or abs(moved_m - self.move_m) < EXACT_M else math.inf
        return Coarse(self.first_m, position_m, self.moves + 1, step_m, move_m)

    @property
    def are_pulses(self) -> bool:
        """Whether the positions are a wheel's, counted in pulses."""
        if self.moves <= SURE or self.step_m == 0.0 or not math.isinf(self.move_m):
            return False
        return all(abs(self.step_m - unit * round(self.step_m / unit)) > 2 * EXACT_M for unit in ROUND_M)

    @property
    def std_m(self) -> float:
        """Least standard deviation of a position; where a train ever moves by one length, by the usual step."""
        if self.moves <= SURE or self.step_m < STEPS_M[-1] - EXACT_M:
            return 0.0
        if math.isinf(self.move_m):
            return ROUNDED * self.step_m
        return ROUNDED * next((each for each in STEPS_M if _common(self.step_m, each) == each), 0.0)


def _common(step_m: float, way_m: float) -> float:
    """The greatest length of which both are multiples, by Euclid; 0 where it is finer than any that counts.

    >>> _common(math.inf, 12.0), _common(12.0, 30.0), round(_common(12.192, 21.336), 6), _common(12.0, 30.37)
    (12.0, 6.0, 3.048, 0.0)
    """
    length, rest = (way_m, 0.0) if math.isinf(step_m) else (max(step_m, way_m), min(step_m, way_m))
    while rest > EXACT_M:
        length, rest = rest, abs(length - rest * round(length / rest))
    return length if length > FINEST_M - EXACT_M else 0.0
