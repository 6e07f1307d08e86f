# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The traction unit: how what its sensors measure becomes creep and adhesion, He et al. 2017, (1)-(3)."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from ..intake.outcome import Event, Outcome
from ..setting import check_settings, setting
from .curve import creep, used_adhesion

UNEQUAL_SHARE, UNEQUAL_CREEP = 0.5, 0.005
"""The axles' creeps may differ by this share of their mean and this much."""


class CreepSample(NamedTuple):
    """Creep and adhesion in use at a time."""

    t_ns: int
    creep: float
    adhesion: float
    creep_var: float = 0.0
    adhesion_var: float = 0.0
    """Variances of their noise, the bias of which is taken off; 0 is the paper's plain least squares."""


@dataclass(frozen=True, slots=True)
class Vehicle:
    """The traction unit, and how its sensors are paired. Raises ValueError naming the constant and its range."""

    axles: int = setting(6, "Driven axles", "", 1, 100)
    axle_load_kg: float = setting(25e3, "Mass on one driven axle, M", "kg", 1e3, 1e5)
    wheel_radius_m: float = setting(0.625, "Radius of a driven wheel, r", "m", 0.1, 5.0)
    min_speed_mps: float = setting(1.0, "Speed below which the creep is not formed", "m/s", 0.01, 100.0)
    wheel_std_radps: float = setting(0.003, "Noise of a wheel speed, standard deviation", "rad/s", 0.0, 10.0)
    speed_std_mps: float = setting(0.003, "Noise of the train's speed, standard deviation", "m/s", 0.0, 10.0)
    force_std_n: float = setting(2000.0, "Noise of the traction force, standard deviation", "N", 0.0, 1e6)
    pairing_wait_s: float = setting(
        0.2, "How long, by the stamps, a wheel speed waits for the speed and the force of its time", "s", 0.0, 60.0
    )
    pairing_age_s: float = setting(0.1, "Age from which a measured speed or force counts as none", "s", 1e-3, 60.0)

    def __post_init__(self) -> None:
        check_settings(self, "vehicle.")

    def creep_variance(self, mean_creep: float, speed_mps: float, axles: int) -> float:
        """Variance of the mean creep of axles by the noise of speed and wheel speeds, from the derivatives of (2)."""
        wheels = (self.wheel_radius_m * self.wheel_std_radps) ** 2 / axles
        return (((1.0 + mean_creep) * self.speed_std_mps) ** 2 + wheels) / speed_mps**2

    def sample(
        self, t_ns: int, wheels_radps: tuple[float, ...], speed_mps: float, force_n: float
    ) -> CreepSample | Event:
        """Form creep (2), the mean over the axles known (NaN: is not), and adhesion (3), or say why that cannot be."""
        if len(wheels_radps) != self.axles:
            return Event(Outcome.AXLES, f"axles = {len(wheels_radps)}")
        if speed_mps < self.min_speed_mps:
            return Event(Outcome.SLOW, f"speed x = {speed_mps:g}")
        creeps = [creep(wheel, speed_mps, self.wheel_radius_m) for wheel in wheels_radps if not math.isnan(wheel)]
        mean = sum(creeps) / len(creeps)
        if max(creeps) - min(creeps) > UNEQUAL_SHARE * abs(mean) + UNEQUAL_CREEP:
            return Event(Outcome.UNEQUAL, f"creeps = {min(creeps):.3g} to {max(creeps):.3g}")
        load_kg = self.axles * self.axle_load_kg
        return CreepSample(
            t_ns,
            mean,
            used_adhesion(force_n, load_kg),
            self.creep_variance(mean, speed_mps, len(creeps)),
            used_adhesion(self.force_std_n, load_kg) ** 2,
        )


LOCOMOTIVE = Vehicle()
"""Six driven axles of 25 t."""
