# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The peers: each smooths to what the exact smoother gives, and stands beside ours in a table."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from oracles import Linear, make_window, rts

from adhesion_node.bench import scene
from adhesion_node.bench.peers import gaussian, normal, particle
from adhesion_node.core.belief.gaussian import Gaussian


def peer(name: str) -> Any:
    """A module of `bench` that needs a peer, or a skip where the extra is not installed."""
    pytest.importorskip(name)
    return pytest.importorskip(f"adhesion_node.bench.peers.{name}_smoother")


def test_rts_of_filterpy_is_the_exact_smoother() -> None:
    model = Linear(c0=0.79, c1=0.05)
    prior = Gaussian(np.array([100.0, 80.0]), np.array([[0.09, 0.01], [0.01, 0.04]]))
    window = make_window(model, prior, 0.07, np.random.default_rng(3))
    window = replace(window, dt_s=np.linspace(0.05, 0.2, window.steps))
    exact = rts(model, prior, window, 0.06)
    laws = peer("filterpy").rts_window(model.motion, prior, window, 0.06)
    np.testing.assert_allclose(laws.mean, exact.mean, rtol=1e-9)
    np.testing.assert_allclose(laws.covariance, exact.cov, rtol=1e-6)


def test_smoothers_of_particles_are_exact_up_to_monte_carlo_error() -> None:
    model, smoothers = Linear(c0=0.79, c1=0.05, q_s=0.05, q_v=0.1), peer("particles")
    prior = Gaussian(np.array([100.0, 80.0]), np.array([[0.09, 0.01], [0.01, 0.04]]))
    window = make_window(model, prior, 0.07, np.random.default_rng(3), steps=8)
    exact = rts(model, prior, window, 0.07)
    drawn = scene.Scene(model.motion, prior, window)
    for smoother in (smoothers.mcmc, smoothers.exact):
        means = np.array([smoother(drawn, 0.07, 100).mean(axis=1) for _ in range(20)])
        assert means.shape == (20, 9, 2)
        errors = means.std(axis=0, ddof=1) / math.sqrt(20)
        assert np.all(np.abs(means.mean(axis=0) - exact.mean) < 6.0 * errors)


def test_particle_comparison_has_a_row_per_smoother() -> None:
    peer("particles")
    rows = particle.compare(steps=5, count=20, rounds=3, seed=1)
    assert [row["method"] for row in rows] == [particle.OURS, particle.MCMC, particle.EXACT]
    assert [row["calls"] for row in rows] == [3, 3, 1]
    assert rows[0]["ratio"] == 1.0
    assert rows[0]["differs_mps"] == 0.0
    for row in rows:
        assert row["ratio"] == pytest.approx(row["median_ms"] / rows[0]["median_ms"])
        assert row["mu"] == pytest.approx(scene.MU, abs=0.02)
        assert row["differs_mps"] < 0.2


def test_gaussian_comparison_ends_everywhere_in_the_same_adhesion() -> None:
    peer("filterpy")
    rows = {row["method"]: row for row in gaussian.compare(steps=30, rounds=2, seed=1)}
    assert list(rows) == [gaussian.OURS, gaussian.PASS, gaussian.FIFTY, gaussian.CONVERGED]
    assert [row["calls"] for row in rows.values()] == [2, 2, 2, 1]
    assert rows[gaussian.OURS]["mu_differs"] == 0.0
    assert rows[gaussian.PASS]["iterations"] == 1
    converged = rows[gaussian.CONVERGED]
    assert 50 < converged["iterations"] < gaussian.MOST_ITERATIONS
    assert converged["mu_differs"] < 1e-5
    assert converged["speed_differs_mps"] < 1e-3
    assert converged["ratio"] == pytest.approx(converged["median_ms"] / rows[gaussian.OURS]["median_ms"])


def test_a_normal_equation_has_one_solution() -> None:
    pytest.importorskip("gtsam")
    rows = {row["method"]: row for row in normal.compare(steps=20, rounds=2, seed=1)}
    assert list(rows) == [normal.BARE, normal.OURS, normal.SEARCHED, normal.BUILT, normal.ELIMINATED]
    assert rows[normal.BARE]["ratio"] == 1.0
    moves = rows[normal.OURS]["kappa_moves"]
    assert abs(moves) > 0.01
    for name, rounding in ((normal.BARE, 1e-10), (normal.ELIMINATED, 1e-6)):
        assert rows[name]["kappa_moves"] == pytest.approx(moves, rel=rounding)
    assert normal.START + rows[normal.SEARCHED]["kappa_moves"] == pytest.approx(normal.KAPPA + moves, abs=0.01)
