# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Worlds drawn at random: within what is promised, the same for a seed, the same train for all sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from adhesion_node.wire.topics import BRAKE_PRESSURE, IMU, POSITION, SPEED, WHEEL_SPEED
from sim_node.real.drawn import SENSORS, world
from sim_node.real.drive import sense
from sim_node.real.plant.scenarios import SCENARIOS
from sim_node.real.plant.simulate import simulate
from sim_node.real.sensors.sensor import Ride

TOPICS = {
    "receiver": POSITION,
    "odometer": POSITION,
    "wheels": WHEEL_SPEED,
    "speed": SPEED,
    "accelerometer": IMU,
}


@pytest.mark.parametrize("sensors", SENSORS)
def test_sensors_are_those_of_the_name_and_a_gauge_of_the_brake(sensors: str) -> None:
    for seed in range(20):
        topics = [mounted.sensor.topic for mounted in world(sensors, seed).fitted.sensors.values()]
        assert {TOPICS[name] for name in sensors.split("+")} < set(topics)
        assert BRAKE_PRESSURE in topics


def test_a_seed_is_a_world_whatever_measures_it() -> None:
    (journey,) = simulate(world("speed", 3).scenario, [3])
    for sensors in ("speed", "odometer+wheels"):
        again = world(sensors, 3)
        (same,) = simulate(again.scenario, [3])
        assert np.array_equal(same.position_m, journey.position_m)
        told = [sense(Ride(each, again.scenario.nominal), again.fitted) for each in (journey, same)]
        assert told[0] == told[1]
    assert world("speed", 4).scenario.speed_mps != world("speed", 3).scenario.speed_mps


def test_worlds_differ_and_every_train_runs_when_the_full_brake_comes() -> None:
    scenarios = [world("speed", seed).scenario for seed in range(200)]
    lengths = [one.nominal.length_m for one in scenarios]
    assert min(lengths) < 35.0
    assert max(lengths) > 300.0
    brakings = {len(one.demands) for one in scenarios}
    assert {1, 2, 3} <= brakings
    for one in scenarios:
        assert one.demands[-1][1] == 1.0
        times = [at_s for at_s, _ in one.demands]
        assert times == sorted(times)
        lost = sum(
            share * one.nominal.deceleration_mps2 * (until_s - at_s)
            for (at_s, share), until_s in zip(one.demands, times[1:], strict=False)
        )
        assert lost < 0.4 * one.speed_mps


def test_a_gentle_protection_lets_axles_creep_deeper() -> None:
    """In the mean of the braking on leaves above 10 m/s; thresholds below are a speed, not a share."""
    scenario = replace(SCENARIOS["metro_leaves"], speed_mps=30.0)
    creeps = []
    for factor in (0.5, 1.0, 2.0):
        (journey,) = simulate(replace(scenario, nominal=replace(scenario.nominal, protection_creep=factor)), [11])
        fast = (journey.time_s > journey.full_from_s + 5.0) & (journey.speed_mps > 10.0)
        rims = (journey.wheel_radps * journey.radius_m)[fast]
        creeps.append(float(1.0 - (rims / journey.speed_mps[fast, np.newaxis]).mean()))
    assert creeps[0] < creeps[1] < creeps[2]
