# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Maximum likelihood with noise on both variables: SciPy on all unknowns as oracle, no bias, honest covariance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import curve_fit, least_squares

from adhesion_node.core.creep.curve import adhesion, peak, regression
from adhesion_node.core.creep.fit import add, nothing, solve_exact
from adhesion_node.core.physics.train import Array
from adhesion_node.study.he.errors_in_variables import NoiseStd, fit, true_creeps

DRY = np.array([20 / 0.35 - 20, 100.0])
NOISE = NoiseStd(0.001, 0.01)


def noisy(seed: int, count: int, top: float = 0.1, noise: NoiseStd = NOISE) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    creeps = (np.arange(count) + 1) / count * top
    measured = creeps + noise.creep * rng.standard_normal(count)
    return measured, adhesion(creeps, 20.0, DRY) + noise.adhesion * rng.standard_normal(count)


def test_it_is_the_minimum_over_all_unknowns() -> None:
    """The oracle searches p1, p2 and every true creep at once."""
    creeps, adhesions = noisy(1, 60)

    def residuals(unknowns: Array) -> Array:
        theta, true = unknowns[:2], unknowns[2:]
        away = (adhesions - adhesion(true, 20.0, theta)) / NOISE.adhesion
        return np.concatenate([away, (creeps - true) / NOISE.creep])

    bounds = np.concatenate([[1e-6, 1e-6], np.zeros(60)]), np.inf
    oracle = least_squares(
        residuals, np.concatenate([DRY, np.maximum(creeps, 1e-9)]), bounds=bounds, x_scale="jac", xtol=1e-14, ftol=1e-14
    )
    ours = fit(creeps, adhesions, 20.0, 0.2 * DRY, NOISE)
    assert ours.converged
    assert ours.theta == pytest.approx(oracle.x[:2], rel=1e-4)


def test_with_an_exact_creep_it_is_the_nonlinear_least_squares() -> None:
    creeps, adhesions = noisy(2, 200, noise=NoiseStd(1e-7, 0.01))
    oracle, spread = curve_fit(
        lambda x, a, b: 20.0 * x / (1.0 + a * x + b * x * x),
        creeps,
        adhesions,
        p0=DRY,
        sigma=np.full(200, 0.01),
        absolute_sigma=True,
    )
    ours = fit(creeps, adhesions, 20.0, 0.2 * DRY, NoiseStd(1e-7, 0.01))
    assert ours.theta == pytest.approx(oracle, rel=1e-4)
    assert ours.covariance == pytest.approx(spread, rel=1e-3)


def test_the_moved_creeps_are_the_nearest_points() -> None:
    creeps, adhesions = noisy(3, 40)
    moved = true_creeps(creeps, adhesions, 20.0, DRY, NOISE)
    grid = np.linspace(0.0, 0.12, 120_001)
    curve = adhesion(grid, 20.0, DRY)
    for measured, mu, found in zip(creeps, adhesions, moved, strict=True):
        cost = ((mu - curve) / NOISE.adhesion) ** 2 + ((measured - grid) / NOISE.creep) ** 2
        assert found == pytest.approx(grid[cost.argmin()], abs=2e-6)


def test_plain_least_squares_is_biased_by_noise_on_the_creep_and_this_is_not() -> None:
    plain, likeliest = [], []
    for seed in range(20):
        creeps, adhesions = noisy(seed, 1200, top=0.03)
        sums = nothing()
        for row in regression(creeps, adhesions, 20.0):
            sums = add(sums, row, np.array(1.0))
        plain.append(peak(20.0, solve_exact(sums.hessian, sums.target, DRY))[0])
        likeliest.append(peak(20.0, fit(creeps, adhesions, 20.0, 0.2 * DRY, NOISE).theta)[0])
    assert np.mean(plain) < 0.335
    assert np.mean(likeliest) == pytest.approx(0.35, abs=0.01)


def test_its_covariance_covers() -> None:
    """300 runs; 95 % within 3 standard deviations of the share, 3.8 %."""
    inside = []
    for seed in range(300):
        found = fit(*noisy(seed, 150), 20.0, DRY, NOISE)
        inside.append(np.abs(found.theta - DRY) <= 1.96 * np.sqrt(np.diag(found.covariance)))
    assert np.mean(inside, axis=0) == pytest.approx([0.95, 0.95], abs=0.04)


def test_noise_of_zero_is_refused() -> None:
    with pytest.raises(ValueError, match="give standard deviations above 0, 3 samples"):
        fit(np.ones(5), np.ones(5), 20.0, DRY, NoiseStd(0.0, 0.01))
