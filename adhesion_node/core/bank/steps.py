# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Steps of the measured positions: a balise, or another set of satellites, moves them and not the train."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from ..belief.rail import Rail
from ..intake.samples import Measurement
from .following import followed
from .layout import POSITION, SPEED
from .memory import Memory
from .motion import Foreseen, white_variance

if TYPE_CHECKING:
    from ..config import Config

S = 1_000_000_000

AGREEING = 3
"""Positions in a row that must lie off alike."""

FIRST_SIGMA, MEAN_SIGMA, ALIKE_SIGMA = 2.5, 2.3, 3.5
"""By how much the first of them and their mean must lie off; within what they agree, in declared deviations."""

ABRUPT = 0.6
"""Share of it that the position before may have been off: what grows is motion."""

SOON_S, GROWN_SIGMA = 0.5, 2.2
"""Time within which positions that lie behind are sooner a step than an axle's, and standard deviations by which the
newest of them may lie further behind than the first."""

BACK = 0.3
"""A step takes the one before back if it is as large to within this share: what reflects a signal passes by."""

AGAIN = 0.5
"""Share of the way between two steps within which an axle that slides falls behind once more, and nothing steps so."""

NEAR, FAR_NS = 4.0, 2 * S
"""Size of a step over `position_step_std_m` up to which so many positions are enough. Beyond, all of so long must lie
off alike, to within that size: bursts of outliers are shorter."""


class Stepping(NamedTuple):
    """Positions that lie off alike, and what was believed before the first of them."""

    before: Memory | None = None
    """None: there are none."""
    since: tuple[Measurement, ...] = ()
    off_m: tuple[float, ...] = ()
    last_off_m: float = 0.0
    """Of the position before."""
    stepped_m: float = -math.inf
    """Where the positions stepped last, ..."""
    by_m: float = 0.0
    """... and by how much."""

    def after(self, config: Config, memory: Memory, measurement: Measurement, off: Foreseen) -> Stepping:
        """Take in a measurement; its position, if it has one, lies so far off what `memory` had foreseen."""
        if not measurement.has_position:
            return self._replace(since=(*self.since, measurement)) if self.before is not None else self
        alike_m, near_m = ALIKE_SIGMA * math.sqrt(measurement.variance_m2), NEAR * config.position_step_std_m
        if self._waits(config):
            within_m = near_m if self.is_far(config) else min(alike_m, abs(self.off_m[0]))
            if abs(off.metres - self.off_m[0]) < within_m:
                return self._replace(since=(*self.since, measurement), off_m=(*self.off_m, off.metres))
        calm = Stepping(last_off_m=off.metres, stepped_m=self.stepped_m, by_m=self.by_m)
        if not abs(off.metres) > FIRST_SIGMA * off.std_m:
            return calm
        way_m = abs(measurement.position_m - self.stepped_m)
        spaced = way_m >= config.position_step_spacing_m
        again = off.metres * self.by_m > 0.0 and way_m < AGAIN * config.position_step_spacing_m
        back = not again and abs(off.metres + self.by_m) < max(alike_m, BACK * abs(self.by_m))
        abrupt = abs(self.last_off_m) < ABRUPT * abs(off.metres)
        plain = abs(off.metres) <= near_m or (off.std_m < near_m and off.nearest > FIRST_SIGMA)
        if (spaced or back) and abrupt and plain:  # else they tell where the train is
            return calm._replace(before=memory, since=(measurement,), off_m=(off.metres,))
        return calm

    def is_far(self, config: Config) -> bool:
        """Whether it is more than a balise corrects."""
        return bool(self.off_m) and abs(self.off_m[0]) > NEAR * config.position_step_std_m

    def doubts(self, config: Config) -> bool:
        """Whether the positions may have stepped far: until that is known they tell nothing."""
        return self.is_far(config) and self._waits(config)

    def tells(self, config: Config, measurement: Measurement, off: Foreseen) -> bool:
        """Whether a position so far off tells of an axle that slides.

        Where another sensor tells the speed with it such an axle falls behind, and never runs ahead.
        """
        ahead = off.metres > 0.0 and _is_aided(config, measurement)
        return not (ahead or self._may_be(config, measurement))

    def _may_be(self, config: Config, measurement: Measurement) -> bool:
        """Whether the newest position lies off as the first did and more have to: till then it tells nothing.

        An axle that slides falls behind, too. So where they lie behind they must come soon, or another sensor tell the
        speed, and the newest must not have fallen further behind.
        """
        if self.before is None or len(self.off_m) == 1 or not (measurement.has_position and self._waits(config)):
            return False
        if self.off_m[-1] > 0.0:
            return True
        elapsed_s = (measurement.t_ns - self.since[0].t_ns) / S
        if elapsed_s > SOON_S and not any(_is_aided(config, each) for each in self.since):
            return False
        bank, declared_m = self.before.bank, math.sqrt(measurement.variance_m2)
        white = float(bank.weight @ white_variance(bank, declared_m, self.before.coarse.std_m))
        error_m = GROWN_SIGMA * math.sqrt(2.0 * white + (bank.std_of(SPEED) * elapsed_s) ** 2)
        return self.off_m[-1] > self.off_m[0] - error_m

    def _waits(self, config: Config) -> bool:
        """Whether more positions have to say that they have stepped."""
        if len(self.off_m) < AGREEING:
            return bool(self.off_m)
        return self.is_far(config) and self._lasts_ns < FAR_NS

    @property
    def _lasts_ns(self) -> int:
        return max(each.t_ns for each in self.since if each.has_position) - self.since[0].t_ns

    def size_m(self, config: Config, std_m: float) -> float:
        """Size of the step; 0 unless it is plain."""
        if not self.off_m or self._waits(config):
            return 0.0
        mean = sum(self.off_m) / len(self.off_m)
        return mean if abs(mean) > MEAN_SIGMA * std_m else 0.0

    def taken(self, config: Config, size_m: float, rail: Callable[[], Rail]) -> tuple[Memory, Stepping]:
        """The train followed anew from before the step on, which moves its position and nothing else.

        What a far one grows by is motion: the clock may have stood, and the train be slower by now.
        """
        assert self.before is not None  # there is no size without it
        bank = self.before.bank
        covariance = bank.covariance.copy()
        covariance[:, POSITION, POSITION] += size_m**2
        if self.is_far(config):
            covariance[:, SPEED, SPEED] += ((self.off_m[-1] - self.off_m[0]) * S / self._lasts_ns) ** 2
        course = self.before.course.stepped(self.since[0].t_ns, size_m)
        memory = self.before._replace(bank=bank._replace(covariance=covariance), course=course)
        for measurement in self.since:
            memory = followed(config, memory, measurement, rail)
        return memory, Stepping(stepped_m=self.since[-1].position_m, by_m=size_m)


def _is_aided(config: Config, measurement: Measurement) -> bool:
    """Whether another sensor tells the speed beside a position: an axle's own is that of the wheel that slides."""
    return bool(measurement.wheels or (measurement.all_speeds and config.speed_source != "axle"))
