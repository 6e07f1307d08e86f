# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the wheels tell of the axles: which of them slide, each by its own radius beside the others."""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING, NamedTuple

from ...intake.plausibility import STRONGEST_MPS2
from ...intake.samples import WheelSample
from .halting import Halting
from .seldom import apart_ns, at_least
from .wander import Wander

if TYPE_CHECKING:
    from ...config import Config

S = 1_000_000_000

SLID_NS, FRESH_NS = 3 * S, S
"""An axle counts as sliding so long, as its protection lets it roll in between; so long may wheels not be heard."""

FILLED_NS = 15 * S
"""For so long behind a slide an axle that rolls uses no more than those that slide: its protection fills the cylinder
slowly, and lets go of it again."""

SLID_SAMPLES = 16
"""An axle counts as sliding for so many samples where they come seldom, as slides fall between them."""

LEARNT = 0.05
"""Share of a new sample in what is learnt of a radius."""

LEAST_LEARNT, LEAST_M = 6, 12.0
"""Samples from which a radius is good for a speed, and way: of less positions that stand still tell nothing."""

UNEQUAL = 0.01
"""By how much wheels of unknown wear may differ, beside creep."""

UNSURE, ROLLING = 3.0, 2.0
"""Standard deviations of the train's speed within which creep may be none; times the creep that slides below which an
axle rolls for certain."""

BY_CHANCE = 0.5
"""The fastest of n rims is faster than their mean by chance: by sqrt(2 ln n) of their standard deviations at most, of
two by 0.48 of that, of twelve by 0.73. Under the brake fewer than all roll."""

UNLEARNT = 0.03
"""Error of all radii together of which nothing was learnt: wear."""

TURNS = 0.5
"""Share of the middle rim's speed from which an axle turns with the others, and is not dead."""

LEARNING_MPS = 5.0
"""Radii are learnt from this speed of the rims on, and creep is seen from this speed of the train on."""

BRAKE_BELOW = 0.05
"""Share of sliding axles below which the brake limits."""

SOME_SLIDE, TOLD, HINTED = 0.25, 4.0, 1.0
"""Share of sliding axles from which adhesion limits, and the log odds per second by which wheels tell which does, and
a single one that rolls: protection may hold just this one at a small creep, or keep its brake released."""

RISEN = 1.02
"""Times its lowest speed from which the fastest rim has risen, more than by noise."""

FALL_NS, FALL_SIGMA, FELL_NS, UNTOLD_NS = 2 * S // 5, 2.5, S, 120 * S
"""Time over which it is seen how fast the fastest rim falls or rises. Where it falls faster than any brake stops a
train, by so many standard deviations of its noise, all axles slide. They count so for the next time; where no pressure
tells of a brake, for the last one."""

SPUN_NS = 3 * S
"""For so long behind traction axles that have spun may spin still."""

AGREE_NS, FEWEST = 2 * S, 3
"""Rims, so many or more, that are as fast as each other and as the train for so long roll: those that slide are not."""

DEEPER = 1.3
"""Times as fast as ever in a braking it must fall to tell anything anew: else it errs as it did before."""

FALLS = 8.0
"""Log odds per second by which all axles slide then."""

UNISON_S = 1.5
"""For so long behind such a fall, and behind the brake's build-up, all axles may slide as one."""


class WheelsSeen(NamedTuple):
    """What is known of the axles."""

    radius: tuple[float, ...] = ()
    """True over expected radius of each, over the same of all."""
    learnt: int = 0
    """Samples from which they were learnt."""
    noise: float = 0.0
    """Variance of a rim's speed beside the others, relative."""
    slid_ns: tuple[int | None, ...] = ()
    """When each was last seen to slide."""
    rolled_ns: tuple[int | None, ...] = ()
    """When each was last seen to roll."""
    heard_ns: int | None = None
    """When they were last heard, ..."""
    every_ns: int = 0
    """... and how long behind the sample before."""
    way_m: float = 0.0
    """Way that was rolled while radii were learnt."""
    trusted_ns: int = 0
    """From when on the fastest rim may be taken for the train's speed."""
    lowest_mps: float = math.inf
    """Speed of the fastest rim at its lowest since the brake was applied."""
    risen: bool = False
    """Whether it has risen since, and rises no more: a train under the brake does not, so it slid and rolls again."""
    wander: Wander = Wander()
    """How it errs."""
    recent: tuple[tuple[int, float], ...] = ()
    """How fast it was of late, with stamps in ns, ..."""
    fell_ns: int | None = None
    """... when it last fell faster than a train can, ..."""
    fall_mps2: float = 0.0
    """... and how fast at most in this braking, to within `DEEPER`."""
    halting: Halting = Halting()
    """How they come down under the brake."""
    agree_ns: int | None = None
    """Since when all of them are as fast as each other, and as the train."""
    pulled_ns: int | None = None
    """When the train was last pulled."""

    def after(
        self, config: Config, sample: WheelSample, speed_mps: float, std_mps: float, braked: bool, pulled: bool = False
    ) -> WheelsSeen:
        """Take in the speeds of all axles while that of one which rolls is known so.

        An axle slides where it is slower than the train, or than the fastest axle: a train is not slower than that. It
        rolls where neither can be. While a train is `pulled` driven axles may spin: no more is learnt of radii.
        """
        count, nothing = len(sample.speeds_radps), (None,) * len(sample.speeds_radps)
        wheels = self if len(self.radius) == count else WheelsSeen((1.0,) * count, slid_ns=nothing, rolled_ns=nothing)
        rims = [each * config.train.wheel_radius_m for each in sample.speeds_radps]
        if braked and speed_mps < LEARNING_MPS:
            return wheels
        wheels = wheels._replace(heard_ns=sample.t_ns, every_ns=apart_ns(wheels.heard_ns, sample.t_ns))
        if not braked:
            return wheels if pulled and wheels.is_learnt else wheels._learning(rims)
        rims = [radius * rim for radius, rim in zip(wheels.radius, rims, strict=True)]
        fastest = max((rim for rim in rims if not math.isnan(rim)), default=0.0)
        unsure = UNSURE * std_mps / speed_mps
        by_train, by_fastest = ([1.0 - rim / most for rim in rims] for most in (speed_mps, max(fastest, 1e-6)))
        slid, rolled = list(wheels.slid_ns), list(wheels.rolled_ns)
        for axle, (creep, behind) in enumerate(zip(by_train, by_fastest, strict=True)):  # never true of NaN
            if creep > config.sliding_creep + unsure or behind > config.sliding_creep + UNEQUAL:
                slid[axle] = sample.t_ns
            elif creep + unsure < ROLLING * config.sliding_creep:
                rolled[axle] = sample.t_ns
        return wheels._replace(slid_ns=tuple(slid), rolled_ns=tuple(rolled))

    def _learning(self, rims: list[float]) -> WheelsSeen:
        turning = [rim for rim in rims if rim > 0.0]  # never true of NaN
        middle = median(turning) if turning else 0.0
        if middle < LEARNING_MPS:
            return self
        part = max(LEARNT, 1.0 / (self.learnt + 1))
        radius = tuple(
            before + part * (middle / rim - before) if rim > 0.0 else before
            for before, rim in zip(self.radius, rims, strict=True)
        )
        turned = (own * rim / middle - 1.0 for own, rim in zip(self.radius, rims, strict=True) if rim > 0.0)
        off = [min(each**2, UNEQUAL**2) for each in turned]  # more is no noise: an axle slides
        noise = self.noise + max(LEARNT, 1.0 / self.learnt) * (sum(off) / len(off) - self.noise) if self.learnt else 0.0
        way_m = self.way_m + middle * self.every_ns / S
        return self._replace(radius=radius, learnt=self.learnt + 1, noise=noise, way_m=way_m)

    @property
    def is_learnt(self) -> bool:
        """Whether the radii are learnt."""
        return self.learnt >= LEAST_LEARNT and self.way_m >= LEAST_M

    def rims(self, config: Config, sample: WheelSample) -> list[float]:
        """Speeds of the rims that are heard, of the middle radius all, as far as that is learnt, m/s."""
        if len(self.radius) != len(sample.speeds_radps):
            return []
        own = (radius * each for radius, each in zip(self.radius, sample.speeds_radps, strict=True))
        return [each * config.train.wheel_radius_m for each in own if not math.isnan(each)]

    def rolling(self, rims: list[float], pulled: bool) -> float:
        """Speed of a rim while no brake is applied: the middle one, as some may be dead; NaN: none is heard.

        While a train is `pulled` driven axles may spin, half of all or more: the slowest that turns with the others,
        but none that is slower than all of them, as it may drag, or lose pulses. Such as count backwards tell nothing.
        """
        middle = median(rims) if rims else math.nan
        if not (pulled and middle > 0.0):
            return middle
        slowest, *others = sorted(rim for rim in rims if rim >= TURNS * middle)
        return others[0] if len(others) > 1 and slowest < (1.0 - UNEQUAL) * others[0] else slowest

    def fastest(self, rims: list[float]) -> float:
        """Speed of the fastest of some rims, less by what the fastest of some is by chance."""
        return max(rims) * (1.0 - self._by_chance(len(rims)))

    def _by_chance(self, count: int) -> float:
        """By how much the fastest of so many is faster than their mean by chance, relative; the slowest is as slow."""
        return BY_CHANCE * math.sqrt(2.0 * math.log(count) * self.noise)

    def beside(self, fastest_mps: float, now_ns: int) -> WheelsSeen:
        """Note how fast the fastest rim is under the brake; it may be trusted once it has risen, until it falls."""
        recent = (*(each for each in self.recent if now_ns - each[0] <= FALL_NS), (now_ns, fastest_mps))
        then_ns, then_mps = recent[0]
        most = STRONGEST_MPS2 * (now_ns - then_ns) / S + FALL_SIGMA * math.sqrt(2.0 * self.noise) * then_mps
        if 2 * (now_ns - then_ns) >= FALL_NS and then_mps - fastest_mps > most:
            trusted_ns = max(self.trusted_ns, now_ns + round(UNISON_S * S))
            fall = S * (then_mps - fastest_mps) / (now_ns - then_ns)
            fall = fall if fall > DEEPER * self.fall_mps2 else self.fall_mps2
            fallen = self._replace(recent=recent, fell_ns=now_ns, fall_mps2=fall)
            return fallen._replace(trusted_ns=trusted_ns, lowest_mps=fastest_mps, risen=False)
        if self.risen:
            return self._replace(recent=recent)
        lowest = min(self.lowest_mps, fastest_mps)
        risen = RISEN * lowest < fastest_mps <= then_mps
        trusted_ns = min(self.trusted_ns, now_ns) if risen else self.trusted_ns
        return self._replace(recent=recent, trusted_ns=trusted_ns, lowest_mps=lowest, risen=risen)

    def fell(self, now_ns: int, within_ns: int = FELL_NS) -> bool:
        """Whether all axles slide, as the fastest rim has fallen faster than a train can."""
        return self.fell_ns is not None and now_ns - self.fell_ns < within_ns

    def agreeing(self, rims: list[float], least_mps: float, t_ns: int) -> WheelsSeen:
        """Note whether all rims are as fast as each other, and as one that rolls is at least: then no fall counts."""
        apart = UNEQUAL + 2.0 * self._by_chance(max(len(rims), 1))
        if len(rims) < FEWEST or min(rims) < max((1.0 - apart) * max(rims), least_mps):
            return self._replace(agree_ns=None)
        agreeing = self._replace(agree_ns=t_ns if self.agree_ns is None else self.agree_ns)
        return agreeing._replace(fell_ns=None) if agreeing.agree(t_ns) else agreeing

    def may_spin(self, now_ns: int) -> bool:
        """Whether driven axles may spin, as the train was pulled of late."""
        return self.pulled_ns is not None and now_ns - self.pulled_ns < SPUN_NS

    def agree(self, now_ns: int) -> bool:
        """Whether all of them roll, as they have agreed for long enough."""
        return self.agree_ns is not None and now_ns - self.agree_ns >= AGREE_NS

    def all_roll(self, now_ns: int) -> bool:
        """Whether they agree and none has slid for long: protection may hold such as have at one creep."""
        return self.agree(now_ns) and not any(self._seen(now_ns, UNTOLD_NS)[0])

    def share(self, now_ns: int, late_ns: int = SLID_NS) -> float | None:
        """Share of the axles that have slid of late, of those of which it is known; None where it is of too few."""
        slid, rolled = self._seen(now_ns, late_ns)
        known = sum(one or other for one, other in zip(slid, rolled, strict=True))
        if not known or 2 * known < len(slid) or (known == 1 and not any(slid)):
            return None
        return sum(slid) / known

    def one_rolls(self, now_ns: int) -> bool:
        """Whether no more than one axle is known of, of one or two that are heard, and that has not slid of late."""
        slid, rolled = self._seen(now_ns, SLID_NS)
        return len(slid) <= 2 and sum(rolled) == 1 and not any(slid)

    def _seen(self, now_ns: int, late_ns: int) -> tuple[list[bool], list[bool]]:
        """Which axles have slid of late, and which roll."""
        counts_ns = at_least(late_ns, SLID_SAMPLES, self.every_ns)
        slid = [each is not None and now_ns - each < counts_ns for each in self.slid_ns]
        return slid, [each is not None and now_ns - each < FRESH_NS for each in self.rolled_ns]


def told(share: float | None, dumping: bool, fell: bool = False, one_rolls: bool = False) -> float:
    """Log odds per second by which axles are known to slide: wheels say it, else the dumps of the slide protection.

    >>> told(0.8, False), told(0.0, False), told(None, True), told(None, False), told(0.8, False, fell=True)
    (4.0, -4.0, 4.0, 0.0, 8.0)
    >>> told(None, True, one_rolls=True), told(None, False, one_rolls=True)
    (4.0, -1.0)
    """
    if fell:
        return FALLS
    if share is None:
        return TOLD if dumping else -HINTED if one_rolls else 0.0
    return TOLD if share >= SOME_SLIDE else -TOLD if share < BRAKE_BELOW else 0.0
