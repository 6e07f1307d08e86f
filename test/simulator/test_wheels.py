# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The wheel-speed sensors of the braking train: rolling axles, sliding axles, and what they leave alone."""

from __future__ import annotations

import numpy as np
import pytest

from adhesion_node.core.physics.train import CRH3, Array
from sim_node.train.run import run
from sim_node.train.scenario import find
from sim_node.train.sensors import GROUPS, SensorSettings

WHEELS = SensorSettings(wheel_speed_std_radps=1e-6)


def _creeps(scenario: str, regime: str) -> Array:
    """Creep of every axle group, shape (samples, groups), negative under the brake."""
    samples = [(t, r.wheel_radps) for t, r in run(find(scenario), 0.1, 1, WHEELS) if t.regime == regime]
    speeds = np.array([truth.speed_mps for truth, _ in samples])
    wheels = np.array([radps for _, radps in samples], dtype=np.float64)
    return np.asarray(CRH3.wheel_radius_m * wheels / speeds[:, None] - 1.0)


def test_without_a_brake_the_wheels_roll() -> None:
    assert np.abs(_creeps("cruise", "COASTING")).max() < 1e-6


def test_rolling_axles_creep_by_tenths_of_a_percent() -> None:
    creeps = _creeps("weak_brake", "BRAKE_LIMITED")
    assert creeps == pytest.approx(np.full(creeps.shape, -0.6 * 0.0952 / 30.0), abs=1e-5)


def test_sliding_axles_are_held_between_5_and_20_percent_each_in_its_turn() -> None:
    creeps = _creeps("tunnel_entry", "ADHESION_LIMITED")
    assert -0.2 - 1e-6 <= creeps.min() < -0.19
    assert -0.06 < creeps.max() <= -0.05 + 1e-6
    assert creeps.mean() == pytest.approx(-0.125, abs=0.01)
    assert np.corrcoef(creeps[:, 0], creeps[:, GROUPS // 2]).min() < -0.5  # half a cycle apart


def test_noise_of_the_sensor_has_its_std() -> None:
    noisy = SensorSettings(wheel_speed_std_radps=0.05)
    errors = [
        wheel - truth.speed_mps / CRH3.wheel_radius_m
        for truth, reading in run(find("cruise"), 0.1, 1, noisy)
        for wheel in reading.wheel_radps or ()
    ]
    assert len(errors) == 601 * GROUPS
    assert np.std(errors) == pytest.approx(0.05, rel=0.06)


def test_wheels_come_on_top_of_the_same_run() -> None:
    plain = list(run(find("tunnel_exit"), 0.5, 3, SensorSettings(student_dof=3.0)))
    wheeled = list(run(find("tunnel_exit"), 0.5, 3, SensorSettings(student_dof=3.0, wheel_speed_std_radps=0.1)))
    assert all(reading.wheel_radps is None for _, reading in plain)
    assert [(truth, reading._replace(wheel_radps=None)) for truth, reading in wheeled] == plain
