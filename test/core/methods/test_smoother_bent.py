# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The smoother of a window where it is not linear: the brake's limit, the wet law, heavy tails; against scipy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from loud_rail import RAIL, SEARCH, SEEN, STATE
from oracles import Array, rts, specific_resistance
from oracles_kappa import Conditioned, draw
from scipy import stats
from scipy.optimize import least_squares, minimize_scalar

from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.rail_condition.problem import Belief, Model, Problem
from adhesion_node.core.methods.rail_condition.smoother import posterior, smooth
from adhesion_node.core.physics.adhesion import WET
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import Grade, Track
from adhesion_node.core.physics.train import Train

G = 9.8

# --- the kink: the brake's limit


def _profile(prior: Belief, window: Window) -> tuple[float, list[float]]:
    """The most probable kappa and all local ones of a grid, by Kalman filters at fixed kappa."""
    law = Gaussian(prior.mean[:2], prior.covariance[:2, :2])

    def cost(kappa: float) -> float:
        far = (kappa - prior.mean[2]) ** 2 / prior.covariance[2, 2]
        return 0.5 * float(far) - rts(SEEN, law, window, kappa * RAIL.floor).log_likelihood

    grid = np.linspace(0.0, 3.0, 61)
    values = np.array([cost(kappa) for kappa in grid])
    dips = [float(grid[i]) for i in range(1, 60) if values[i] <= values[i - 1] and values[i] < values[i + 1]]
    best = float(grid[np.argmin(values)])
    found = minimize_scalar(cost, bounds=(best - 0.05, best + 0.05), method="bounded", options={"xatol": 1e-5})
    return float(found.x), dips


@pytest.mark.parametrize(("mean", "std"), [(1.0, 0.8), (1.5, 0.3), (2.5, 0.2)])
@pytest.mark.parametrize(
    ("brake", "kappa"),
    [
        (np.linspace(0.02, 0.0952, 30), 1.5),
        (np.linspace(0.0, 0.3, 30), 1.5),
        (np.where(np.arange(30) < 15, 0.05, 0.09), 1.4),
        (np.where(np.arange(30) < 15, 0.05, 0.09), 2.4),
        (np.full(30, 0.0952), 2.4),
    ],
    ids=["building up", "far beyond", "two levels", "two levels, limited", "limited"],
)
def test_most_probable_kappa_around_the_brakes_limit(brake: Array, kappa: float, mean: float, std: float) -> None:
    covariance = np.zeros((3, 3))
    covariance[:2, :2], covariance[2, 2] = STATE, std**2
    prior = Belief(np.array([100.0, 80.0, mean]), covariance)
    window = draw(Conditioned(SEEN, 1.0), np.minimum(kappa * 0.05, brake), np.random.default_rng(1), brake=brake)
    best, dips = _profile(prior, window)
    assert len(dips) == 1  # else a prior beyond the limit may have a maximum of its own, which need not be found
    for start in (0.0, mean, 3.0):
        found = smooth(RAIL.problem(window, prior), SEARCH._replace(start=start, tolerance=1e-6))
        assert found.converged
        assert found.kappa == pytest.approx(best, rel=2e-3)


# --- nonlinear: the wet law, grade, rotating masses


class Wet:
    """The CRH3 on a wet rail, written out, and -2 ln p of a trajectory and kappa as a sum of squares."""

    q_s, q_v = 0.02**2 / 0.1, (0.02 / 3.6) ** 2 / 0.1

    def __init__(self, rho: float, grade: float, dof: float) -> None:
        self.rho, self.grade, self.dof = rho, grade, dof

    def problem(self, window: Window, prior: Belief) -> Problem:
        track = Track((Grade(-1e5, 1e5, 2e5 * self.grade),))
        motion = Motion(Train(rotating_mass_fraction=self.rho), track, self.q_s, self.q_v)
        return Problem(Model(motion, WET, self.dof), window, prior)

    def step(self, s: Array, v: Array, kappa: float | Array, dt: Array, brake: Array) -> tuple[Array, Array]:
        resistance = specific_resistance(v) + self.grade
        at_rail = kappa * (0.04 + 13.7 / (120.0 + 3.6 * v)) + resistance
        slower = v - dt * G * np.minimum(at_rail, (brake + resistance) / (1.0 + self.rho))
        return s + dt * (v + slower) / 2.0, slower

    def draw(self, kappa: float, brake: Array, rng: np.random.Generator) -> Window:
        dt, state, states = np.where(np.arange(brake.size) % 9 == 0, 0.3, 0.1), (np.array(100.0), np.array(80.0)), []
        for k in range(brake.size):
            s, v = self.step(*state, kappa, dt[k], brake[k])
            shaken = rng.standard_normal(2) * np.sqrt([self.q_s * dt[k], self.q_v * dt[k]])
            state = s + shaken[0], v + shaken[1]
            states.append(state)
        position, speed = np.array(states).T
        noise = rng.standard_t(self.dof, brake.size) if self.dof else rng.standard_normal(brake.size)
        radar = np.where(np.arange(brake.size) % 5 == 0, 0.04, math.inf)
        quarter = np.full(brake.size, 0.25)
        return Window(dt, brake, position + 0.5 * noise, quarter, speed + 0.2 * rng.standard_normal(brake.size), radar)

    def residuals(self, unknown: Array, window: Window, prior: Belief) -> Array:
        states, kappa = unknown[:-1].reshape(-1, 2), unknown[-1]
        s, v = self.step(states[:-1, 0], states[:-1, 1], kappa, window.dt_s, window.brake)
        root = np.linalg.cholesky(np.linalg.inv(prior.covariance)).T
        seen = (window.position_m - states[1:, 0]) / np.sqrt(window.variance_m2)
        if self.dof:
            seen = np.sign(seen) * np.sqrt((self.dof + 1.0) * np.log1p(seen**2 / self.dof))
        parts = (
            root @ (np.array([*states[0], kappa]) - prior.mean),
            (states[1:, 0] - s) / np.sqrt(self.q_s * window.dt_s),
            (states[1:, 1] - v) / np.sqrt(self.q_v * window.dt_s),
            seen,
            (window.speed_mps - states[1:, 1]) / np.sqrt(window.speed_variance),
        )
        return np.concatenate(parts)

    def most_probable(self, window: Window, prior: Belief) -> Array:
        """Trajectory, flat, and kappa, by scipy from a start of its own."""
        start = np.column_stack([window.position_m, np.linspace(79.9, 77.0, window.steps)])
        unknown = np.concatenate([prior.mean[:2], start.ravel(), prior.mean[2:]])
        found = least_squares(
            self.residuals, unknown, "3-point", x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-11, args=(window, prior)
        )
        return np.asarray(found.x)


WET_PRIOR = Belief(
    np.array([100.2, 79.9, 0.9]), np.array([[0.25, 0.02, 0.0], [0.02, 0.02, -0.005], [0.0, -0.005, 0.04]])
)
CASES = [(0.0, -0.004, 0.0952), (0.1, 0.004, 0.0952), (0.1, 0.0, np.linspace(0.02, 0.12, 24))]


@pytest.mark.parametrize(
    ("rho", "grade", "brake"), CASES, ids=["downhill", "rotating, uphill", "rotating, building up"]
)
def test_most_probable_trajectory_and_kappa(rho: float, grade: float, brake: float | Array) -> None:
    wet = Wet(rho, grade, 0.0)
    window = wet.draw(0.8, np.broadcast_to(brake, 24).astype(float), np.random.default_rng(5))
    found = smooth(wet.problem(window, WET_PRIOR), SEARCH)
    best = wet.most_probable(window, WET_PRIOR)
    assert found.converged
    assert found.iterations <= 6
    assert found.kappa == pytest.approx(best[-1], abs=1e-6)
    assert found.trajectory.ravel() == pytest.approx(best[:-1], abs=1e-5)


def test_heavy_tails_are_smoothed_to_within_a_fraction_of_the_standard_deviation() -> None:
    """The weights carry the tails' curvature too, so that the mode is met only nearly; Gauss alone is far off."""
    wet = Wet(0.0, 0.004, 4.0)
    window = wet.draw(0.8, np.full(24, 0.0952), np.random.default_rng(0))
    window = replace(window, position_m=window.position_m + np.where(np.arange(24) % 6 == 3, 20.0, 0.0))
    best = wet.most_probable(window, WET_PRIOR)
    problem = wet.problem(window, WET_PRIOR)
    found = smooth(problem, SEARCH)
    std = math.sqrt(posterior(problem, found, 0.0).belief.covariance[2, 2])
    assert found.converged
    assert abs(found.kappa - best[-1]) < 0.25 * std
    assert np.max(found.weights[3::6]) < 0.02 * np.median(found.weights)
    assert abs(smooth(Wet(0.0, 0.004, 0.0).problem(window, WET_PRIOR), SEARCH).kappa - best[-1]) > std


@pytest.mark.parametrize("brake", [0.0952, 0.03])
@pytest.mark.parametrize(("rho", "grade"), [(0.0, 0.0), (0.1, 0.004)])
def test_steps_by_finite_differences(rho: float, grade: float, brake: float) -> None:
    """Of the model written out; beyond the limit kappa moves nothing, but the steps tell what it would."""
    wet, h, kappa = Wet(rho, grade, 0.0), 1e-3, 0.9
    window = wet.draw(0.8, np.full(12, brake), np.random.default_rng(0))
    rng = np.random.default_rng(1)
    states = np.column_stack([100.0 + 8.0 * np.arange(13), rng.uniform(20.0, 85.0, 13)])
    steps = wet.problem(window, WET_PRIOR).solved(states, kappa, np.ones(12)).steps
    moving, headroom = steps[:, :6].reshape(-1, 3, 2).transpose(1, 2, 0), steps[:, 6]
    s, v = states[:-1].T
    up, down = (np.array(wet.step(s, v + d, kappa, window.dt_s, window.brake)) for d in (h, -h))
    assert moving[0] == pytest.approx((up - down) / (2.0 * h), abs=1e-9)
    open_brake = np.full(12, math.inf)
    more, less = (np.array(wet.step(s, v, kappa + d, window.dt_s, open_brake)) for d in (h, -h))
    assert moving[1] == pytest.approx((more - less) / (2.0 * h), abs=1e-9)
    there = np.array(wet.step(s, v, kappa, window.dt_s, window.brake))
    assert moving[2] == pytest.approx(states[1:].T - there, abs=1e-9)
    # at its headroom the motion just begins to depend on the brake alone
    for side, moves in ((-1e-4, True), (1e-4, False)):
        at = kappa + headroom + side
        limited, free = (np.array(wet.step(s, v, at, window.dt_s, b)) for b in (window.brake, open_brake))
        assert np.all((limited[1] == free[1]) == moves)


@pytest.mark.parametrize("dof", [1.0, 4.0, 30.0])
def test_weights_of_the_tails(dof: float) -> None:
    """On average they are the Fisher information of the Student t, by integration; what is far weighs less."""
    model = Model(SEEN.motion, WET, dof)
    z = np.linspace(-400.0, 400.0, 800_001)
    density = stats.t(dof).pdf(z) * 1e-3
    score = (dof + 1.0) * z / (dof + z**2)
    assert float(np.sum(density * model.weights(z**2))) == pytest.approx(float(np.sum(density * score**2)), rel=2e-2)
    assert np.all(np.diff(model.weights(np.linspace(0.0, 50.0, 100))) < 0.0)


def test_gaussian_measurements_weigh_the_same() -> None:
    assert Model(SEEN.motion, WET, 0.0).weights(np.array([0.0, 1.0, 9.0])).tolist() == [1.0, 1.0, 1.0]
