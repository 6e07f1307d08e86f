# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The step: one wheel under a train against an adaptive integrator; order, lock and standstill."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sim_node.real.plant.creep import Contact, adhesion, contact
from sim_node.real.plant.journey import GRAVITY, Array
from sim_node.real.plant.motion import Motion, step
from sim_node.real.plant.train import Train

MASS, WHEEL, RUNNING = 25e3, 1000.0, 500.0


def a_train() -> Train:
    one = np.ones((1, 1))
    return Train(MASS * one, one, WHEEL * one, *(one for _ in range(len(Train._fields) - 3)))


def rail(mu0: float) -> Contact:
    return contact(np.full((1, 1), mu0))


def stepped(mu0: float, brake_n: float, end_s: float, h: float) -> Motion:
    now = Motion(np.zeros((1, 1)), np.full((1, 1), 30.0), np.full((1, 1), 30.0))
    for _ in range(round(end_s / h)):
        now, _ = step(now, a_train(), rail(mu0), np.full((1, 1), brake_n), np.full((1, 1), RUNNING), h)
    return now


def integrated(mu0: float, brake_n: float, end_s: float) -> Array:
    def slope(t: float, y: Array) -> list[float]:
        force = float(adhesion(np.array(y[1] - y[2]), np.array(y[1]), contact(np.array(mu0)))[0]) * MASS * GRAVITY
        return [y[1], -(force + RUNNING) / MASS, (force - brake_n) / WHEEL]

    solved = solve_ivp(slope, (0.0, end_s), [0.0, 30.0, 30.0], method="LSODA", rtol=1e-10, atol=1e-10)
    return np.asarray(solved.y[:, -1])


@pytest.mark.parametrize(
    ("mu0", "brake_n", "end_s"), [(0.3, 30e3, 10.0), (0.12, 20e3, 8.0), (0.1, 22.5e3, 1.5), (0.04, 12e3, 2.0)]
)
def test_a_wheel_moves_as_an_adaptive_integrator_says(mu0: float, brake_n: float, end_s: float) -> None:
    """Rolling, close to the peak, and beyond it: the error is small and falls with the step."""
    exact = integrated(mu0, brake_n, end_s)
    errors = [
        np.abs(np.array([one.item() for one in stepped(mu0, brake_n, end_s, h)]) - exact) for h in (0.005, 0.0025)
    ]
    assert errors[0][0] < 0.02
    assert errors[0][1] < 2e-3
    assert errors[0][2] < 0.05
    assert errors[1].max() < 0.6 * errors[0].max()


def test_a_wheel_that_is_braked_too_hard_locks_and_the_train_slides_on() -> None:
    end = stepped(0.04, 30e3, 4.0, 0.005)
    sliding = float(adhesion(end.speed_mps, end.speed_mps, rail(0.04))[0].item()) * GRAVITY + RUNNING / MASS
    assert end.rim_mps.item() == 0.0
    assert end.speed_mps.item() > 20.0
    now, force = step(end, a_train(), rail(0.04), np.full((1, 1), 30e3), np.full((1, 1), RUNNING), 0.005)
    assert (end.speed_mps - now.speed_mps).item() / 0.005 == pytest.approx(sliding, rel=1e-3)
    assert force.item() / MASS + RUNNING / MASS == pytest.approx(sliding, rel=1e-3)


def test_a_train_that_stands_stays_also_on_a_falling_grade() -> None:
    """It stops where a constant deceleration puts it: v^2/(2 a), rotating mass included."""
    now = Motion(np.zeros((1, 1)), np.full((1, 1), 10.0), np.full((1, 1), 10.0))
    for _ in range(3000):
        now, _ = step(now, a_train(), rail(0.3), np.full((1, 1), 26e3), np.full((1, 1), -500.0), 0.005)
    assert now.position_m.item() == pytest.approx(100.0 / 2.0 / (25.5e3 / 26e3), rel=1e-3)
    assert now.speed_mps.item() == now.rim_mps.item() == 0.0
