# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""What goes into the estimator."""

from __future__ import annotations

import math
from typing import NamedTuple

MAX_POSITION_M = 1e7
MAX_SPEED_MPS = 200.0
MAX_PRESSURE_PA = 1e7
MIN_VARIANCE_M2, MAX_VARIANCE_M2 = 1e-12, 1e8
"""From (1 um)^2 to (10 km)^2: beyond them arithmetic suffers and no sensor exists."""


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
            math.isfinite(self.position_m)
            and abs(self.position_m) <= MAX_POSITION_M
            and MIN_VARIANCE_M2 <= self.variance_m2 <= MAX_VARIANCE_M2
            and (pressure is None or abs(pressure) <= MAX_PRESSURE_PA)
            and (speed is None or abs(speed) <= MAX_SPEED_MPS)
            and (wheel is None or math.isfinite(wheel))
        )
