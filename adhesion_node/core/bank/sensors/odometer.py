# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Positions of one axle's odometer: beside the wheels they are known by going with that axle where it slides."""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

from ...intake.samples import Measurement, WheelSample
from ..gear.radii import LEARNING_MPS
from ..gear.wheels import WheelsSeen
from .possible import strongest_mps2

if TYPE_CHECKING:
    from ...config import Config

S = 1_000_000_000

LOOK_NS, LONGEST_NS, SAMPLES = S // 2, 2 * S, 3
"""Time, at least and at most, and samples of the wheels at least, over which positions are held against them."""

LEAST_LEARNT, MOST_LEARNT = 12, 20
"""Looks from which it is known how positions differ from wheels that roll, and over how many the mean of that is."""

LEAST, APART_MPS = 0.005, 1.0
"""What they differ by at least, relative, as a look takes the mean of few samples; more than the latter is a step, or a
spin, unless it lasts."""

NOISY_MPS, QUIET_MPS = 0.5, 0.15
"""Standard deviations of that from which positions are no odometer's, and below which they may be: satellites that err
by 0.1 m white differ by 0.3 m/s."""

SCALE, CREEP = 0.01, 0.03
"""Error of an odometer's scale: its wheel's radius is known no better; and by how much more it errs where its axle
slides so gently that nothing shows it."""

MATCHED, MOST = 3.0, 6.5
"""Standard deviations within which positions go with an axle, and log odds that one look tells at most."""

FOUND, KEPT, CARRIED = 12.0, 24.0, 6.0
"""Log odds from which positions are an axle's, which takes two looks, that are kept at most, and that go into the next
braking, as sensors change: one look is enough there. Of satellites that err by 0.1 m white and by 2 m over 30 s they
were found so in none of 120 brakings."""


class Odometer(NamedTuple):
    """How the positions go beside the wheels."""

    since: tuple[int, float] | None = None
    """Stamp, ns, and place of the position from which on it is looked."""
    sums_mps: tuple[float, ...] = ()
    """Of the speeds of each rim since, ..."""
    samples: int = 0
    """... of so many."""
    scale: float = 1.0
    """Speed of the positions over that of rims that roll, ..."""
    variance: float = 0.0
    """... the variance of what they differ by, (m/s)^2, ..."""
    learnt: int = 0
    """... and of how many looks."""
    least_mps: float = 0.0
    """The train is as fast at least, as rims tell it: as the fastest, or as the hardest brake has left it, ..."""
    least_ns: int = 0
    """... at this time."""
    running: tuple[float, ...] = ()
    """Log odds of each axle that positions are its own, not the train's; no less than 0 (Page 1954)."""

    @property
    def is_found(self) -> bool:
        """Whether the positions are those of an axle."""
        return max(self.running, default=0.0) > FOUND

    def scale_error(self, rolled: bool, creeps: bool) -> float:
        """Error of the speed that they tell, relative: what wheels roll as no receiver does may be an axle's own.

        If they are known to be a wheel's, they are. Without wheels beside them, that one `creeps` where axles slide.
        """
        quiet = self.learnt >= LEAST_LEARNT and self.variance < QUIET_MPS**2
        return math.hypot(SCALE, CREEP * creeps) if rolled else SCALE if quiet else 0.0

    def after(
        self, config: Config, wheels: WheelsSeen, measurement: Measurement, braked: bool, hanging: tuple[int, ...] = ()
    ) -> Odometer:
        """Take in what positions, believed or not, and wheels that do not seem to hang say up to a measurement."""
        odometer = self
        for sample in measurement.wheels if wheels.radii.is_learnt else ():
            odometer = odometer._turned(config, wheels.radii.own, sample.without(hanging))
        return odometer._placed(config, wheels, measurement, braked) if measurement.has_position else odometer

    def _placed(self, config: Config, wheels: WheelsSeen, measurement: Measurement, braked: bool) -> Odometer:
        t_ns, place_m = measurement[:2]
        begun = self._replace(since=(t_ns, place_m), sums_mps=(), samples=0)
        elapsed_ns = t_ns - (self.since or (0, 0.0))[0]
        if self.since is None or not wheels.radii.is_learnt or elapsed_ns > LONGEST_NS:
            return begun
        if elapsed_ns < LOOK_NS or self.samples < SAMPLES:
            return self
        rims = [each / self.samples for each in self.sums_mps]
        known = [each for each in rims if not math.isnan(each)]
        if not known or median(known) < LEARNING_MPS:
            return begun
        speed_mps = S * (place_m - self.since[1]) / elapsed_ns
        least_mps = min(median(known), speed_mps / self.scale)  # axles that spin are faster than the train
        begun = begun._replace(least_mps=least_mps, least_ns=t_ns)
        if not braked:
            return begun._learning(speed_mps, median(known))
        if wheels.may_spin(t_ns):
            return begun
        left_mps = self.least_mps - strongest_mps2(config, self.least_mps) * (t_ns - self.least_ns) / S
        return begun._held_against(speed_mps, rims, max(wheels.radii.fastest(known), left_mps))

    def _turned(self, config: Config, radius: tuple[float, ...], sample: WheelSample) -> Odometer:
        """Take in the speeds of the wheels, each by its own radius."""
        if len(sample.speeds_radps) != len(radius):
            return Odometer()
        radius_m = config.train.wheel_radius_m
        before = self.sums_mps or (0.0,) * len(radius)
        turned = zip(before, radius, sample.speeds_radps, strict=True)
        return self._replace(
            sums_mps=tuple(sum_ + own * radius_m * one for sum_, own, one in turned), samples=self.samples + 1
        )

    def _learning(self, speed_mps: float, rim_mps: float) -> Odometer:
        """No brake is applied: wheels roll, but for such as spin."""
        off = speed_mps - self.scale * rim_mps
        odometer = self._replace(running=tuple(min(odds, CARRIED) for odds in self.running))
        if self.learnt >= LEAST_LEARNT and abs(off) > APART_MPS:
            return odometer._replace(learnt=self.learnt - 1)
        part = 1.0 / (self.learnt + 1)
        variance = self.variance + part * (off**2 - self.variance) if self.learnt else 0.0
        learnt, scale = min(self.learnt + 1, MOST_LEARNT), self.scale + part * off / rim_mps
        return odometer._replace(scale=scale, variance=variance, learnt=learnt)

    def _held_against(self, speed_mps: float, rims: list[float], least_mps: float) -> Odometer:
        """Under the brake: positions that are slower than the train can be go with an axle, or err."""
        if self.learnt < LEAST_LEARNT or self.variance > NOISY_MPS**2:
            return self
        speed_mps, variance = speed_mps / self.scale, self.variance + (LEAST * least_mps) ** 2
        by_train = (speed_mps - least_mps) ** 2

        def told(rim_mps: float) -> float:
            by_axle = (speed_mps - rim_mps) ** 2
            goes = by_axle < MATCHED**2 * variance  # never true of NaN
            return min(max((by_train - by_axle) / (2.0 * variance), -MOST), MOST) if goes else -MOST

        before = self.running if len(self.running) == len(rims) else (0.0,) * len(rims)
        running = (min(max(odds + told(rim), 0.0), KEPT) for odds, rim in zip(before, rims, strict=True))
        return self._replace(running=tuple(running), least_mps=least_mps)
