# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What goes into the estimators: one sample per message of a sensor, and what they make together."""

import math
from typing import NamedTuple

MAX_POSITION_M = 1e7
MAX_SPEED_MPS = 200.0
MAX_PRESSURE_PA = 1e7
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

    def is_valid(self) -> bool:
        """Whether it is finite and physically possible."""
        return abs(self.speed_mps) <= MAX_SPEED_MPS


class WheelSample(NamedTuple):
    """Measured angular speeds of the axles."""

    t_ns: int
    speeds_radps: tuple[float, ...]

    def is_valid(self) -> bool:
        """Whether there are any and all are finite."""
        return bool(self.speeds_radps) and all(map(math.isfinite, self.speeds_radps))


class ForceSample(NamedTuple):
    """Measured traction force of all driven axles together, at the rim."""

    t_ns: int
    force_n: float

    def is_valid(self) -> bool:
        """Whether it is finite."""
        return math.isfinite(self.force_n)


class Measurement(NamedTuple):
    """One position fix with what the other sensors knew at its time.

    `brake_pressure_pa` is gauge; None stands for "not measured".
    """

    t_ns: int
    position_m: float
    variance_m2: float
    brake_pressure_pa: float | None = None
    speed_mps: float | None = None
    wheel_radps: float | None = None
    """Angular speed of the median axle."""

    def is_valid(self) -> bool:
        """Whether every number is finite and physically possible."""
        pressure, speed, wheel = self.brake_pressure_pa, self.speed_mps, self.wheel_radps
        return (
            PositionSample(*self[:3]).is_valid()
            and (pressure is None or PressureSample(self.t_ns, pressure).is_valid())
            and (speed is None or SpeedSample(self.t_ns, speed).is_valid())
            and (wheel is None or math.isfinite(wheel))
        )


Sample = PositionSample | PressureSample | SpeedSample | WheelSample | ForceSample | Measurement
"""Whatever the gate for time takes."""
