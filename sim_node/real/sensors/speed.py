# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Speeds along the track: of satellites' Doppler shift, of a radar, and of the tacho of one axle."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from adhesion_node.core.setting import check_settings, setting
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import SPEED

from ..plant.journey import Array
from .sensor import Measured, Ride, one, wander


@dataclass(frozen=True, slots=True)
class Speedometer:
    """A speed with white and correlated noise and an error of scale. Raises ValueError naming what is out of range.

    It declares its whole error, or `declared` times that.
    """

    topic: ClassVar[Topic] = SPEED
    white_std_mps: float = setting(0.05, "White noise", "m/s", 0.0, 10.0)
    correlated_std_mps: float = setting(0.02, "Gauss-Markov part of the noise", "m/s", 0.0, 10.0)
    correlation_s: float = setting(5.0, "Its correlation time", "s", 0.1, 1e4)
    scale_std: float = setting(0.0, "Standard deviation of the scale from one train to the other", "", 0.0, 0.5)
    declared: float = setting(1.0, "Declared over true standard deviation; 0 = declares nothing", "", 0.0, 100.0)

    def __post_init__(self) -> None:
        check_settings(self, "speed ")

    def measure(self, ride: Ride, time_s: Array, rng: np.random.Generator) -> Measured:
        """Measure the speed, m/s; one scale for the whole journey."""
        true = ride.at(time_s, ride.journey.speed_mps)
        scale = 1.0 + self.scale_std * rng.standard_normal()
        noise = wander(time_s, self.correlated_std_mps, self.correlation_s, rng)
        shown = scale * true + noise + self.white_std_mps * rng.standard_normal(time_s.size)
        variance = self.white_std_mps**2 + self.correlated_std_mps**2 + (self.scale_std * true) ** 2
        return one(shown, self.declared**2 * variance)


DOPPLER = Speedometer()
"""0.05 m/s from fix to fix, as a receiver's own speed differs from the steps of its positions."""

SMOOTHED = Speedometer(white_std_mps=0.02, correlated_std_mps=0.1, correlation_s=1.0, declared=0.5)
"""As a receiver's own filter leaves it: its errors last for a second, and it tells half of them."""

RADAR = Speedometer(white_std_mps=0.1, correlated_std_mps=0.0, scale_std=0.01)
"""Its scale hangs on the angle of its beam to the ground."""


@dataclass(frozen=True, slots=True)
class TachoSpeed:
    """The speed of one axle's rim by the nominal radius: it slides with the axle."""

    topic: ClassVar[Topic] = SPEED
    axle: int = 0
    noise: float = setting(0.003, "Noise over the speed", "", 0.0, 0.5)
    declared_std_mps: float = setting(0.1, "Declared standard deviation", "m/s", 0.0, 10.0)

    def __post_init__(self) -> None:
        check_settings(self, "tacho ")

    def measure(self, ride: Ride, time_s: Array, rng: np.random.Generator) -> Measured:
        """Measure the speed, m/s."""
        rim = ride.at(time_s, ride.journey.wheel_radps[:, self.axle]) * ride.nominal.wheel_radius_m
        return one(rim * (1.0 + self.noise * rng.standard_normal(time_s.size)), self.declared_std_mps**2)
