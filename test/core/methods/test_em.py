# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""EM of one window, (18)-(34): likelihood and convergence against the exact smoother."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from em_window import PRIOR, by_particles, exactly, noisy_window
from loud_rail import SEEN
from oracles import ExactEStep, log_likelihood, rts
from scipy.optimize import minimize_scalar

from adhesion_node.core.belief.rail import kept_of_start
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.particle_em.em import Expectation, Identified, Search, identify, maximise
from adhesion_node.core.methods.particle_em.kalman import filtered_by
from adhesion_node.core.methods.particle_em.particles import given


def _information(window: Window, mu: float) -> float:
    return filtered_by(given(SEEN.motion, PRIOR, window), mu).information


def _best_mu(window: Window, limit: float = 0.0952) -> float:
    """Maximum-likelihood mu: the best of a grid, polished between its neighbours."""
    grid = np.linspace(0.0, limit, 100)
    best = grid[np.argmax([log_likelihood(SEEN, PRIOR, window, mu) for mu in grid])]
    found = minimize_scalar(
        lambda mu: -log_likelihood(SEEN, PRIOR, window, mu),
        bounds=(max(best - 1e-3, 0.0), min(best + 1e-3, limit)),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return float(found.x)


def _exact_em(window: Window, start: float, iterations: int, tolerance: float = 0.0) -> Identified:
    return identify(ExactEStep(SEEN, PRIOR, window), Search(start, iterations, tolerance))


@pytest.mark.parametrize("start", [0.0, 0.05, 0.12])
def test_exact_em_never_lowers_the_likelihood(start: float) -> None:
    window, mu = replace(noisy_window(), brake=np.linspace(0.03, 0.0952, 30)), start
    likelihoods = [log_likelihood(SEEN, PRIOR, window, mu)]
    for _ in range(40):
        mu = maximise(exactly(window, mu), 0.0)
        likelihoods.append(log_likelihood(SEEN, PRIOR, window, mu))
    assert np.all(np.diff(likelihoods) >= -1e-9)
    if start < 0.0952:  # above the largest limit the likelihood is flat
        assert likelihoods[-1] > likelihoods[0]


@pytest.mark.parametrize("start", [0.0, 0.04, 0.09])
def test_exact_em_converges_to_maximum_likelihood(start: float) -> None:
    window = noisy_window()
    best = _best_mu(window)
    assert 0.02 < best < 0.09  # inside, or the test would be about the bounds
    found = _exact_em(window, start, 2000, 1e-10)
    assert found.converged
    assert found.mu == pytest.approx(best, abs=1e-6)
    assert found.log_likelihood == pytest.approx(log_likelihood(SEEN, PRIOR, window, best), abs=1e-6)


def test_em_at_a_weak_brake_says_at_least_that_much() -> None:
    """Noise makes the window look braked by a little less, or by more than the brake can: the answer is the brake's."""
    found = {seed: _exact_em(noisy_window(0.3, seed, brake=0.03), 0.0, 100) for seed in range(3)}
    assert {one.limit for one in found.values()} == {0.03}
    for seed, one in found.items():
        assert one.mu == pytest.approx(_best_mu(noisy_window(0.3, seed, brake=0.03), 0.03), abs=1e-6)
    assert any(one.mu == 0.03 and not one.converged for one in found.values())
    assert any(one.mu < 0.03 and one.converged for one in found.values())


def test_standing_at_an_end_of_the_range_is_not_convergence() -> None:
    """A train that is pushed forward: mu stays at 0 without EM having arrived anywhere."""
    found = _exact_em(noisy_window(-0.02), 0.0, 13, 1e-7)
    assert (found.mu, found.converged, found.iterations) == (0.0, False, 7)


def _stepwise_em(window: Window, start: float, iterations: int) -> float:
    """EM as the paper has it, an E and an M step after the other."""
    mu = start
    for _ in range(iterations):
        mu = maximise(exactly(window, mu), 0.0)
    return mu


@pytest.mark.parametrize("iterations", [1, 5, 40])
def test_half_as_many_passes_lead_where_iterations_do(iterations: int) -> None:
    """And that is told by the missing information: the share of its start that EM keeps."""
    window = noisy_window()
    best, found = _best_mu(window), _exact_em(window, 0.03, iterations)
    assert found.mu == pytest.approx(_stepwise_em(window, 0.03, iterations), abs=1e-9)
    assert (found.mu - best) / (0.03 - best) == pytest.approx(found.kept, abs=1e-5)
    complete = float(exactly(window, found.mu).weight.sum())
    assert found.kept == pytest.approx(kept_of_start(_information(window, found.mu), complete, iterations), rel=1e-6)
    assert found.iterations == math.ceil(0.5 * (1.0 + found.kept) * iterations)


def test_a_start_beyond_the_brake_is_one_at_its_limit() -> None:
    beyond, at = (_exact_em(noisy_window(), start, 10) for start in (0.2, 0.0952))
    assert beyond.mu == at.mu
    assert beyond.kept == at.kept


def test_passes_average_what_their_particles_leave_to_chance() -> None:
    """From where EM ends: the paper's settings, and 50 iterations one after the other; the same mean, less noise."""
    window, single, averaged = noisy_window(), [], []
    start = _stepwise_em(window, 0.05, 200)
    for seed in range(60):
        e_step, mu = by_particles(SEEN.motion, window, 20, seed), start
        for _ in range(50):
            mu = maximise(e_step(mu), 0.0)
        single.append(mu)
        averaged.append(identify(by_particles(SEEN.motion, window, 20, seed), Search(start, 50, 0.0)).mu)
    error = math.hypot(np.std(single), np.std(averaged)) / math.sqrt(60)
    assert abs(np.mean(single) - np.mean(averaged)) < 4.0 * error
    assert np.std(averaged) < 0.8 * np.std(single)


def test_observed_information_is_that_of_the_exact_expectation() -> None:
    window = noisy_window()
    complete = float(exactly(window, 0.05).weight.sum())
    assert complete == pytest.approx(30 * 5042.1)
    observed = exactly(window, 0.05).observed
    assert by_particles(SEEN.motion, window, 5)(0.05).observed == pytest.approx(observed)
    assert 0.005 < observed / complete < 0.5  # neither all seen nor nothing: the rate tests mean something


def test_particle_em_is_exact_em_up_to_monte_carlo_error() -> None:
    """16 independent runs of 15 iterations: their mean within 4 standard errors of exact EM's."""
    window, runs = noisy_window(), 16
    exact = _exact_em(window, 0.03, 15).mu
    search = Search(0.03, 15, 0.0)
    found = [identify(by_particles(SEEN.motion, window, 150, seed), search).mu for seed in range(runs)]
    error = float(np.std(found, ddof=1)) / 4.0
    assert abs(float(np.mean(found)) - exact) < 4.0 * error
    assert error < 0.05 * abs(exact - 0.03)  # it can fail


def test_particle_e_step_gives_the_exact_statistics() -> None:
    window = noisy_window()
    exact = exactly(window, 0.05)
    runs = [by_particles(SEEN.motion, window, 150, seed)(0.05) for seed in range(16)]
    used = np.array([run.used for run in runs])
    errors = np.std(used, axis=0, ddof=1) / 4.0
    assert np.all(np.abs(used.mean(axis=0) - exact.used) < 5.0 * errors)  # 30 steps: 5 instead of 4
    ratios = np.exp([run.log_likelihood - exact.log_likelihood for run in runs])
    assert abs(np.mean(ratios) - 1.0) < 4.0 * np.std(ratios, ddof=1) / 4.0
    assert all(1.0 <= run.ess <= 150.0 for run in runs)


def test_stops_at_the_tolerance_34_and_not_before() -> None:
    asked = list[float]()

    class Recorded(ExactEStep):
        def __call__(self, mu: float) -> Expectation:
            asked.append(mu)
            return super().__call__(mu)

    found = identify(Recorded(SEEN, PRIOR, noisy_window()), Search(0.03, 20, 1e-4))
    moved = np.abs(np.diff([*asked, found.mu]))
    assert found.converged
    assert 2 < found.iterations == moved.size < 10
    assert moved[-1] <= 1e-4 < moved[:-1].min()
    assert found.kept == pytest.approx(
        (found.mu - _best_mu(noisy_window())) / (0.03 - _best_mu(noisy_window())), abs=1e-5
    )


def test_likelihood_of_identify_is_the_filters() -> None:
    window = noisy_window()
    found = _exact_em(window, 0.06, 1)
    assert found.log_likelihood == rts(SEEN, PRIOR, window, 0.06).log_likelihood
    assert math.isinf(found.ess)
