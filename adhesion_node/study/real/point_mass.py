# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The point mass of the paper's simulator as a drive: what the estimator believes of train and sensors holds here."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from sim_node.real.drive import START_S, Drive
from sim_node.real.plant.journey import PERIOD_S, Journey
from sim_node.train.plant import ADHESION_LIMITED
from sim_node.train.run import run
from sim_node.train.scenario import find
from sim_node.train.sensors import SensorSettings, messages_of

from ...wire.messages.parts import NS

SCENARIO = replace(find("constant_adhesion"), end_speed_mps=0.0, end_s=400.0)
"""Adhesion of 0.07 from 300 km/h to the standstill."""

NAME = "point_mass"

EVERY = 5
"""The sensors measure at 10 Hz."""

SLIDING_CREEP = 0.1


def drives(seeds: Iterable[int]) -> tuple[Drive, ...]:
    """Drive every seed with the nominal sensors."""
    return tuple(map(_drive, seeds))


def _drive(seed: int) -> Drive:
    settings = SensorSettings()
    ticks = list(run(SCENARIO, PERIOD_S, seed, settings))
    truths = [truth for truth, _ in ticks]
    columns = ([truth.t_ns / NS, *truth[1:6], truth.regime == ADHESION_LIMITED] for truth in truths)
    time_s, position, speed, available, used, pressure, slides = np.array(list(columns), dtype=np.float64).T
    nothing, radius_m = np.zeros_like(time_s), SCENARIO.train.wheel_radius_m
    journey = Journey(
        seed=seed,
        time_s=time_s,
        position_m=position,
        speed_mps=speed,
        acceleration_mps2=np.gradient(speed, PERIOD_S),
        grade=nothing,
        used=used,
        available=available,
        sliding=slides,
        demanded_pa=pressure,
        cylinder_pa=pressure[:, np.newaxis],
        wheel_radps=(speed * (1.0 - SLIDING_CREEP * slides) / radius_m)[:, np.newaxis],
        pitch_rad=nothing,
        full_from_s=SCENARIO.brake.start_s,
        radius_m=np.array([radius_m]),
    )
    shift_ns = round(START_S * NS)
    messages = (
        (START_S + reading.t_ns / NS, message._replace(t_ns=message.t_ns + shift_ns))
        for _, reading in ticks[::EVERY]
        for message in messages_of(reading, settings)
    )
    return Drive(journey, tuple(messages))
