# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The recursive fit: sums by hand, the iteration against the exact minimum, SciPy as oracle, honest covariance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear, nnls

from adhesion_node.core.creep import fit as creep_fit
from adhesion_node.core.creep.curve import adhesion, noise_products, peak, regression
from adhesion_node.core.creep.fit import Sums, add, covariance, keep_positive, nothing, solve_dfp, solve_exact
from adhesion_node.core.physics.train import Array

DRY = np.array([20 / 0.35 - 20, 100.0])


def accumulate(rows: Array, eta: float = 1.0) -> Sums:
    sums = nothing(rows.shape[1:-1])
    for row in rows:
        sums = add(sums, row, np.full(row.shape[:-1], eta))
    return sums


def noisy(runs: int, seed: int, *, in_mu: bool, top: float = 0.1, count: int = 400) -> tuple[Array, Array]:
    """Creeps and adhesions of shape (count, runs); the noise is in mu, or in Z as (7) has it."""
    rng = np.random.default_rng(seed)
    creeps = np.broadcast_to((np.arange(count) + 1)[:, None] / count * top, (count, runs))
    bottom = 1.0 if in_mu else 1.0 + DRY[0] * creeps + DRY[1] * creeps**2
    return creeps, adhesion(creeps, 20.0, DRY) + 0.01 * rng.standard_normal((count, runs)) / bottom


def test_the_sums_by_hand() -> None:
    """Two rows with a forgetting factor of 0.5: H = 0.5 U U^T + U U^T and f = 0.5 Z U + Z U, (12)."""
    sums = accumulate(np.array([[1.0, 2.0, 3.0], [4.0, 1.0, 0.5]]), 0.5)
    assert sums.hessian == pytest.approx(np.array([[0.5 * 4 + 1, 0.5 * 6 + 0.5], [0.5 * 6 + 0.5, 0.5 * 9 + 0.25]]))
    assert sums.target == pytest.approx([0.5 * 2 + 4, 0.5 * 3 + 2])
    assert sums.weight == pytest.approx(1.5)
    # H = [3 3.5; 3.5 4.75], f = [5 3.5], det = 2.
    solved = solve_exact(sums.hessian, sums.target, np.zeros(2))
    assert solved == pytest.approx([(4.75 * 5 - 3.5 * 3.5) / 2, (3 * 3.5 - 3.5 * 5) / 2])


def test_exact_data_give_the_exact_curve() -> None:
    creeps = np.linspace(0.005, 0.03, 10)
    sums = accumulate(regression(creeps, adhesion(creeps, 20.0, DRY), 20.0))
    assert solve_exact(sums.hessian, sums.target, 0.2 * DRY) == pytest.approx(DRY, rel=1e-9)
    assert solve_dfp(sums.hessian, sums.target, 0.2 * DRY) == pytest.approx(DRY, rel=1e-7)


@pytest.mark.parametrize("eta", [1.0, 0.99, 0.971])
def test_the_recursion_is_weighted_least_squares(eta: float) -> None:
    creeps, adhesions = noisy(1, 1, in_mu=True)
    rows = regression(creeps, adhesions, 20.0)
    sums = accumulate(rows, eta)
    weights = np.sqrt(eta ** np.arange(len(rows))[::-1])[:, None]
    oracle = lsq_linear(weights * rows[:, 0, 1:], weights[:, 0] * rows[:, 0, 0]).x
    assert solve_exact(sums.hessian, sums.target, DRY)[0] == pytest.approx(oracle, rel=1e-7)


def test_the_iteration_finds_the_exact_minimum() -> None:
    creeps, adhesions = noisy(200, 2, in_mu=True, top=0.06)
    sums = accumulate(regression(creeps, adhesions, 20.0), 0.99)
    exact = solve_exact(sums.hessian, sums.target, DRY)
    for start in (0.2 * DRY, DRY, np.array([500.0, 1.0])):
        assert solve_dfp(sums.hessian, sums.target, start) == pytest.approx(exact, rel=1e-7)


def test_with_one_direction_seen_both_go_to_the_minimum_nearest_to_the_start() -> None:
    row = np.array([1.5, 0.02, 0.002])
    sums, start = accumulate(row[None]), np.array([7.0, 20.0])
    u = row[1:]
    nearest = start + u * (row[0] - u @ start) / (u @ u)
    assert solve_exact(sums.hessian, sums.target, start) == pytest.approx(nearest)
    assert solve_dfp(sums.hessian, sums.target, start) == pytest.approx(nearest)


def test_without_data_both_stay_at_the_start() -> None:
    sums, start = nothing(), np.array([7.0, 20.0])
    assert solve_exact(sums.hessian, sums.target, start) == pytest.approx(start)
    assert solve_dfp(sums.hessian, sums.target, start) == pytest.approx(start)


def test_the_iteration_takes_two_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a parabola with exact steps the second ends in the minimum, up to rounding."""
    monkeypatch.setattr(creep_fit, "DFP_ITERATIONS", 2)
    hessian, target = np.array([[3.0, 1.0], [1.0, 2.0]]), np.array([1.0, -1.0])
    assert solve_dfp(hessian, target, np.zeros(2)) == pytest.approx([0.6, -0.8], rel=1e-12)
    monkeypatch.setattr(creep_fit, "DFP_ITERATIONS", 1)
    assert np.abs(solve_dfp(hessian, target, np.zeros(2)) - [0.6, -0.8]).max() > 0.05


def test_the_positive_minimum_is_that_of_scipy() -> None:
    creeps, adhesions = noisy(100, 3, in_mu=True, top=0.015, count=60)
    rows = regression(creeps, adhesions, 20.0)
    sums = accumulate(rows)
    ours = keep_positive(sums.hessian, sums.target, solve_exact(sums.hessian, sums.target, DRY))
    oracle = np.array([nnls(rows[:, run, 1:], rows[:, run, 0])[0] for run in range(100)])
    assert (oracle == 0.0).any(axis=1).sum() > 20
    assert ours == pytest.approx(oracle, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("in_mu", [True, False])
def test_the_intervals_hold_the_truth_as_often_as_they_say(in_mu: bool) -> None:
    """2000 runs over 0 to 0.1; 95 % +- 3 standard deviations of the share itself, 1.5 %."""
    creeps, adhesions = noisy(2000, 4, in_mu=in_mu)
    noise = noise_products(creeps, adhesions, 20.0, np.zeros_like(creeps), np.full_like(creeps, 1e-4 if in_mu else 0.0))
    sums = nothing((2000,))
    for row, off in zip(regression(creeps, adhesions, 20.0), noise, strict=True):
        sums = add(sums, row, np.ones(2000), off)
    theta = solve_exact(sums.hessian, sums.target, DRY)
    stds = np.sqrt(np.diagonal(covariance(sums, theta), axis1=-2, axis2=-1))
    assert np.mean(np.abs(theta - DRY) <= 1.96 * stds, axis=0) == pytest.approx([0.95, 0.95], abs=0.015)
    assert peak(20.0, theta)[0].mean() == pytest.approx(0.35, rel=0.01)


def test_the_covariance_is_infinite_while_one_direction_is_seen() -> None:
    spread = covariance(accumulate(np.tile([1.5, 0.02, 0.002], (9, 1))), DRY)
    assert np.array_equal(spread, np.diag([np.inf, np.inf]))


@pytest.mark.parametrize("count", [3, 4, 6])
def test_the_covariance_of_few_samples_by_loops(count: int) -> None:
    """H^-1 G H^-1 n/(n - 2), G the sum of r^2 U U^T; of three samples nothing is told."""
    creeps, adhesions = noisy(1, 5, in_mu=True, count=count)
    rows = regression(creeps, adhesions, 20.0)
    sums = accumulate(rows)
    theta = solve_exact(sums.hessian, sums.target, DRY)
    if count == 3:
        assert np.isposinf(np.diagonal(covariance(sums, theta)[0])).all()
        return
    spread = sum(np.outer(u, u) * (z - u @ theta[0]) ** 2 for z, *u in rows[:, 0] for u in [np.array(u)])
    inverse = np.linalg.inv(sums.hessian[0])
    assert covariance(sums, theta)[0] == pytest.approx(inverse @ spread @ inverse * count / (count - 2), rel=1e-6)


def test_however_small_the_creeps_a_regular_system_is_solved() -> None:
    """Up to 0.001 its determinant is 1e-27."""
    creeps = np.linspace(0.0002, 0.001, 9)
    sums = accumulate(regression(creeps, adhesion(creeps, 20.0, DRY), 20.0))
    assert solve_exact(sums.hessian, sums.target, 0.2 * DRY) == pytest.approx(DRY, rel=1e-4)
    assert np.isfinite(covariance(sums, DRY)).all()


def test_forgetting_follows_the_error_between_its_bounds() -> None:
    errors = np.array([0.0, 0.05, -0.05, 0.2, 1.0])
    assert creep_fit.forgetting_factor(errors, 0.1, 1.0, 0.971) == pytest.approx([1.0, 0.995, 0.995, 0.98, 0.971])
