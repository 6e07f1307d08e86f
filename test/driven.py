# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Hand-made drives of the second plant, of which every true figure is known."""

from __future__ import annotations

from typing import Any

import numpy as np

from adhesion_node.core.physics.train import Array
from adhesion_node.wire.line import ATMOSPHERE_PA
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION
from sim_node.real.drive import START_S, Drive
from sim_node.real.plant.journey import PERIOD_S, Journey
from sim_node.train.sensors import SensorMessage

FROM_S, FROM_MPS, SLOWING_MPS2 = 10.0, 30.0, 0.5
"""The brake comes on at once; the train stands after 60 s and 900 m."""

GROUPS = 4


def journey(used: float | Array = 0.05, available: float | Array = 0.06, **columns: Any) -> Journey:
    """A journey of 80 s; numbers stand for columns."""
    time_s: Array = np.linspace(0.0, 80.0, round(80.0 / PERIOD_S) + 1)
    braked_s = np.clip(time_s - FROM_S, 0.0, FROM_MPS / SLOWING_MPS2)
    speed = FROM_MPS - SLOWING_MPS2 * braked_s
    position = FROM_MPS * (np.minimum(time_s, FROM_S) + braked_s) - SLOWING_MPS2 * braked_s**2 / 2
    full = np.ones_like(time_s)
    made = Journey(
        seed=1,
        time_s=time_s,
        position_m=position,
        speed_mps=speed,
        acceleration_mps2=np.gradient(speed, PERIOD_S),
        grade=0.0 * full,
        used=used * full,
        available=available * full,
        sliding=0.0 * full,
        demanded_pa=np.where(time_s < FROM_S, 0.0, 400e3),
        cylinder_pa=np.where(time_s < FROM_S, 0.0, 400e3)[:, np.newaxis] * np.ones(GROUPS),
        wheel_radps=speed[:, np.newaxis] / 0.5 * np.ones(GROUPS),
        pitch_rad=0.0 * full,
        full_from_s=FROM_S,
        radius_m=np.full(GROUPS, 0.5),
    )
    return made._replace(**columns)


def drive(made: Journey) -> Drive:
    """A journey with exact positions and pressures at 10 Hz that arrive 0.1 s late."""
    return Drive(
        made,
        tuple(
            (START_S + made.time_s[i] + 0.1, SensorMessage(topic, t_ns, (float(value),), variance))
            for i in range(0, made.time_s.size, 5)
            for t_ns in (round((START_S + made.time_s[i]) * 1e9),)
            for topic, value, variance in (
                (BRAKE_PRESSURE, made.demanded_pa[i] + ATMOSPHERE_PA, 1e6),
                (POSITION, made.position_m[i], 0.01),
            )
        ),
    )
