# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What goes into the estimators: one sample per message of a sensor, and what they make together."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import chain
from typing import NamedTuple

MAX_POSITION_M = 1e7
MAX_SPEED_MPS = 200.0
MAX_PRESSURE_PA = 1e7
MAX_ACCELERATION_MPS2 = 200.0
"""Of the shocks that a bogie feels too."""

MIN_VARIANCE_M2, MAX_VARIANCE_M2 = 1e-12, 1e8
"""From (1 um)^2 to (10 km)^2: beyond them arithmetic suffers and no sensor exists."""


class PositionSample(NamedTuple):
    """A measured along-track position."""

    t_ns: int
    position_m: float
    variance_m2: float

    def is_valid(self) -> bool:
        """Whether every number is finite and physically possible."""
        possible = abs(self.position_m) <= MAX_POSITION_M  # never true of NaN
        return possible and MIN_VARIANCE_M2 <= self.variance_m2 <= MAX_VARIANCE_M2


class PressureSample(NamedTuple):
    """A measured brake-cylinder pressure, gauge."""

    t_ns: int
    pressure_pa: float

    def is_valid(self) -> bool:
        """Whether it is finite and physically possible."""
        return abs(self.pressure_pa) <= MAX_PRESSURE_PA


class SpeedSample(NamedTuple):
    """A measured speed."""

    t_ns: int
    speed_mps: float
    variance: float | None = None
    """(m/s)^2; None: unknown."""

    def is_valid(self) -> bool:
        """Whether it is finite and physically possible."""
        return abs(self.speed_mps) <= MAX_SPEED_MPS and _is_variance(self.variance)


class ImuSample(NamedTuple):
    """A measured acceleration along the track, forward positive: what an accelerometer feels, so without the grade."""

    t_ns: int
    acceleration_mps2: float
    variance: float | None = None
    """(m/s^2)^2; None: unknown."""

    def is_valid(self) -> bool:
        """Whether it is finite and physically possible."""
        return abs(self.acceleration_mps2) <= MAX_ACCELERATION_MPS2 and _is_variance(self.variance)


class DemandSample(NamedTuple):
    """The brake-cylinder pressure, gauge, that the driver's handle or valve demands."""

    t_ns: int
    pressure_pa: float

    def is_valid(self) -> bool:
        """Whether it is finite and physically possible."""
        return abs(self.pressure_pa) <= MAX_PRESSURE_PA


class WheelSample(NamedTuple):
    """Measured angular speeds of the axles, every time in the same order; NaN where one is not known."""

    t_ns: int
    speeds_radps: tuple[float, ...]

    @property
    def known_radps(self) -> tuple[float, ...]:
        """Those of the axles that are known."""
        return tuple(speed for speed in self.speeds_radps if not math.isnan(speed))

    def without(self, axles: tuple[int, ...]) -> WheelSample:
        """The same without those of some axles, counted from 0."""
        if not axles:
            return self
        left = (math.nan if axle in axles else speed for axle, speed in enumerate(self.speeds_radps))
        return WheelSample(self.t_ns, tuple(left))

    def is_valid(self) -> bool:
        """Whether any is known and none infinite."""
        known = self.known_radps
        return bool(known) and all(map(math.isfinite, known))


class ForceSample(NamedTuple):
    """Measured traction force of all driven axles together, at the rim."""

    t_ns: int
    force_n: float

    def is_valid(self) -> bool:
        """Whether it is finite."""
        return math.isfinite(self.force_n)


class Measurement(NamedTuple):
    """What is known of one time: a position with what the other sensors measured up to it, or that alone.

    Pressures are gauge; None stands for "not measured". Without a position `variance_m2` is infinite, and `position_m`
    says nothing. `pressures`, `speeds`, `wheels`, `imu` and `demands` are all samples since the measurement before, by
    their stamps; each comes once. One that was late may be stamped before that, by `pressure_wait_s` at most.
    """

    t_ns: int
    position_m: float
    variance_m2: float
    brake_pressure_pa: float | None = None
    """The newest one, up to `pressure_age_s` old."""
    speed_mps: float | None = None
    """The newest one since the measurement before, up to `pressure_wait_s` old."""
    demand_pa: float | None = None
    """What the handle or valve demands: the newest one, up to `pressure_age_s` old."""
    pressures: tuple[PressureSample, ...] = ()
    speeds: tuple[SpeedSample, ...] = ()
    wheels: tuple[WheelSample, ...] = ()
    imu: tuple[ImuSample, ...] = ()
    demands: tuple[DemandSample, ...] = ()

    @property
    def has_position(self) -> bool:
        """Whether a position was measured."""
        return self.variance_m2 != math.inf

    @property
    def all_speeds(self) -> tuple[SpeedSample, ...]:
        """Speeds since the measurement before; where only the newest one is told, that."""
        alone = self.speed_mps
        return self.speeds or (() if alone is None else (SpeedSample(self.t_ns, alone),))

    def is_valid(self) -> bool:
        """Whether every number is finite and physically possible; a position need not be there."""
        scalars: tuple[tuple[Callable[[int, float], Sample], float | None], ...] = (
            (PressureSample, self.brake_pressure_pa),
            (SpeedSample, self.speed_mps),
            (DemandSample, self.demand_pa),
        )
        beside = [kind(self.t_ns, value) for kind, value in scalars if value is not None]
        position = [PositionSample(*self[:3])] if self.has_position else []
        every = chain(position, beside, self.pressures, self.speeds, self.wheels, self.imu, self.demands)
        return all(sample.is_valid() for sample in every)


Sample = (
    PositionSample | PressureSample | SpeedSample | ImuSample | DemandSample | WheelSample | ForceSample | Measurement
)
"""Whatever the gate for time takes."""


def _is_variance(variance: float | None) -> bool:
    """Whether a variance is one, or unknown."""
    return variance is None or 0.0 < variance < math.inf
