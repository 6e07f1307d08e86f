# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The statistics (29)-(32) of an E-step and the maximum (33) of what they give: against slopes, a grid and scipy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from em_window import by_particles, exactly, noisy_window
from loud_rail import SEEN
from numpy.typing import ArrayLike
from oracles import literal_pairwise, log_densities
from scipy.optimize import minimize_scalar

from adhesion_node.core.methods.particle_em.em import Expectation, maximise
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import LEVEL, Grade, Track
from adhesion_node.core.physics.train import CRH3


def _expected(used: ArrayLike, weight: ArrayLike, limit: ArrayLike) -> Expectation:
    return Expectation(np.array((used, weight, limit)), 0.0, 0.0, 0.0)


def gradient(expected: Expectation, mu: float) -> float:
    """dQ/dmu (29)-(32) at `mu`: only I2 depends on mu, and only through the steps that adhesion limits."""
    return float(np.sum(expected.weight * (expected.used - mu), where=expected.limit > mu))


@pytest.mark.parametrize("track", [LEVEL, Track((Grade(-1000.0, 1000.0, 2.0),))], ids=["level", "grade"])
@pytest.mark.parametrize("mu", [0.0, 0.03, 0.05, 0.08, 0.2])
def test_gradient_29_to_32_is_the_slope_of_i2(mu: float, track: Track) -> None:
    """At the start's mu and elsewhere, below, between and above the brakes of the steps."""
    motion, h = Motion(CRH3, track, 0.05, 0.1), 1e-6
    window = replace(noisy_window(), brake=np.linspace(0.04, 0.0952, 30), dt_s=np.linspace(0.05, 0.2, 30))
    e_step = by_particles(motion, window, 15)
    slope = gradient(e_step(0.05), mu)
    states, _, log_weights = e_step.filter.particles
    weights = np.exp(log_weights - log_weights.max(axis=1, keepdims=True))
    grade = 1.0 if track.sections else 0.0
    logs = [log_densities(states, motion, window, m, grade) for m in (0.05, mu - h, mu + h)]
    pairs, _ = literal_pairwise(weights, np.exp(logs[0]), weights[-1] / weights[-1].sum())
    low, high = (float(np.sum(np.array(pairs) * log)) for log in logs[1:])
    assert slope == pytest.approx((high - low) / (2 * h), rel=1e-4, abs=1e-3)
    if mu == 0.2:
        assert slope == 0.0


def test_gradient_by_hand() -> None:
    expected = _expected([0.05, 0.09], [2e4, 1e4], [0.08, 0.10])
    assert gradient(expected, 0.06) == pytest.approx(2e4 * -0.01 + 1e4 * 0.03)
    assert gradient(expected, 0.085) == pytest.approx(1e4 * 0.005)  # the first step is at its brake's limit
    assert gradient(expected, 0.11) == 0.0


def test_weight_is_the_information_of_a_step() -> None:
    window = noisy_window()
    expected = exactly(window, 0.05)
    # T = 0.1: (9.8 T)^2/(q_v T) + (9.8 T^2/2)^2/(q_s T) = 0.9604/2e-4 + 0.002401/1e-5 = 4802 + 240.1
    assert expected.weight == pytest.approx(np.full(30, 5042.1))
    ours = by_particles(SEEN.motion, window, 5)(0.05)
    assert ours.weight == pytest.approx(expected.weight)
    assert ours.limit == pytest.approx(window.brake)


def _q(expected: Expectation, mu: np.ndarray) -> np.ndarray:
    used = np.minimum(np.reshape(mu, (-1, 1)), expected.limit)
    return np.asarray(-0.5 * np.sum(expected.weight * (used - expected.used) ** 2, axis=1))


def _expectations() -> Iterator[tuple[Expectation, float]]:
    rng = np.random.default_rng(11)
    for case in range(60):
        k = int(rng.integers(1, 8))
        limit = rng.choice([0.03, 0.06, 0.0952], k) if case % 2 else rng.uniform(0.0, 0.1, k)
        used = rng.normal(0.06, 0.05, k)
        yield _expected(used, rng.uniform(1.0, 1e4, k), limit), float(rng.choice([0.0, -0.05, 0.04]))


def test_maximum_33_beats_a_dense_grid_and_scipy() -> None:
    at_kink = 0
    for expected, lowest in _expectations():
        mu = maximise(expected, lowest)
        grid = np.linspace(lowest, 0.15, 20_001)
        values = _q(expected, grid)
        best = minimize_scalar(
            lambda m, e=expected: -_q(e, np.array([m]))[0],
            bounds=(max(lowest, grid[np.argmax(values)] - 1e-4), grid[np.argmax(values)] + 1e-4),
            method="bounded",
        )
        found = _q(expected, np.array([mu]))[0]
        assert found >= max(values.max(), -best.fun) - 1e-9 * (1 + abs(found))
        assert lowest <= mu <= max(lowest, expected.limit.max())
        at_kink += bool(np.any(np.isclose(mu, expected.limit, atol=1e-12)))
    assert at_kink > 5  # the cases do visit the kinks


def test_maximum_of_one_parabola_is_its_mean() -> None:
    expected = _expected([0.05, 0.07], [1.0, 3.0], [0.0952, 0.0952])
    assert maximise(expected, 0.0) == pytest.approx(0.065)  # (0.05 + 3 x 0.07)/4
    assert gradient(expected, maximise(expected, 0.0)) == pytest.approx(0.0, abs=1e-12)


def test_maximum_never_exceeds_what_the_brake_uses_and_respects_the_lowest() -> None:
    more = _expected([0.2] * 3, [1.0] * 3, [0.05, 0.0952, 0.07])
    assert maximise(more, 0.0) == 0.0952
    forward = _expected([-0.013] * 3, [1.0] * 3, [0.0952] * 3)
    assert maximise(forward, 0.0) == 0.0
    assert maximise(forward, -0.05) == pytest.approx(-0.013)
