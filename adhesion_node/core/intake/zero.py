# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a gauge of brake pressures shows while no brake is applied: more than nothing where its zero is off."""

from __future__ import annotations

from typing import NamedTuple

from .plausibility import Motion
from .samples import Measurement, PressureSample

S = 1_000_000_000

MOST_PA = 25e3
"""No zero is off by more: 2.5 % of a gauge of 10 bar. A brake that presses with as much slows hardly any train."""

LEVEL_PA, LEVEL_NS, LONG_NS, APART_NS = 12e3, 5 * S, 20 * S, 2 * S
"""Pressures that differ by no more, as noise or steps of 0.1 bar make them, are one level. It counts once it was held
for so long, begins anew after so long, and has no gap of more than so much."""

SLOWED_MPS2, RUNS_MPS, BETTER = 0.1, 5.0, 2.0
"""A train that loses more speed than this brakes otherwise, and one that is slower may stand. Of a speed that has come
to be known so many times better it is counted from now."""


class Level(NamedTuple):
    """Pressures that are the same but for noise."""

    since_ns: int
    newest_ns: int
    least_pa: float
    most_pa: float
    total_pa: float
    samples: int
    known: Motion
    """The train's motion when it began."""

    @property
    def held_ns(self) -> int:
        """For how long it was held."""
        return self.newest_ns - self.since_ns

    @property
    def mean_pa(self) -> float:
        """Their mean."""
        return self.total_pa / self.samples


class Zero(NamedTuple):
    """The lowest level that a gauge has held while the train ran as without a brake."""

    shown_pa: float | None = None
    """None: none yet."""
    level: Level | None = None
    """The present one."""

    def off_pa(self, threshold_pa: float) -> float:
        """By how much pressures are too high; 0 where that is less than counts as a brake."""
        return 0.0 if self.shown_pa is None or self.shown_pa < threshold_pa else self.shown_pa

    def after(self, measurement: Measurement, threshold_pa: float, known: Motion | None) -> Zero:
        """Note the next pressure, if there is one; `known` is what is known of the train's motion."""
        pressure_pa = measurement.brake_pressure_pa
        if self.shown_pa is not None and self.shown_pa < threshold_pa:
            return self  # nothing lower matters
        if known is None or pressure_pa is None or pressure_pa > MOST_PA:
            return self if self.level is None else self._replace(level=None)
        level = _joined(self.level, measurement.t_ns, pressure_pa, known)
        if not (measurement.has_position or measurement.all_speeds):
            return self._replace(level=level)  # the train would be met anew by nothing: no estimate for longer
        lowest = self.shown_pa is None or level.most_pa < self.shown_pa
        found = level.held_ns >= LEVEL_NS and lowest and (level.mean_pa < threshold_pa or _runs(level, known))
        if found or level.held_ns >= LONG_NS:
            return Zero(level.mean_pa if found else self.shown_pa)
        return self._replace(level=level)

    def corrected(self, measurement: Measurement, threshold_pa: float) -> Measurement:
        """With pressures above what the gauge shows while no brake is applied."""
        off_pa, newest_pa = self.off_pa(threshold_pa), measurement.brake_pressure_pa
        if not off_pa or newest_pa is None:
            return measurement
        pressures = tuple(
            PressureSample(t_ns, max(pressure_pa - off_pa, 0.0)) for t_ns, pressure_pa in measurement.pressures
        )
        return measurement._replace(brake_pressure_pa=max(newest_pa - off_pa, 0.0), pressures=pressures)


def _joined(level: Level | None, t_ns: int, pressure_pa: float, known: Motion) -> Level:
    """The level with one more pressure; another one where that is off it or late, or the speed is known far better."""
    alone = Level(t_ns, t_ns, pressure_pa, pressure_pa, pressure_pa, 1, known)
    if level is None or not 0 <= t_ns - level.newest_ns <= APART_NS:
        return alone
    least_pa, most_pa = min(level.least_pa, pressure_pa), max(level.most_pa, pressure_pa)
    if most_pa - least_pa > LEVEL_PA or BETTER * known.speed_std_mps < level.known.speed_std_mps:
        return alone
    return Level(level.since_ns, t_ns, least_pa, most_pa, level.total_pa + pressure_pa, level.samples + 1, level.known)


def _runs(level: Level, known: Motion) -> bool:
    """Whether the train has run over the time of a level, and surely not slowed down as under a brake."""
    before = level.known
    lost_mps = abs(before.speed_mps) - abs(known.speed_mps) + before.speed_std_mps + known.speed_std_mps
    return abs(known.speed_mps) > RUNS_MPS and lost_mps < SLOWED_MPS2 * (known.t_ns - before.t_ns) / S
