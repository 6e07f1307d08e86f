# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What Xie et al. 2019 print: Tables 2 and 3, braking distances and times, and what they save."""

from collections.abc import Mapping
from typing import NamedTuple

from ...core.physics.adhesion import WET, AdhesionLaw


class Printed(NamedTuple):
    """Mean errors of one line, of the paper's method and of its EKF."""

    abs_error: float
    relative_error_percent: float
    ekf_abs_error: float
    ekf_relative_error_percent: float

    def of(self, method: str) -> tuple[float, float]:
        """Absolute and relative error to hold a method of ours against."""
        return self[2:] if method.startswith("ekf") else self[:2]


START_OF_MEAN = "mean"
"""Stands for a table's last line, the mean over the starts."""

TABLES: Mapping[str, Mapping[float | str, Printed]] = {
    "tunnel_entry": {  # Table 2
        0.0: Printed(0.0017, 2.0907, 0.0129, 13.7828),
        0.03: Printed(0.0011, 1.3984, 0.0078, 9.9778),
        0.05: Printed(0.0009, 1.2802, 0.0081, 10.7114),
        0.09: Printed(0.0016, 2.1527, 0.0079, 10.1600),
        0.12: Printed(0.0023, 2.4306, 0.0137, 15.5428),
        START_OF_MEAN: Printed(0.0015, 1.8705, 0.0101, 12.0350),
    },
    "tunnel_exit": {  # Table 3
        0.0: Printed(0.0011, 1.2338, 0.0117, 13.8956),
        0.03: Printed(0.0012, 1.4101, 0.0120, 14.4391),
        0.05: Printed(0.0017, 2.0780, 0.0095, 11.4757),
        0.09: Printed(0.0021, 2.5633, 0.0096, 11.4356),
        0.12: Printed(0.0015, 1.7995, 0.0121, 14.3814),
        START_OF_MEAN: Printed(0.0015, 1.8169, 0.0110, 13.1255),
    },
}
"""By scenario and start."""


class Braking(NamedTuple):
    """A braking of the paper: speeds in km/h, distance in m and time in s as printed with Figs. 10, 11, 20, 21."""

    from_kmh: float
    to_kmh: float
    case: str
    mu: float | AdhesionLaw
    distance_m: float
    time_s: float


BEST, WORST = 0.1542, 0.0726
"""Adhesion of a wet rail at 0 and at 300 km/h: the constants between which the paper compares."""

BRAKING_CASES = (
    Braking(300, 100, "0.1542", BEST, 3060.7, 56.1),
    Braking(300, 100, "0.0726", WORST, 3946.7, 71.7),
    Braking(300, 100, "wet law", WET, 3481.1, 62.8),
    Braking(250, 50, "0.1542", BEST, 2404.3, 59.3),
    Braking(250, 50, "0.0726", WORST, 2958.9, 72.7),
    Braking(250, 50, "wet law", WET, 2614.4, 62.7),
)


class Saving(NamedTuple):
    """A headline of the paper: how much shorter the wet law's braking is than that by the fixed worst case, in %."""

    from_kmh: float
    to_kmh: float
    distance_percent: float
    time_percent: float


SAVINGS = (Saving(300, 100, 11.80, 12.41), Saving(250, 50, 11.64, 13.76))
