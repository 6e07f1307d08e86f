# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Brake pressures, absolute: what the driver or the valve demands, one cylinder's, or the mean of all.

Where a train brakes electrically, too, its force is the same: the cylinders are pressed with what is lacking.
"""

from dataclasses import dataclass

import numpy as np

from adhesion_node.core.setting import check_settings, setting
from adhesion_node.wire.line import ATMOSPHERE_PA
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKE_PRESSURE

from ..plant.journey import Array
from .sensor import Measured, Ride, one

DEMANDED, CYLINDER, MEAN = "demanded", "cylinder", "mean"

FADES_MPS = 2.0, 6.0
"""An electric brake gives nothing below the first speed, all it can above the second."""


@dataclass(frozen=True, slots=True)
class Pressure:
    """A gauge of the brake. Raises ValueError naming what is out of range."""

    of: str = setting(DEMANDED, "What it is the pressure of", choices=(DEMANDED, CYLINDER, MEAN))
    axle: int = 0
    electric: float = setting(
        0.0, "Part of the full brake that an electric brake gives, and cylinders lack", "", 0.0, 1.0
    )
    std_pa: float = setting(2e3, "Noise", "Pa", 0.0, 1e5)
    topic: Topic = BRAKE_PRESSURE

    def __post_init__(self) -> None:
        check_settings(self, "pressure ")

    def measure(self, ride: Ride, time_s: Array, rng: np.random.Generator) -> Measured:
        """Measure the pressure, Pa absolute; the journey's is that of a train without an electric brake."""
        fading = np.interp(ride.journey.speed_mps, FADES_MPS, (0.0, 1.0))
        lacks_pa = self.electric * ride.nominal.full_pa * fading[:, np.newaxis]
        cylinders = np.maximum(ride.journey.cylinder_pa - lacks_pa, 0.0)
        gauge = {DEMANDED: ride.journey.demanded_pa, CYLINDER: cylinders[:, self.axle], MEAN: cylinders.mean(axis=1)}
        noise = self.std_pa * rng.standard_normal(time_s.size)
        return one(ride.at(time_s, gauge[self.of]) + ATMOSPHERE_PA + noise, self.std_pa**2)
