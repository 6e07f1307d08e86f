# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is well formed and must not be believed all the same: a position sensor that is stuck, a speed in km/h."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Generic, NamedTuple, Protocol, TypeVar

from .outcome import Event, Outcome
from .samples import Measurement

HELD_S, STUCK_S = 3.0, 1.2
"""A position that is the same to the bit again is no measurement for so long, but a value that is held until the next
one, as of a receiver that measures once a second; from when on its sensor is stuck if the train must have moved on."""

STUCK_STEPS, LEAST_STUCK_M, MOST_STUCK_M = 2.0, 2.0, 10.0
"""A position that repeats itself to the bit comes in steps, and steps of d alone have the variance d^2/12. A train that
must have gone so many of the greatest steps that the variance allows, within these bounds, has a stuck sensor."""

STRONGEST_MPS2, SLOWER_SIGMA = 3.0, 3.0
"""No train brakes harder, or is slower by more standard deviations than it was known to be."""

KMH_PER_MPS, KMH_BAND, KMH_FROM_MPS = 3.6, 0.15, 5.0
"""A speed within this share of 3.6 times the estimate is one in km/h; told from this speed on."""

PACE_NS = 2_000_000_000
"""Positions tell a speed over so long at least: those of a metre to a metre and a half per second."""

RUNS_MPS, RUNS_SPANS = 12.0, 3
"""A train whose positions were so fast over so many spans, one after the other, did not stop within the last two; one
position that is far off makes two of them fast."""

SLOWER, AGREES = (0.8, 3.0), (0.9, 1.0)
"""A speed that is less than this share of how fast positions run, less this, m/s, over as many spans is not the
train's: a wheel that slides is behind, and no receiver's error runs ahead so fast for so long. It is again from the
second on."""


class Motion(Protocol):
    """What was known of the train's motion at some time."""

    @property
    def t_ns(self) -> int: ...

    @property
    def speed_mps(self) -> float: ...

    @property
    def speed_std_mps(self) -> float: ...


class Known(Protocol):
    """It can tell what was known at some time."""

    @property
    def estimate(self) -> Motion: ...


Of = TypeVar("Of", bound=Known)


class Repeated(NamedTuple, Generic[Of]):
    """A position, since when it has been the same, and what was known before."""

    position_m: float
    since_ns: int
    before: Of | None
    newest_ns: int = 0
    gone_m: float = 0.0
    """Way that the train has gone since by another sensor."""

    def after(self, measurement: Measurement, known: Of | None, running_mps: float = 0.0) -> Repeated[Of]:
        """Note the next position; `known` is what is known now, and another sensor says that it runs so fast."""
        if measurement.position_m != self.position_m or measurement.t_ns < self.since_ns:
            return Repeated(measurement.position_m, measurement.t_ns, known, measurement.t_ns)
        gone_m = self.gone_m + running_mps * max(measurement.t_ns - self.newest_ns, 0) * 1e-9
        return self._replace(newest_ns=measurement.t_ns, gone_m=gone_m)

    def is_held(self, measurement: Measurement) -> bool:
        """Whether the position is the one before, said again."""
        return 0 < measurement.t_ns - self.since_ns < HELD_S * 1e9

    def is_stuck(self, measurement: Measurement) -> bool:
        """Whether the train must have moved on from a position that is still the same."""
        same_s = (measurement.t_ns - self.since_ns) * 1e-9
        if same_s < STUCK_S:  # most positions are new
            return False
        if self.gone_m >= stuck_way(measurement.variance_m2):
            return True
        if self.before is None:
            return False
        before = self.before.estimate
        known_s = abs(self.since_ns - before.t_ns) * 1e-9
        slowest = max(abs(before.speed_mps) - SLOWER_SIGMA * before.speed_std_mps - STRONGEST_MPS2 * known_s, 0.0)
        return least_way(slowest, same_s) >= stuck_way(measurement.variance_m2)


def stuck_way(variance_m2: float) -> float:
    """Way, m, over which no working sensor of this variance repeats itself.

    >>> [round(stuck_way(std_m**2), 2) for std_m in (0.1, 0.5, 5.0)]
    [2.0, 3.46, 10.0]
    """
    return min(max(STUCK_STEPS * math.sqrt(12.0 * variance_m2), LEAST_STUCK_M), MOST_STUCK_M)


def least_way(speed_mps: float, elapsed_s: float) -> float:
    """Way, m, that a train has gone at least after it was as fast as this.

    >>> least_way(30.0, 2.0), least_way(30.0, 100.0), least_way(0.0, 5.0)
    (54.0, 150.0, 0.0)
    """
    braking_s = min(elapsed_s, speed_mps / STRONGEST_MPS2)
    return speed_mps * braking_s - STRONGEST_MPS2 * braking_s**2 / 2


class Pace(NamedTuple):
    """How fast the positions go by themselves, over the last span of them: a speed in km/h deceives an estimate."""

    since_ns: int | None = None
    position_m: float = 0.0
    speed_mps: float = math.nan
    fast: int = 0
    """Spans, one after the other, over which they were those of a train that runs, ..."""
    slower: int = 0
    """... and over which the measured speed was far less."""
    shown: tuple[float, int] = (0.0, 0)
    """Sum and number of the speeds of this span."""

    @property
    def runs(self) -> bool:
        """Whether the train surely runs."""
        return self.fast >= RUNS_SPANS

    @property
    def belies(self) -> bool:
        """Whether the measured speed is surely not the train's."""
        return self.slower >= RUNS_SPANS

    def after(self, measurement: Measurement, speeds_mps: Sequence[float] = ()) -> Pace:
        """Note the next position, if there is one, and the speeds that were measured with it."""
        shown = self.shown[0] + sum(map(abs, speeds_mps)), self.shown[1] + len(speeds_mps)
        if not measurement.has_position:
            return self._replace(shown=shown) if speeds_mps else self
        t_ns, position_m, _ = measurement[:3]
        if self.since_ns is None or t_ns < self.since_ns:
            return Pace(t_ns, position_m)
        elapsed_ns = t_ns - self.since_ns
        if elapsed_ns < PACE_NS:
            return self._replace(shown=shown) if speeds_mps else self
        speed_mps = abs(position_m - self.position_m) / (elapsed_ns * 1e-9)
        slower, (share, less_mps) = self.slower, AGREES if self.belies else SLOWER
        if shown[1]:
            slower = slower + 1 if shown[0] / shown[1] < share * speed_mps - less_mps else 0
        return Pace(t_ns, position_m, speed_mps, self.fast + 1 if speed_mps > RUNS_MPS else 0, slower)


def believed(measurement: Measurement, pace: Pace) -> tuple[Measurement, tuple[Event, ...]]:
    """Without speeds that the positions belie, and what is to be told."""
    speeds = measurement.all_speeds
    if not (speeds and pace.belies):
        return measurement, ()
    event = Event(Outcome.STUCK, f"speed x = {speeds[-1].speed_mps:.6g} at {pace.speed_mps:.3g} m/s")
    return measurement._replace(speed_mps=None, speeds=()), (event,)


def in_mps(measurement: Measurement, known_mps: Iterable[float]) -> tuple[Measurement, tuple[Event, ...]]:
    """Without the speeds that are km/h of one of the train's known speeds (NaN: is not), and what is to be told."""
    known = [speed for speed in known_mps if speed >= KMH_FROM_MPS]

    def is_wrong(speed_mps: float | None) -> bool:
        return speed_mps is not None and any(is_kmh(speed_mps, each) for each in known)

    newest_mps = measurement.speed_mps
    wrong = [each for each in (*(sample.speed_mps for sample in measurement.speeds), newest_mps) if is_wrong(each)]
    if not wrong:
        return measurement, ()
    speeds = tuple(sample for sample in measurement.speeds if not is_wrong(sample.speed_mps))
    event = Event(Outcome.SPEED_IN_KMH, f"speed x = {wrong[-1]:g} at {min(known):.3g} m/s")
    return measurement._replace(speed_mps=None if is_wrong(newest_mps) else newest_mps, speeds=speeds), (event,)


def is_kmh(speed_mps: float, known_mps: float) -> bool:
    """Whether a measured speed is one in km/h, the train's being known."""
    return known_mps >= KMH_FROM_MPS and abs(speed_mps / (KMH_PER_MPS * known_mps) - 1.0) <= KMH_BAND
