# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What radii the wheels have, each beside the others, learnt as they roll; and how far rims differ that do."""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

from ...intake.samples import WheelSample

if TYPE_CHECKING:
    from ...config import Config

S = 1_000_000_000

LEARNT = 0.05
"""Share of a new sample in what is learnt of a radius."""

LEAST_LEARNT, LEAST_M = 6, 12.0
"""Samples from which a radius is good for a speed, and way: of less positions that stand still tell nothing."""

LEARNING_MPS = 5.0
"""Radii are learnt from this speed of the rims on, and creep is seen from this speed of the train on."""

UNEQUAL = 0.01
"""By how much wheels of unknown wear may differ, beside creep."""

UNLEARNT = 0.03
"""Error of all radii together of which nothing was learnt: wear."""

BY_CHANCE = 0.5
"""The fastest of n rims is faster than their mean by chance: by sqrt(2 ln n) of their standard deviations at most, of
two by 0.48 of that, of twelve by 0.73. Under the brake fewer than all roll."""


class Radii(NamedTuple):
    """What is known of the radii."""

    own: tuple[float, ...] = ()
    """True over expected radius of each, over the same of all; below 0 where it counts backwards."""
    learnt: int = 0
    """Samples from which they were learnt."""
    noise: float = 0.0
    """Variance of a rim's speed beside the others, relative."""
    way_m: float = 0.0
    """Way that was rolled while they were learnt."""

    @property
    def is_learnt(self) -> bool:
        """Whether they are learnt."""
        return self.learnt >= LEAST_LEARNT and self.way_m >= LEAST_M

    def after(self, rims: list[float], elapsed_ns: int, runs: bool = False) -> Radii:
        """Learn from rims that roll, of the expected radius all; NaN: not known.

        Such as turn backwards count so where the train surely `runs`.
        """
        rolls = [rim > 0.0 or (runs and rim < 0.0) for rim in rims]  # never true of NaN
        middle = median([abs(rim) for rim, one in zip(rims, rolls, strict=True) if one] or [0.0])
        if middle < LEARNING_MPS:
            return self
        part = max(LEARNT, 1.0 / (self.learnt + 1))
        own = tuple(
            _nearer(before, middle / rim, part) if one else before
            for before, rim, one in zip(self.own, rims, rolls, strict=True)
        )
        turned = (each * rim / middle - 1.0 for each, rim, one in zip(self.own, rims, rolls, strict=True) if one)
        off = [min(each**2, UNEQUAL**2) for each in turned]  # more is no noise: an axle slides
        noise = self.noise + max(LEARNT, 1.0 / self.learnt) * (sum(off) / len(off) - self.noise) if self.learnt else 0.0
        return Radii(own, self.learnt + 1, noise, self.way_m + middle * elapsed_ns / S)

    def rims(self, config: Config, sample: WheelSample) -> list[float]:
        """Speeds of the rims that are heard, of the middle radius all, as far as that is learnt, m/s."""
        if len(self.own) != len(sample.speeds_radps):
            return []
        own = (radius * each for radius, each in zip(self.own, sample.speeds_radps, strict=True))
        return [each * config.train.wheel_radius_m for each in own if not math.isnan(each)]

    def fastest(self, rims: list[float]) -> float:
        """Speed of the fastest of some rims, less by what the fastest of some is by chance."""
        return max(rims) * (1.0 - self.by_chance(len(rims)))

    def by_chance(self, count: int) -> float:
        """By how much the fastest of so many is faster than their mean by chance, relative; the slowest is as slow."""
        return BY_CHANCE * math.sqrt(2.0 * math.log(count) * self.noise)


def _nearer(before: float, shown: float, part: float) -> float:
    """By a part nearer to what is shown; at once where that is of the other direction."""
    return before + part * (shown - before) if before * shown > 0.0 else shown
