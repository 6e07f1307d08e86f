# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The Gaussian smoother of a window: textbook recursions, plain EM, brute force, and the least squares of scipy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from oracles import Array, Linear, rts, specific_resistance
from oracles_kappa import Conditioned, draw, em_kappa, joint, smoothed
from scipy import stats
from scipy.optimize import least_squares, minimize_scalar

from adhesion_node.core import Config
from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.rail_condition.branch import log_likelihood, smoothed_branch
from adhesion_node.core.methods.rail_condition.hypotheses import Hypothesis
from adhesion_node.core.methods.rail_condition.problem import Belief, Model, Problem
from adhesion_node.core.methods.rail_condition.smoother import KappaSearch, posterior, smooth
from adhesion_node.core.physics.adhesion import WET, SpeedLaw
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import Grade, Track
from adhesion_node.core.physics.train import Train

G = 9.8
SEEN = Linear(c0=0.79, c1=0.02, q_s=1e-4, q_v=2e-3)
"""Loud and measured well: a window's positions hold a good share of what its states do."""
RAIL = Conditioned(SEEN, 0.05)
STATE = np.array([[0.04, 0.005], [0.005, 0.01]])
PRIOR = Belief(
    np.array([100.0, 80.0, 1.2]), np.array([[0.04, 0.005, 0.01], [0.005, 0.01, -0.005], [0.01, -0.005, 0.09]])
)
SEARCH = KappaSearch(start=0.3, lowest=0.0, tolerance=1e-9, iterations=50)
TIMID = np.where(np.arange(30) < 12, 0.02, 0.0952)
"""A brake that builds up: at its limit in the first steps for any kappa of interest."""


def _window(seed: int, brake: float | Array = 0.0952, speeds: int = 0) -> tuple[Conditioned, Window]:
    rail = Conditioned(SEEN, 0.05, limited_below=0.03)
    return rail, draw(rail, np.full(30, 1.1), np.random.default_rng(seed), gaps=(7, 14, 15), brake=brake, speeds=speeds)


@pytest.mark.parametrize("speeds", [0, 4])
@pytest.mark.parametrize("brake", [0.0952, TIMID], ids=["full", "building up"])
def test_equals_kalman_filter_and_rts_smoother(brake: float | Array, speeds: int) -> None:
    for seed in range(3):
        rail, window = _window(seed, brake, speeds)
        problem, exact = rail.problem(window, PRIOR), smoothed(rail, PRIOR, window)
        found = smooth(problem, SEARCH)
        assert found.converged
        assert found.iterations <= 5  # once there, one more shows that it stands still
        assert found.trajectory == pytest.approx(exact.mean[:, :2], abs=1e-7)
        assert found.kappa == pytest.approx(exact.mean[0, 2], abs=1e-8)
        law = posterior(problem, found, 0.0).belief
        assert law.mean == pytest.approx(exact.mean[-1], abs=1e-7)
        assert law.covariance == pytest.approx(exact.cov[-1], rel=1e-6, abs=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_ends_where_plain_em_ends(seed: int) -> None:
    rail, window = _window(seed)
    assert smooth(rail.problem(window, PRIOR), SEARCH).kappa == pytest.approx(
        em_kappa(rail, PRIOR, window, 0.3), abs=1e-7
    )


def test_starting_point_and_trajectory_do_not_matter() -> None:
    rail, window = _window(0)
    problem = rail.problem(window, PRIOR)
    one = smooth(problem, SEARCH)
    near = one.trajectory + np.random.default_rng(0).standard_normal(one.trajectory.shape)
    for other in (smooth(problem, SEARCH._replace(start=1.8)), smooth(problem, SEARCH, near)):
        assert other.kappa == pytest.approx(one.kappa, abs=1e-9)
        assert other.trajectory == pytest.approx(one.trajectory, abs=1e-7)


def test_kappa_stays_above_the_lowest() -> None:
    window = draw(RAIL, np.full(30, -1.5), np.random.default_rng(0))  # traction
    found = smooth(RAIL.problem(window, PRIOR), SEARCH._replace(lowest=0.1))
    assert (found.kappa, found.converged) == (0.1, True)


# --- evidence and the law that a beginning leaves


@pytest.mark.parametrize("speeds", [0, 4])
@pytest.mark.parametrize("brake", [0.0952, TIMID], ids=["full", "building up"])
def test_evidence_of_two_laws_differs_as_their_densities_do(brake: float | Array, speeds: int) -> None:
    for seed in range(3):
        rail, window = _window(seed, brake, speeds)
        ours, brute = [], []
        for floor, mean in ((0.05, 1.2), (0.06, 1.2), (0.05, 0.8)):
            other, prior = rail._replace(floor=floor), PRIOR._replace(mean=np.array([100.0, 80.0, mean]))
            problem = other.problem(window, prior)
            ours.append(posterior(problem, smooth(problem, SEARCH), 0.0).log_evidence)
            brute.append(joint(other, prior, window).log_evidence)
        assert np.diff(ours) == pytest.approx(np.diff(brute), abs=1e-7)
        assert np.max(np.abs(np.diff(brute))) > 0.1


@pytest.mark.parametrize("speeds", [0, 4])
def test_the_log_likelihood_is_that_of_a_kalman_filter(speeds: int) -> None:
    """Of one hypothesis, and of two by their weights; a Gaussian with as many degrees of freedom is nearly the same."""
    rail, window = _window(3, speeds=speeds)
    other = PRIOR._replace(mean=PRIOR.mean + np.array([0.0, 0.0, 0.3]))
    exact = [smoothed(rail, belief, window).log_likelihood for belief in (PRIOR, other)]
    motion = rail.train.motion
    noise_m, noise_mps = (math.sqrt(float(variance)) for variance in motion.noise(0.1))
    config = Config(motion.train, tail_dof=0.0, position_noise_m=noise_m, speed_noise_mps=noise_mps, tolerance=1e-12)
    ours = []
    for log_weights in ([0.0], [math.log(0.3), math.log(0.1)]):
        hypotheses = [
            Hypothesis(SpeedLaw(rail.floor), belief, weight)
            for belief, weight in zip((PRIOR, other), log_weights, strict=False)
        ]
        ours.append(log_likelihood([smoothed_branch(config, window, each, None, None, 0.0) for each in hypotheses]))
    assert ours[0] == pytest.approx(exact[0], abs=1e-6)
    assert ours[1] == pytest.approx(np.logaddexp(exact[0] + math.log(0.75), exact[1] + math.log(0.25)), abs=1e-6)
    heavy = [
        log_likelihood([smoothed_branch(replace(config, tail_dof=dof), window, hypotheses[0], None, None, 0.0)])
        for dof in (1e6, 4.0)
    ]
    assert heavy[0] == pytest.approx(exact[0], abs=1e-3)
    assert abs(heavy[1] - exact[0]) > 0.1


@pytest.mark.parametrize("count", [1, 10, 29])
def test_law_of_a_beginning_is_the_filters_and_knows_nothing_of_what_follows(count: int) -> None:
    rail, window = _window(1)
    lifted = np.where(np.arange(30) < count, 0.0, 0.3)
    exact, evidences = smoothed(rail, PRIOR, window), []
    for later in (window, replace(window, position_m=window.position_m + lifted)):
        problem = rail.problem(later, PRIOR)
        hindsight = smooth(problem, SEARCH)
        begun = posterior(replace(problem, window=_first(later, count)), hindsight, 0.0)
        assert begun.belief.mean == pytest.approx(exact.filtered_mean[count], abs=1e-7)
        assert begun.belief.covariance == pytest.approx(exact.filtered_cov[count], rel=1e-6, abs=1e-10)
        evidences.append(begun.log_evidence)
    assert evidences[0] == pytest.approx(evidences[1], abs=1e-7)


def test_a_beginning_and_the_rest_are_the_whole() -> None:
    """The chain rule: the law that the beginning leaves is the prior of the rest."""
    rail, window = _window(2)
    problem = rail.problem(window, PRIOR)
    found = smooth(problem, SEARCH)
    begun = posterior(replace(problem, window=_first(window, 12)), found, 0.0)
    rest = rail.problem(_rest(window, 12), begun.belief)
    then = posterior(rest, smooth(rest, SEARCH), 0.0)
    whole = posterior(problem, found, 0.0)
    assert then.belief.mean == pytest.approx(whole.belief.mean, abs=1e-7)
    assert then.belief.covariance == pytest.approx(whole.belief.covariance, rel=1e-6, abs=1e-10)
    assert begun.log_evidence + then.log_evidence == pytest.approx(whole.log_evidence, abs=1e-6)


def test_steps_that_might_be_limited_tell_nothing_of_kappa() -> None:
    rail, window = _window(0)
    problem = rail.problem(window, PRIOR)
    found = smooth(problem, SEARCH)
    headroom = 0.0952 / 0.05 - found.kappa
    used, unused = (posterior(problem, found, headroom + e).belief for e in (-1e-6, 1e-6))
    exact = smoothed(rail, PRIOR, window).cov[-1, 2, 2]
    assert used.covariance[2, 2] == pytest.approx(exact)
    # the state's own correlation with kappa is left
    tied = PRIOR.covariance[2, 2] - PRIOR.covariance[2, :2] @ np.linalg.solve(STATE, PRIOR.covariance[:2, 2])
    assert tied < unused.covariance[2, 2] <= PRIOR.covariance[2, 2]


def _first(window: Window, count: int) -> Window:
    return Window(*(getattr(window, name)[:count] for name in Window.__dataclass_fields__))


def _rest(window: Window, count: int) -> Window:
    return Window(*(getattr(window, name)[count:] for name in Window.__dataclass_fields__))


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


def test_refuses_a_prior_that_is_not_positive_definite() -> None:
    rail, window = _window(0)
    covariance = PRIOR.covariance.copy()
    covariance[2, 2] = -0.09
    with pytest.raises(np.linalg.LinAlgError, match=r"(?s)the prior's covariance .* is not positive definite"):
        smooth(rail.problem(window, PRIOR._replace(covariance=covariance)), SEARCH)


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
