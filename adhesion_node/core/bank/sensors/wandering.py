# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How fast positions wander, learnt while no brake is applied: satellites' do at any time, an odometer's hardly."""

from __future__ import annotations

import math
from typing import NamedTuple

APART = 6
"""So many looks apart two share no position, and a train that no brake slows down is slowed alike."""

LEAST, MOST, FEW = 40, 120, 24.0
"""Looks that it takes at least, of how many at most the mean is taken, and of n it may be FEW / n more."""

FLOOR = 1.0 / 16.0
"""Part of what positions may wander by, in m^2/s, below which none are believed: places differ."""

ROLLED = 1e-3
"""Positions that wander by less, in m^2/s, are a wheel's: the best receivers do by 8e-3."""

MOVING_MPS = 5.0
"""A train that is slower tells nothing: a wheel that stands errs by nothing, and many a receiver holds its place."""


class Wandering(NamedTuple):
    """By how much decelerations that positions show differ from those before."""

    looks: tuple[float, ...] = ()
    """The last decelerations, m/s^2."""
    mean: float = 0.0
    """Mean variance over the time by which positions wandered, m^2/s, white errors and all, ..."""
    learnt: int = 0
    """... of so many looks at most."""

    def unseen(self) -> Wandering:
        """With a look that sees too few positions: others begin anew."""
        return self._replace(looks=()) if self.looks else self

    def after(self, slowing: float, per_square: float, speed_mps: float, most: float = math.inf) -> Wandering:
        """With a deceleration, m/s^2; `per_square` times its variance is that of positions that wander, m^2/s.

        One difference counts as no more than `most`.
        """
        looks = (*self.looks[-APART:], slowing)
        if len(looks) <= APART or speed_mps < MOVING_MPS:
            return self._replace(looks=looks)
        learnt = min(self.learnt + 1, MOST)
        wandered = min(0.5 * per_square * (looks[-1] - looks[0]) ** 2, most)
        return Wandering(looks, self.mean + (wandered - self.mean) / learnt, learnt)

    @property
    def is_rolled(self) -> bool:
        """Whether the positions are a wheel's, as they hardly wander."""
        return self.learnt >= LEAST and self.mean < ROLLED

    def of(self, most: float) -> float:
        """Variance over the time by which the positions may wander, m^2/s, if others do by `most`."""
        if self.learnt < LEAST:
            return most
        return min(max((1.0 + FEW / self.learnt) * self.mean, FLOOR * most), most)
