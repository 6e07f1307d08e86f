# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Particle filter and smoother, (24)-(27), against the Kalman/RTS oracle, plain loops and a grid posterior.

Monte-Carlo bounds are K standard errors of the mean over independent runs, seeds fixed.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles import Linear, literal_pairwise, log_densities, make_window, rts, specific_resistance
from scipy import stats

from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.kernels.filtering import systematic
from adhesion_node.core.methods.kernels.smoothing import smoothed
from adhesion_node.core.methods.particle_em.particles import ParticleFilter
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import LEVEL
from adhesion_node.core.physics.train import CRH3

Array = NDArray[np.float64]
K = 4.0
RUNS = 24
PRIOR = Gaussian(np.array([100.0, 80.0]), np.array([[0.09, 0.01], [0.01, 0.04]]))
LOUD = Linear(c0=0.79, c1=0.05, q_s=0.05, q_v=0.1)
"""So much process noise that the smoother has something to do."""
CRH3_LOUD = Motion(CRH3, LEVEL, 0.05, 0.1)


def _window() -> Window:
    window = make_window(LOUD, PRIOR, 0.07, np.random.default_rng(8), steps=8)
    speed_variance = np.where(np.arange(8) == 5, 0.09, math.inf)
    return replace(window, speed_mps=np.full(8, 79.5), speed_variance=speed_variance)


class Smoothed(NamedTuple):
    """A pass's particles and weights."""

    states: Array
    """(2, K + 1, N)."""
    weights: Array
    """Filtered, (K + 1, N)."""
    marginal: Array
    """Smoothed, (K + 1, N)."""
    log_likelihood: float
    ess: float


def _smooth(  # as `motion` steps, or as another one does
    motion: Motion, prior: Gaussian, window: Window, mu: float, count: int, seed: int, other: Motion | None = None
) -> Smoothed:
    particles, log_likelihood, ess = ParticleFilter(motion, prior, window, count).run(mu, np.random.default_rng(seed))
    marginal = smoothed(particles, np.sqrt(np.array((other or motion).noise(window.dt_s))))
    weights = np.exp(particles.log_weights - particles.log_weights.max(axis=1, keepdims=True))
    return Smoothed(particles.states, weights / weights.sum(axis=1, keepdims=True), marginal, log_likelihood, ess)


def _within(samples: Array, exact: Array) -> None:
    """Mean over the first axis within K standard errors of the exact value, element by element."""
    errors = np.std(samples, axis=0, ddof=1) / math.sqrt(len(samples))
    assert np.all(np.abs(np.mean(samples, axis=0) - exact) < K * errors)


def _moments(weights: Array, states: Array) -> Array:
    """Means and variances of s and v at every time, shape (K + 1, 4)."""
    means = np.sum(weights * states, axis=2)
    return np.concatenate([means, np.sum(weights * (states - means[:, :, None]) ** 2, axis=2)]).T


@pytest.mark.parametrize("mu", [0.04, 0.2])
def test_filter_and_smoother_are_exact_up_to_monte_carlo_error(mu: float) -> None:
    window, count = _window(), 400
    exact = rts(LOUD, PRIOR, window, mu)
    filtered, after, likelihood = [], [], []
    for seed in range(RUNS):
        found = _smooth(LOUD.motion, PRIOR, window, mu, count, seed)
        filtered.append(_moments(found.weights, found.states))
        after.append(_moments(found.marginal, found.states))
        likelihood.append(math.exp(found.log_likelihood - exact.log_likelihood))
    for samples, mean, cov in (
        (filtered, exact.filtered_mean, exact.filtered_cov),
        (after, exact.mean, exact.cov),
    ):
        diagonal = cov[:, [0, 1], [0, 1]]
        # A variance about the particles' own mean is low by about 1/ESS: allow for it, nothing more.
        low = np.concatenate([np.zeros_like(mean), diagonal / 100], axis=1)
        values, target = np.array(samples), np.concatenate([mean, diagonal], axis=1)
        errors = K * np.std(values, axis=0, ddof=1) / math.sqrt(RUNS)
        assert np.all(np.abs(values.mean(axis=0) - target) < errors + low)
        assert np.all(errors < 0.25 * np.sqrt(np.concatenate([diagonal, 2 * diagonal**2], axis=1)))  # it can fail
    _within(np.array(likelihood), np.array(1.0))  # the likelihood itself is without bias


def test_log_likelihood_over_many_resamplings() -> None:
    window = make_window(LOUD, PRIOR, 0.07, np.random.default_rng(9), steps=60, sigma_m=0.2)
    exact = rts(LOUD, PRIOR, window, 0.07).log_likelihood
    ratios, ess = _likelihoods(window, 1000, 2 * RUNS, exact)
    _within(ratios, np.array(1.0))
    assert np.std(ratios) < 0.5
    assert ess.max() < 500  # below half of them: it did resample
    assert ess.min() >= 1.0


def test_likelihood_of_a_few_particles_is_without_bias() -> None:
    """Whatever N: so the resampling is without bias as well. 20 particles, 1000 runs."""
    window = make_window(LOUD, PRIOR, 0.07, np.random.default_rng(9), steps=6, sigma_m=0.3)
    exact = rts(LOUD, PRIOR, window, 0.07).log_likelihood
    ratios, ess = _likelihoods(window, 20, 1000, exact)
    _within(ratios, np.array(1.0))
    assert np.mean(ess < 10) > 0.5


def _likelihoods(window: Window, count: int, runs: int, exact: float) -> tuple[Array, Array]:
    """Likelihoods of runs over the exact one, and their smallest ESS."""
    run = ParticleFilter(LOUD.motion, PRIOR, window, count).run
    found = [run(0.07, np.random.default_rng(seed))[1:] for seed in range(runs)]
    logs, ess = np.array(found).T
    return np.exp(logs - exact), ess


@pytest.mark.parametrize("count", [2, 6])
@pytest.mark.parametrize("from_m", [0.0, 1e5])
@pytest.mark.parametrize("mu", [0.05, 0.3])
def test_vectorised_weights_equal_27_as_printed(mu: float, from_m: float, count: int) -> None:
    window = _window()
    window = replace(window, position_m=window.position_m + from_m)
    prior = PRIOR._replace(mean=PRIOR.mean + from_m * np.array([1.0, 0.0]))
    window = replace(window, dt_s=np.linspace(0.05, 0.2, 8), brake=np.linspace(0.04, 0.0952, 8))
    found = _smooth(CRH3_LOUD, prior, window, mu, count, 1)
    densities = np.exp(log_densities(found.states, CRH3_LOUD, window, mu))
    _, marginals = literal_pairwise(found.weights, densities, found.weights[-1])
    assert found.marginal == pytest.approx(np.array(marginals), rel=1e-4, abs=1e-6)


class Grid(NamedTuple):
    """Posterior of (s, v) at times 0..K by brute force: every law is a table over a grid that moves with the train."""

    mean: Array
    log_likelihood: float


def _grid_posterior(motion: Motion, prior: Gaussian, window: Window, mu: float) -> Grid:
    offsets = np.linspace(-3.6, 3.6, 37)
    cell = (offsets[1] - offsets[0]) ** 2
    ds, dv = (x.ravel() for x in np.meshgrid(offsets, offsets))
    states, laws, steps = [], [], []
    centre = prior.mean
    law = stats.multivariate_normal(prior.mean, prior.covariance).pdf(np.stack([centre[0] + ds, centre[1] + dv], 1))
    states.append((centre[0] + ds, centre[1] + dv))
    laws.append(law * cell)
    log_likelihood = 0.0
    for t in range(window.steps):
        dt, (s, v) = float(window.dt_s[t]), states[-1]
        slower = v - dt * 9.8 * (min(mu, float(window.brake[t])) + specific_resistance(v))
        moved = s + dt * (v + slower) / 2
        centre = np.array([moved.mean(), slower.mean()])
        after = (centre[0] + ds, centre[1] + dv)
        std_s, std_v = math.sqrt(motion.position_noise_rate * dt), math.sqrt(motion.speed_noise_rate * dt)
        step = stats.norm.pdf(after[0][None, :], moved[:, None], std_s)
        step *= stats.norm.pdf(after[1][None, :], slower[:, None], std_v) * cell
        joint = laws[-1] @ step * stats.norm.pdf(window.position_m[t], after[0], math.sqrt(window.variance_m2[t]))
        log_likelihood += math.log(joint.sum())
        states.append(after)
        laws.append(joint / joint.sum())
        steps.append(step)
    smooth = laws[-1]
    means: list[list[float]] = []
    for t in range(window.steps, -1, -1):
        means.insert(0, [smooth @ states[t][0], smooth @ states[t][1]])
        if t:
            predicted = laws[t - 1] @ steps[t - 1]
            smooth = laws[t - 1] * (steps[t - 1] @ (smooth / np.maximum(predicted, 1e-300)))
    return Grid(np.array(means), log_likelihood)


@pytest.mark.parametrize("offset_m", [0.0, 2.0], ids=["ordinary", "outlier"])
def test_smoother_equals_a_brute_force_grid(offset_m: float) -> None:
    """Three steps of 1 s with the published, curved resistance; the outlier is 4 of its standard deviations off."""
    motion = Motion(CRH3, LEVEL, 0.25, 0.25)
    prior = Gaussian(np.array([0.0, 70.0]), np.diag([0.25, 0.3]))
    measured = np.array([69.4, 138.3, 206.0]) + offset_m * np.array([0.0, 1.0, 0.0])
    window = Window(np.ones(3), np.full(3, 0.0952), measured, np.full(3, 0.25), np.zeros(3), np.full(3, math.inf))
    grid = _grid_posterior(motion, prior, window, 0.06)
    means, ratios = [], []
    for seed in range(RUNS):
        found = _smooth(motion, prior, window, 0.06, 1000, seed)
        means.append(_moments(found.marginal, found.states)[:, :2])
        ratios.append(math.exp(found.log_likelihood - grid.log_likelihood))
    _within(np.array(means), grid.mean)
    _within(np.array(ratios), np.array(1.0))


@pytest.mark.parametrize("offset_m", [30.0, 1e4, 1e8])
def test_a_measurement_that_no_particle_explains_leaves_laws(offset_m: float) -> None:
    window = _window()
    window = replace(window, position_m=window.position_m + offset_m * (np.arange(8) == 3))
    found = _smooth(CRH3_LOUD, PRIOR, window, 0.07, 20, 4)
    assert math.isfinite(found.log_likelihood)
    assert found.marginal.sum(axis=1) == pytest.approx(np.ones(9))
    assert np.all(found.marginal >= 0.0)
    assert 1.0 <= found.ess < 2.0


def test_smoother_with_a_step_far_beyond_the_noise() -> None:
    """Hardly any process noise: all densities but one per column underflow, the columns are laws all the same."""
    quiet = Motion(CRH3, LEVEL, 1e-12, 1e-12)
    found = _smooth(CRH3_LOUD, PRIOR, _window(), 0.07, 10, 5, quiet)
    assert found.marginal.sum(axis=1) == pytest.approx(np.ones(9))
    assert np.all(found.marginal >= 0.0)


def test_resampling_is_systematic() -> None:
    """N weights, one offset: the numbers (j + offset)/N fall on the particles whose cumulated weight reaches them."""
    weights, offset = np.random.default_rng(0).exponential(size=12) * (np.arange(12) % 5 != 0), 0.3
    upto = np.cumsum(weights / weights.sum())
    expected = [next(i for i in range(12) if upto[i] >= (j + offset) / 12) for j in range(12)]
    assert systematic(weights, offset).tolist() == expected


def test_same_generator_same_particles() -> None:
    one, two, other = (_smooth(CRH3_LOUD, PRIOR, _window(), 0.07, 20, seed) for seed in (6, 6, 7))
    assert np.array_equal(one.states, two.states)
    assert one.log_likelihood == two.log_likelihood
    assert not np.array_equal(one.states, other.states)
