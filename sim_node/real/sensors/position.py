# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Positions along the track: of a satellite receiver, and of a tacho that counts the turns of one axle.

The receiver's errors are those of two receivers beside each other on one train: 0.1 m from fix to fix, 1 m over a
minute, 2 m of declared accuracy (u-blox M8N and MTK, intercity line). A receiver filters, so that its error is a
Gauss-Markov process far more than white noise.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from adhesion_node.core.setting import check_settings, setting
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import FIX, POSITION

from ..plant.journey import Array
from .centre_line import places
from .sensor import Measured, Ride, one, wander


@dataclass(frozen=True, slots=True)
class Gnss:
    """A satellite receiver's position along the track. Raises ValueError naming what is out of range."""

    topic: ClassVar[Topic] = POSITION
    correlated_std_m: float = setting(2.0, "Gauss-Markov part of the error", "m", 0.0, 100.0)
    correlation_s: float = setting(30.0, "Its correlation time", "s", 0.1, 1e4)
    white_std_m: float = setting(0.1, "White part of the error", "m", 0.0, 100.0)
    declared: float = setting(1.0, "Declared over true standard deviation; 0 = declares nothing", "", 0.0, 100.0)

    def __post_init__(self) -> None:
        check_settings(self, "gnss ")

    @property
    def std_m(self) -> float:
        """Of the whole error."""
        return math.hypot(self.correlated_std_m, self.white_std_m)

    def measure(self, ride: Ride, time_s: Array, rng: np.random.Generator) -> Measured:
        """Measure the position, m."""
        true = ride.at(time_s, ride.journey.position_m)
        return one(true + self.errors(time_s, rng), (self.declared * self.std_m) ** 2)

    def errors(self, time_s: Array, rng: np.random.Generator) -> Array:
        """Draw the errors in one direction, m."""
        slow = wander(time_s, self.correlated_std_m, self.correlation_s, rng)
        return slow + self.white_std_m * rng.standard_normal(time_s.size)


@dataclass(frozen=True, slots=True)
class GnssFix:
    """The same receiver's latitude and longitude on the made-up track; it errs along it and beside it alike."""

    topic: ClassVar[Topic] = FIX
    gnss: Gnss

    def measure(self, ride: Ride, time_s: Array, rng: np.random.Generator) -> Measured:
        """Measure latitude and longitude, degrees, and no height."""
        along = self.gnss.measure(ride, time_s, rng)
        beside = self.gnss.errors(time_s, rng)
        latitude, longitude = places(along.values[:, 0], beside)
        return Measured(np.column_stack([latitude, longitude, np.full_like(beside, np.nan)]), along.variance)


@dataclass(frozen=True, slots=True)
class TachoPosition:
    """The way that one axle has rolled from the start, by the nominal radius: slid metres are missing.

    No balise corrects it.
    """

    topic: ClassVar[Topic] = POSITION
    axle: int = 0
    resolution_m: float = setting(0.02, "Way of one pulse", "m", 1e-4, 10.0)
    declared_std_m: float = setting(0.5, "Declared standard deviation", "m", 0.0, 100.0)

    def __post_init__(self) -> None:
        check_settings(self, "tacho ")

    def measure(self, ride: Ride, time_s: Array, rng: np.random.Generator) -> Measured:
        """Measure the position, m; the pulses begin at a random part of one."""
        from scipy.integrate import cumulative_trapezoid  # loads slowly, as `plant.way` says

        journey = ride.journey
        turned = cumulative_trapezoid(journey.wheel_radps[:, self.axle], journey.time_s, initial=0.0)
        way = ride.at(time_s, turned) * ride.nominal.wheel_radius_m
        pulses = np.floor(way / self.resolution_m + rng.random())
        return one(journey.position_m[0] + pulses * self.resolution_m, self.declared_std_m**2)
