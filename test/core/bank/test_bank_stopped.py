# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A train stops in the mouth of a tunnel: what slowed it down does not drive it back."""

from __future__ import annotations

import numpy as np
import pytest
from banks import FULL_PA, S

from adhesion_node import Config, Pipeline
from adhesion_node.core import Measurement, PositionSample, PressureSample, Sample, WheelSample
from adhesion_node.core.bank.following import met
from adhesion_node.core.bank.layout import SPEED
from adhesion_node.core.bank.rims.taken import with_wheels
from adhesion_node.core.physics.train import Array

LOST_S, STANDS_S, AWAY_S = 1.0, 4.0, 18.0
"""Behind the stop: the last position, the departure and the end."""


def stopped(seed: int, *, gauge: bool, wheels: bool) -> Array:
    """What is told once satellites are lost: errors of the speed, m/s, and their standard deviations, shape (2, N).

    From 15 m/s at 0.6 m/s^2; slow errors of the positions are of 1 m. The brake is pressed until the train departs.
    """
    rng, pipeline, rows = np.random.default_rng(seed), Pipeline(Config(method="bank"), seed), list[tuple[float, ...]]()
    place, speed, off, since_s = 0.0, 15.0, float(rng.standard_normal()), 0.0
    for tick in range(1000):
        time = 0.1 * tick
        since_s += 0.1 * (speed == 0.0 or since_s > 0.0)
        if since_s > AWAY_S:
            break
        gained = 0.8 if since_s > STANDS_S else -0.6 * (time > 20.0)
        speed = max(speed + 0.1 * gained, 0.0)
        place, t_ns = place + 0.1 * speed, S + tick * S // 10
        off += 0.06 * float(rng.standard_normal()) - off / 600.0
        samples = list[Sample]()
        if wheels:
            samples.append(WheelSample(t_ns, (speed / 0.46,) * 4))
        if gauge:
            samples.append(PressureSample(t_ns, 0.6 * FULL_PA * (gained < 0.0)))
        if since_s < LOST_S:
            samples.append(PositionSample(t_ns, place + off + 0.1 * float(rng.standard_normal()), 2.25))
        for sample in samples:
            told = (each.estimate for each in pipeline.push(sample))
            rows += [(each.speed_mps - speed, each.speed_std_mps) for each in told if since_s > LOST_S + 0.5]
    return np.array(rows).T


@pytest.mark.parametrize(("gauge", "wheels"), [(True, False), (False, True), (True, True)])
def test_a_train_that_stops_as_satellites_are_lost_does_not_run_back(*, gauge: bool, wheels: bool) -> None:
    """It was told as -11 m/s, to within 5, at 15 m/s, and its wheels were left out as of one that runs back."""
    off = np.concatenate([stopped(seed, gauge=gauge, wheels=wheels) for seed in range(6)], axis=1)
    assert np.max(np.abs(off[0] / off[1])) < 4.0
    if wheels:
        assert np.max(np.abs(off[0])) < 3.0


@pytest.mark.parametrize("rim_mps", [-10.0, 10.0])
def test_wheels_that_turn_are_left_out_where_a_train_runs_back_however_they_count(rim_mps: float) -> None:
    config = Config(method="bank")
    memory = met(config, Measurement(S, 0.0, 1.0))
    memory = memory._replace(bank=memory.bank.with_fresh(SPEED, -10.0, 0.5))
    wheels = (WheelSample(S, (rim_mps / config.train.wheel_radius_m,) * 4),)
    assert with_wheels(config, memory, Measurement(S, 0.0, 1.0, wheels=wheels)) is memory


@pytest.mark.parametrize("wheels", [False, True])
def test_a_train_that_is_seen_to_run_back_under_too_weak_a_brake_does(wheels: bool) -> None:
    """Of this its wheels, which tell no direction, were believed behind the last position: it ran at +2 m/s."""
    rng, pipeline, rows = np.random.default_rng(1), Pipeline(Config(method="bank"), 1), list[tuple[float, float]]()
    place, speed = 0.0, 0.0
    for tick in range(350):
        time, t_ns = 0.1 * tick, S + tick * S // 10
        samples: list[Sample] = [PressureSample(t_ns, 60e3)]
        if wheels:
            samples.append(WheelSample(t_ns, (abs(speed) / 0.46,) * 4))
        if time < 25.0:
            samples.append(PositionSample(t_ns, place + 0.3 * float(rng.standard_normal()), 0.09))
        told = [each.estimate for sample in samples for each in pipeline.push(sample)]
        rows += [(each.speed_mps - speed, each.speed_std_mps) for each in told if time > 15.0]
        place, speed = place + 0.1 * speed, speed - 0.015 * (time > 12.0)
    off, std = np.array(rows).T
    assert np.max(np.abs(off)) < 1.5
    assert np.max(np.abs(off / std)) < 4.0
