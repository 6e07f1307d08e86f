# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The state-space model, (2)(3)(5): steps by hand and finite differences; the window's data."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from adhesion_node.core.belief.window import WindowSample, window_of
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import LEVEL, Grade, Track, Tunnel
from adhesion_node.core.physics.train import CRH3

Q_S, Q_V = 0.02**2 / 0.1, (0.02 / 3.6) ** 2 / 0.1
MOTION = Motion(CRH3, LEVEL, Q_S, Q_V)
V300 = np.array(300 / 3.6)


def test_step_2_3_while_adhesion_limits() -> None:
    # 300 km/h, mu 0.0726: a = 9.8 (0.0726 + 0.01306) = 0.839468; v' = 83.333333 - 0.0839468 = 83.2493865;
    # s' = 10 + 0.1 (83.3333333 + 83.2493865)/2 = 18.3291360
    s, v = MOTION.advance(np.array(10.0), V300, 0.1, 0.0952, 0.0726)
    assert float(v) == pytest.approx(83.24938653, abs=1e-7)
    assert float(s) == pytest.approx(18.32913599, abs=1e-7)


def test_step_2_3_while_the_brake_limits() -> None:
    # a = 9.8 (0.0952 + 0.01306) = 1.060948 whatever the rail would give; s' = 0.5 (83.3333333 + 82.8028593)/2 = 41.534
    for mu in (0.0952, 0.15, math.inf):
        s, v = MOTION.advance(np.array(0.0), V300, 0.5, 0.0952, mu)
        assert float(v) == pytest.approx(82.80285933, abs=1e-7)
        assert float(s) == pytest.approx(41.53404817, abs=1e-7)


def test_equation_5_adds_the_track_to_the_train() -> None:
    motion = Motion(CRH3, Track((Grade(0.0, 1000.0, 5.0), Tunnel(500.0, 1000.0))), Q_S, Q_V)
    # 0.01306 alone; + 0.005; + 0.005 + 0.00013e-3 x 500
    assert motion.resistance(np.array([-1.0, 201.0, 600.0]), V300) == pytest.approx([0.01306, 0.01806, 0.018125])
    _, v = motion.advance(np.array(600.0), V300, 0.1, 0.0952, 0.0726)
    assert float(v) == pytest.approx(83.3333333333 - 0.98 * (0.0726 + 0.018125), abs=1e-9)


def test_arrays_of_any_shape_and_a_step_length_each() -> None:
    rng = np.random.default_rng(0)
    s, v = rng.uniform(0, 100, (4, 7)), rng.uniform(20, 80, (4, 7))
    dt, brake = rng.uniform(0.05, 0.2, (4, 1)), rng.uniform(0.03, 0.1, (4, 1))
    moved, slower = MOTION.advance(s, v, dt, brake, 0.06)
    for i in range(4):
        for j in range(7):
            one = MOTION.advance(np.array(s[i, j]), np.array(v[i, j]), float(dt[i, 0]), float(brake[i, 0]), 0.06)
            assert (moved[i, j], slower[i, j]) == pytest.approx((float(one[0]), float(one[1])), rel=1e-14)


def test_brake_limit_is_what_the_motion_can_tell() -> None:
    assert float(MOTION.brake_limit(0.0, 80.0, 0.0952)) == 0.0952
    heavy = Motion(replace(CRH3, rotating_mass_fraction=0.1), LEVEL, Q_S, Q_V)
    # (0.0952 - 0.1 x 0.01306)/1.1
    assert float(heavy.brake_limit(0.0, V300, 0.0952)) == pytest.approx(0.085358182, abs=1e-9)


@pytest.mark.parametrize("mu", [0.05, 0.2])
@pytest.mark.parametrize("rho", [0.0, 0.1])
@pytest.mark.parametrize("speed", [10.0, 50.0, 85.0])
def test_jacobian_by_finite_differences(speed: float, rho: float, mu: float) -> None:
    motion = Motion(replace(CRH3, rotating_mass_fraction=rho), LEVEL, Q_S, Q_V)
    dt, h = 0.3, 1e-3
    columns = []
    for ds, dv in ((h, 0.0), (0.0, h)):
        up = motion.advance(np.array(ds), np.array(speed + dv), dt, 0.09, mu)
        down = motion.advance(np.array(-ds), np.array(speed - dv), dt, 0.09, mu)
        columns.append((np.array(up) - np.array(down)) / (2 * h))
    brake_limits = mu > float(motion.brake_limit(0.0, speed, 0.09))
    assert brake_limits == (mu == 0.2)
    assert motion.jacobian(speed, dt, brake_limits) == pytest.approx(np.array(columns).T, abs=1e-9)


def test_jacobians_of_many_states_are_those_of_each() -> None:
    motion = Motion(replace(CRH3, rotating_mass_fraction=0.1), LEVEL, Q_S, Q_V)
    speed, dt, limits = np.array([10.0, 50.0, 85.0]), np.array([0.1, 0.2, 0.3]), np.array([True, False, True])
    each = [motion.jacobian(float(v), float(t), bool(b)) for v, t, b in zip(speed, dt, limits, strict=True)]
    assert np.array_equal(motion.jacobian(speed, dt, limits), np.array(each))


def test_noise_grows_with_the_step() -> None:
    assert MOTION.noise(0.1) == pytest.approx((4e-4, (0.02 / 3.6) ** 2))
    assert MOTION.noise(0.4) == pytest.approx((1.6e-3, 4 * (0.02 / 3.6) ** 2))


def test_a_window_keeps_times_brakes_and_measurements_together() -> None:
    samples = [
        WindowSample(1_000_000_000, 0.01, 0.0, 0.25, 0.0, math.inf),
        WindowSample(1_100_000_000, 0.02, 8.0, 0.36, 80.0, 0.09),
        WindowSample(1_350_000_000, 0.03, 28.0, 0.49, 0.0, math.inf),
    ]
    window = window_of(samples)
    assert window.steps == 2
    assert window.dt_s == pytest.approx([0.1, 0.25])
    assert window.brake.tolist() == [0.01, 0.02]  # of the step's start
    assert window.measured.tolist() == [[8.0, 80.0], [28.0, 0.0]]
    assert window.information.tolist() == [[1 / 0.36, 1 / 0.09], [1 / 0.49, 0.0]]


def test_a_window_keeps_nanoseconds_of_an_epoch() -> None:
    start = 1_700_000_000_000_000_001
    window = window_of([WindowSample(start + k * 100_000_001, 0.1, 0.0, 1.0, 0.0, math.inf) for k in range(3)])
    assert window.dt_s == pytest.approx([0.100000001, 0.100000001], abs=1e-15)
