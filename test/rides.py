# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A journey of plain numbers: 100 s at 40 m/s, then a braking of 1 m/s^2, under which the first axle slides."""

import numpy as np

from sim_node.real.plant.journey import PERIOD_S, Journey
from sim_node.real.plant.scenarios import SCENARIOS
from sim_node.real.sensors.sensor import Ride

CRUISE_S, SPEED_MPS, BRAKING_MPS2 = 100.0, 40.0, 1.0
RADIUS_M = 0.45
GRADE, PITCH_RAD = 0.01, 0.005
SLID, GROUPS = 0.2, 4
NOMINAL = next(iter(SCENARIOS.values())).nominal


def ride(seed: int = 1, cruise_s: float = CRUISE_S) -> Ride:
    """Return the journey up to the standstill on a rising track, the nose down under the brake."""
    time_s = np.arange(0.0, cruise_s + SPEED_MPS / BRAKING_MPS2, PERIOD_S)
    braked = np.maximum(time_s - cruise_s, 0.0)
    braking = time_s >= cruise_s
    speed = SPEED_MPS - BRAKING_MPS2 * braked
    creep = np.where(braking[:, np.newaxis], [SLID, *[0.0] * (GROUPS - 1)], 0.0)
    pressure = np.where(braking, 300e3, 0.0)
    journey = Journey(
        seed=seed,
        time_s=time_s,
        position_m=SPEED_MPS * time_s - BRAKING_MPS2 * braked**2 / 2,
        speed_mps=speed,
        acceleration_mps2=np.where(braking, -BRAKING_MPS2, 0.0),
        grade=np.full_like(time_s, GRADE),
        used=np.where(braking, 0.08, 0.0),
        available=np.full_like(time_s, 0.09),
        sliding=np.where(braking, 1 / GROUPS, 0.0),
        demanded_pa=pressure,
        cylinder_pa=pressure[:, np.newaxis] * [0.5, 1.0, 1.0, 1.0],
        wheel_radps=speed[:, np.newaxis] * (1.0 - creep) / RADIUS_M,
        pitch_rad=np.where(braking, PITCH_RAD, 0.0),
        full_from_s=cruise_s,
        radius_m=np.full(GROUPS, RADIUS_M),
    )
    return Ride(journey, NOMINAL)
