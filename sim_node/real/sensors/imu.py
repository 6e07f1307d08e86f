# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The accelerometer of an inertial unit: the specific force along the body, which is not dv/dt.

It feels the acceleration less gravity. On a grade of angle a the body lies by the pitch p (nose down) off the track:

    f = (dv/dt + g sin a) cos p - g cos a sin p

So it feels brake and resistance but not the grade, and a nose that dips under the brake looks like more of it.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from adhesion_node.core.setting import check_settings, setting
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import IMU

from ..plant.journey import GRAVITY, Array
from .sensor import Measured, Ride, one


@dataclass(frozen=True, slots=True)
class Imu:
    """An accelerometer along the body. Raises ValueError naming what is out of range."""

    topic: ClassVar[Topic] = IMU
    bias_std_mps2: float = setting(0.03, "Bias at the start", "m/s^2", 0.0, 10.0)
    bias_walk: float = setting(0.0005, "Its random walk over 1 s", "m/s^2", 0.0, 1.0)
    white_std_mps2: float = setting(0.05, "White noise of a sample", "m/s^2", 0.0, 10.0)
    mounting_std_rad: float = setting(0.003, "Nose-down error of its mounting", "rad", 0.0, 0.5)

    def __post_init__(self) -> None:
        check_settings(self, "imu ")

    def measure(self, ride: Ride, time_s: Array, rng: np.random.Generator) -> Measured:
        """Measure the specific force, m/s^2, positive forwards; it declares its white noise alone."""
        bias, mounting = rng.standard_normal(2) * (self.bias_std_mps2, self.mounting_std_rad)
        journey, steps = ride.journey, np.diff(time_s, prepend=time_s[:1])
        walk = self.bias_walk * np.cumsum(np.sqrt(steps) * rng.standard_normal(time_s.size))
        felt = specific_force(journey.acceleration_mps2, journey.grade, journey.pitch_rad + mounting)
        noise = self.white_std_mps2 * rng.standard_normal(time_s.size)
        return one(ride.at(time_s, felt) + bias + walk + noise, self.white_std_mps2**2)


def specific_force(acceleration_mps2: Array, grade: Array, pitch_rad: Array) -> Array:
    """Return the specific force, m/s^2, along a body of this pitch, nose down, on grades of rise over run.

    >>> at_rest_uphill, dipping = specific_force(np.zeros(2), np.array([0.01, 0.0]), np.array([0.0, 0.01]))
    >>> round(float(at_rest_uphill), 4), round(float(dipping), 4)
    (0.0981, -0.0981)
    """
    slope = np.arctan(grade)
    along = acceleration_mps2 + GRAVITY * np.sin(slope)
    return along * np.cos(pitch_rad) - GRAVITY * np.cos(slope) * np.sin(pitch_rad)
