# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""In a tunnel wheels carry a train on: while they turn, where it stands, and when it departs again."""

from __future__ import annotations

from operator import attrgetter

import numpy as np
import pytest
from banks import FULL_PA, S

from adhesion_node import Config, Pipeline
from adhesion_node.core import PositionSample, PressureSample, Sample, WheelSample
from adhesion_node.core.physics.train import Array

TUNNEL_S = 30.0
"""From when on there are no positions."""

DEAD_MPS = 0.6
"""No wheel that turns slower is heard."""

ROUND = np.repeat([0.0, -1.0, 0.0, 0.8, 0.0, -1.0, 0.0], [500, 200, 900, 180, 600, 200, 300])
"""Accelerations, m/s^2, of each tenth of a second: the train stops, stands for 90 s, and goes to the next station."""


def told(accelerations: Array, tunnel_s: float = TUNNEL_S, lost_s: float = np.inf) -> Array:
    """What is told in the tunnel of a train of 15 m/s at first: stamps, speeds, their errors and standard deviations.

    The brake is applied where it slows down or stands. Eight wheels are worn by 2 %; from `lost_s` on they tell 0.
    """
    rng, pipeline = np.random.default_rng(5), Pipeline(Config(method="bank"), 0)
    place, speed, rows, true = 0.0, 15.0, [], []
    for index, acceleration in enumerate(accelerations.tolist()):
        t_s, speed = 0.1 * index, max(speed + 0.1 * acceleration, 0.0)
        t_ns, place = S + index * S // 10, place + 0.1 * speed
        true.append(speed)
        turning = speed / (0.46 * 0.98) * (speed > DEAD_MPS and t_s < lost_s)
        samples: list[Sample] = [WheelSample(t_ns, tuple((turning * (1.0 + 0.002 * rng.standard_normal(8))).tolist()))]
        samples.append(PressureSample(t_ns, 0.8 * FULL_PA * (acceleration < 0.0 or speed == 0.0)))
        if t_s < tunnel_s:
            samples.append(PositionSample(t_ns, place + 0.1 * rng.standard_normal(), 1.0))
        for sample in samples:
            rows += [
                (each.t_ns / S - 1.0, each.speed_mps, each.speed_std_mps)
                for each in map(attrgetter("estimate"), pipeline.push(sample))
            ]
    t_s, speed_mps, std_mps = np.array([row for row in rows if row[0] > tunnel_s]).T
    held = np.interp(t_s, 0.1 * np.arange(len(true)), true)
    return np.array((t_s, held, speed_mps - held, std_mps))


@pytest.mark.parametrize("tunnel_s", [TUNNEL_S, 0.0])
def test_a_train_is_followed_through_the_stations_of_a_tunnel_by_its_wheels(tunnel_s: float) -> None:
    """Also where it is switched on in there; radii are known to 3 % then, and so is the speed."""
    t_s, speed, error, std = told(ROUND, tunnel_s)
    assert t_s[0] < tunnel_s + 3.0
    assert np.max(np.diff(t_s)) < 1.0
    assert t_s[-1] > 0.1 * ROUND.size - 1.0
    assert np.mean(np.abs(error) < 3.0 * std) > 0.98
    assert np.max(np.abs(error)) < 3.0
    assert np.all(std[speed == 0.0] < 2.5)
    assert std[-1] < 0.5


@pytest.mark.parametrize("lost_s", [40.0, 52.0])
def test_wheels_whose_sensors_are_dead_stop_no_train(lost_s: float) -> None:
    """They are lost while it runs, or in the first seconds of the brake."""
    t_s, speed, error, std = told(ROUND[:600], lost_s=lost_s)
    late = t_s > lost_s
    assert np.all(np.abs(error[late]) < 3.0 * std[late])
    assert np.min(speed[late]) > 4.0


@pytest.mark.parametrize("back_mps2", [-0.55, -0.75])
def test_wheels_that_all_roll_are_believed_of_a_brake_that_eases_unseen_and_comes_back(back_mps2: float) -> None:
    """The gauge shows the same throughout, as that of the demand does while valves let go of cylinders."""
    course = np.repeat([0.0, -0.55, -0.3, back_mps2], [400, 50, 50, 100])
    t_s, _, error, _ = told(course)
    assert t_s[-1] > 59.0
    assert np.max(np.abs(error[t_s > 42.0])) < 0.3
