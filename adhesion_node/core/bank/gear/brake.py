# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the brake does, by what is measured of it: pressure that the slide protection dumps is no released brake."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from ...intake.samples import DemandSample, PressureSample
from .seldom import apart_ns, at_least

if TYPE_CHECKING:
    from ...config import Config

S = 1_000_000_000

DUMP_PA, DUMP_SHARE, DUMP_NS = 60e3, 0.15, S // 2
"""A fall of the pressure by so much, and by so much of what it was, within this time: no driver releases so fast unless
his brake lets go as fast as it builds up."""

FELL_PA, FELL_SHARE, FELL_NS = 30e3, 0.1, 8 * S
"""A fall by so much, and by so much of what it was, within the time of a dump may be slide protection's that holds all
axles gently, whatever the wheels show: for so long the brake is not said to limit."""

HELD_NS = 4 * S
"""So long behind a dump the brake counts as demanded as before."""

EMPTY_NS, EMPTIED_NS = 3 * S // 2, 4 * S
"""A cylinder that has been empty so long was released; the latter where axles are seen to slide: gentle protection
empties it until a rim has come back, which takes seconds on a film."""

LATELY, KEPT, HELD, EMPTY = 1.5, 3.5, 8.0, 4.5
"""Samples that the times of a fall, of those that are kept, behind a dump and of an empty cylinder hold at least, where
they come seldom."""

SLID_NS = 2 * S
"""So long behind a dump axles have slid of late."""

LEFT = 0.1
"""Part of the pressure that is left once a brake has let go: within `brake_build_up_s`, as it builds up."""

DRIVEN = 1.2
"""Times as fast as it builds up a driver releases a brake in even steps."""

RELEASED = 4.0
"""Times its build-up that a brake takes to let go where no gauge shows it: 15 to 20 s for 3 to 5 (UIC 540)."""

SWING_PA, SWING_SHARE = 10e3, 0.03
"""Behind a dump the protection is at work as long as the pressure falls and rises, or rises and falls, by so much, and
by so much of what is demanded, within a second: a driver's hand is steadier, and so is a gauge."""

RISING_SHARE, RISING_NS = 0.1, S
"""Of the full pressure within this time, is a brake that is being applied harder."""


class BrakeSeen(NamedTuple):
    """What is known of the brake; pressures are gauge."""

    recent: tuple[PressureSample, ...] = ()
    """Pressures of the last second."""
    demanded_pa: float = 0.0
    applied_pa: float = 0.0
    """What the cylinders press with, on the mean, as far as is known."""
    dumped_ns: int | None = None
    """When the slide protection dumped last."""
    full_ns: int | None = None
    """When the cylinder was last not empty."""
    fell_ns: int | None = None
    """When the pressure fell last as gentle slide protection lets it fall."""
    gauged: bool = False
    """Whether samples come each by itself: what is said again between them is none."""
    asked: tuple[DemandSample, ...] = ()
    """The newest demand that was heard, if any."""

    def after(
        self,
        config: Config,
        pressures: Iterable[PressureSample],
        demand_pa: float | None,
        rolls: bool | None = None,
        demands: Sequence[DemandSample] = (),
    ) -> BrakeSeen:
        """Take in pressures, by their stamps, and what the handle or valve demands, if that is known.

        Of the `demands` heard since the call before each counts from its stamp on, else the one given, the newest.

        Where every axle `rolls`, or as the demand falls, what falls was released; None: no wheels are seen. As long as
        some are seen to slide the protection that has dumped is at work; of what is demanded no more it tells nothing.
        """
        brake, heard = self, sorted({*self.asked, *demands})
        for sample in pressures:
            by_then = [each.pressure_pa for each in heard if each.t_ns <= sample.t_ns]
            asked_pa = by_then[-1] if by_then and demand_pa is not None else demand_pa
            brake = brake._pressed(config, sample, asked_pa, rolls)
        return brake._replace(asked=tuple(heard[-1:])) if demands else brake

    def _pressed(
        self, config: Config, sample: PressureSample, demand_pa: float | None, rolls: bool | None
    ) -> BrakeSeen:
        t_ns, pressure = sample
        every_ns = apart_ns(self.recent[-1].t_ns if self.recent else None, t_ns)
        kept_ns, end = at_least(RISING_NS, KEPT, every_ns), bisect_left(self.recent, (t_ns,))
        recent = (*self.recent[bisect_left(self.recent, (t_ns - kept_ns,)) : end], sample)
        empty = pressure < config.least_pressure_pa
        full_ns = self.full_ns if empty else t_ns
        if config.pressure_kind == "demanded":
            follows = self._following(config, sample, pressure)
            return BrakeSeen(recent, pressure, follows, None, full_ns, gauged=self.gauged, asked=self.asked)
        lately = recent[bisect_left(recent, (t_ns - at_least(DUMP_NS, LATELY, every_ns),)) :]
        peak = max([each.pressure_pa for each in lately])
        eased = demand_pa is not None and demand_pa < min(self.demanded_pa, (1.0 - DUMP_SHARE) * self.applied_pa)
        dumped_ns = None if rolls or eased else self.dumped_ns
        if demand_pa is not None or rolls is not None:
            dumps = _falls(lately) and (demand_pa is None or pressure < (1.0 - DUMP_SHARE) * demand_pa)
        else:  # nothing tells it from a release but that it is quicker, or comes back
            least_pa = DRIVEN * config.train.full_pressure_pa / config.brake_build_up_s
            dumps = _falls(lately, config.brake_build_up_s, least_pa) or _swings(
                recent, max(DUMP_PA, DUMP_SHARE * peak)
            )
        if dumped_ns is not None:
            dumps = dumps or _swings(recent, max(SWING_PA, SWING_SHARE * self.demanded_pa))
        fell = peak - pressure >= max(FELL_PA, FELL_SHARE * peak) and (
            demand_pa is None or pressure < (1.0 - FELL_SHARE) * demand_pa
        )
        fell_ns = t_ns if fell else self.fell_ns
        dumped_ns = t_ns if dumps and not rolls else dumped_ns
        held = dumped_ns is not None and (rolls is False or t_ns - dumped_ns < at_least(HELD_NS, HELD, every_ns))
        empty_ns = at_least(EMPTIED_NS if rolls is False else EMPTY_NS, EMPTY, every_ns)
        dumping = held and full_ns is not None and t_ns - full_ns < empty_ns
        demanded = demand_pa
        if demanded is None:
            demanded = max(self.demanded_pa, peak) if dumping else pressure  # it fell before that was a dump
        applied = pressure
        if dumping:
            applied = demanded  # the axles that roll are pressed as is asked of them
        elif config.pressure_kind == "mean" and not rolls and pressure <= recent[0].pressure_pa * (1.0 + RISING_SHARE):
            applied = sum(each.pressure_pa for each in recent) / len(recent)  # slide protection makes it swing
        if demand_pa is not None:  # what cylinders lack of it an electric brake gives
            applied = max(applied, self._following(config, sample, demand_pa))
        return BrakeSeen(
            recent, demanded, applied, dumped_ns if dumping else None, full_ns, fell_ns, self.gauged, self.asked
        )

    def _following(self, config: Config, sample: PressureSample, demanded_pa: float) -> float:
        """What presses by now of what is demanded: it builds up as a ramp, and lets go as one, or as it empties."""
        if not self.recent:
            return sample.pressure_pa
        times = (sample.t_ns - self.recent[-1].t_ns) / S / config.brake_build_up_s
        most, more = times * config.train.full_pressure_pa, demanded_pa - self.applied_pa
        return self.applied_pa + (min(more, most) if more > 0.0 else max(more * (1.0 - LEFT**times), -most))

    def repeats(self, pressure_pa: float | None) -> bool:
        """Whether a pressure is no new one, but the last sample said again until the next."""
        return self.gauged and bool(self.recent) and pressure_pa == self.recent[-1].pressure_pa

    def has_slid(self, now_ns: int) -> bool:
        """Whether the slide protection has been at work of late."""
        return self.dumped_ns is not None and now_ns - self.dumped_ns < SLID_NS

    def has_fallen(self, now_ns: int) -> bool:
        """Whether the pressure has lately fallen as gentle slide protection lets it fall."""
        return self.fell_ns is not None and now_ns - self.fell_ns < FELL_NS

    def lets_go(self, config: Config) -> bool:
        """Whether the pressure falls or is gone: by slide protection, or a release, which tells nothing of the rail."""
        peak = max((each.pressure_pa for each in self.recent), default=0.0)
        least = max(config.brake_threshold_pa, 1.0, (1.0 - FELL_SHARE) * peak)
        return self.pressure_pa < least

    def lingers(self, config: Config, now_ns: int) -> bool:
        """Whether cylinders may press still, though nothing is demanded any more."""
        if self.full_ns is None:
            return False
        measured = self.gauged and config.pressure_kind != "demanded"
        return now_ns - self.full_ns < (EMPTY_NS if measured else RELEASED * config.brake_build_up_s * S)

    def unseen_pa(self, now_ns: int) -> float:
        """By how much the pressure may have changed since it was measured, if it goes on as it did."""
        if self.dumped_ns is not None or len(self.recent) < 2:
            return 0.0
        (before_ns, before_pa), (newest_ns, newest_pa) = self.recent[-2:]
        return abs(newest_pa - before_pa) * min((now_ns - newest_ns) / (newest_ns - before_ns), 1.0)

    @property
    def pressure_pa(self) -> float:
        """The newest pressure; 0: nothing was measured."""
        return self.recent[-1].pressure_pa if self.recent else 0.0

    @property
    def known(self) -> bool:
        """Whether anything is measured of the brake."""
        return bool(self.recent)

    @property
    def rising(self) -> bool:
        """Whether the brake is being applied harder."""
        if self.dumped_ns is not None or not self.recent:
            return False  # slide protection makes pressures rise, too
        return self.recent[-1].pressure_pa > (1.0 + RISING_SHARE) * self.recent[0].pressure_pa


def _falls(lately: Sequence[PressureSample], released_s: float = math.inf, released_pa: float = 0.0) -> bool:
    """Whether the newest pressure is that of a dump.

    A driver releases no more than 90 % within `released_s`, nor `released_pa` in a second.
    """
    now_ns, pressure_pa = lately[-1]
    return any(
        before_pa - pressure_pa
        >= max(
            DUMP_PA,
            DUMP_SHARE * before_pa,
            before_pa * (1.0 - LEFT ** ((now_ns - t_ns) / S / released_s)),
            released_pa * (now_ns - t_ns) / S,
        )
        for t_ns, before_pa in lately
    )


def _swings(recent: Sequence[PressureSample], least_pa: float) -> bool:
    """Whether pressures have fallen and risen, or risen and fallen, by so much."""
    for sign in (1.0, -1.0):
        top, fallen = -math.inf, math.inf  # fallen: the least behind a fall by so much
        for _, pressure_pa in recent:
            top = max(top, sign * pressure_pa)
            if top - sign * pressure_pa >= least_pa:
                fallen = min(fallen, sign * pressure_pa)
            if sign * pressure_pa - fallen >= least_pa:
                return True
    return False
