# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A change of the rail within a window against brute force: every instant's dense Gaussian, and their mixture."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from oracles import Array, Linear
from oracles_kappa import Conditioned, draw, joint

from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.rail_condition.changes import Change, Indices, change
from adhesion_node.core.methods.rail_condition.problem import Belief
from adhesion_node.core.methods.rail_condition.smoother import KappaSearch, smooth

NOMINAL = Linear(c0=0.79, c1=0.02)
"""The process noise of every published figure."""
QUIET = Linear(c0=0.79, c1=0.02, q_s=4e-5, q_v=3e-5)
LOUD = Linear(c0=0.79, c1=0.02, q_s=1e-4, q_v=2e-3)
PRIOR = Belief(
    np.array([100.0, 80.0, 1.1]), np.array([[0.04, 0.005, 0.01], [0.005, 0.01, -0.005], [0.01, -0.005, 0.09]])
)
SURE = Belief(PRIOR.mean, np.diag([0.04, 0.01, 1e-3]))
SEARCH = KappaSearch(start=1.0, lowest=0.0, tolerance=1e-9, iterations=50)
CANDIDATES = np.arange(5, 46, dtype=np.intp)
JUMP_STD = 0.6


def _kappas(first: int, size: float) -> Array:
    return np.where(np.arange(50) < first, 1.1, 1.1 + size)


def _found(
    rail: Conditioned, window: Window, prior: Belief, tail_dof: float = 0.0, candidates: Indices = CANDIDATES
) -> Change:
    problem = rail.problem(window, prior, tail_dof)
    return change(problem, smooth(problem, SEARCH), candidates, JUMP_STD)


@pytest.mark.parametrize("speeds", [0, 4])
@pytest.mark.parametrize("size", [0.0, -0.05, -0.5, 0.3])
def test_odds_and_belief_are_those_of_the_mixture_of_all_instants(size: float, speeds: int) -> None:
    rail = Conditioned(LOUD, 0.05)
    window = draw(rail, _kappas(25, size), np.random.default_rng(2), gaps=(9, 10), speeds=speeds)
    instants = np.array([5, 11, 20, 24, 25, 26, 45], dtype=np.intp)
    found = _found(rail, window, PRIOR, candidates=instants)
    unchanged = joint(rail, PRIOR, window).log_evidence
    tried = [joint(rail, PRIOR, window, int(first), JUMP_STD) for first in instants]
    odds = np.array([each.log_evidence - unchanged for each in tried])
    total = float(np.logaddexp.reduce(odds))
    assert found.log_odds == pytest.approx(total - math.log(odds.size), abs=1e-7)
    assert found.step == instants[np.argmax(odds)]
    likely, means = np.exp(odds - total), np.array([each.end.mean for each in tried])
    mean = likely @ means
    covariance = sum(
        p * (each.end.covariance + np.outer(m - mean, m - mean))
        for p, m, each in zip(likely, means, tried, strict=True)
    )
    assert found.belief.mean == pytest.approx(mean, abs=1e-7)
    assert found.belief.covariance == pytest.approx(covariance, rel=1e-6, abs=1e-10)


@pytest.mark.parametrize("tail_dof", [0.0, 4.0])
@pytest.mark.parametrize("first", [10, 20])
@pytest.mark.parametrize("size", [-0.8, 0.7])
def test_a_big_jump_is_found_where_it_is(size: float, first: int, tail_dof: float) -> None:
    rail = Conditioned(QUIET, 0.05)
    for seed in range(4):
        window = draw(rail, _kappas(first, size), np.random.default_rng(seed), sigma_m=0.05)
        found = _found(rail, window, SURE, tail_dof)
        assert found.log_odds > 10.0
        assert abs(found.step - first) <= 3
        error = abs(found.belief.mean[2] - (1.1 + size))
        assert error < 4.0 * math.sqrt(found.belief.covariance[2, 2])
        assert found.belief.covariance[2, 2] < 0.1**2


def test_without_a_jump_there_are_odds_against_one() -> None:
    """The mean of a Bayes factor is 1 where its alternative never holds; its logarithm's is below 0."""
    rail, prior = Conditioned(NOMINAL, 0.05), Belief(SURE.mean, np.diag([0.04, 0.01, 0.01]))
    odds = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        start = prior.mean + np.sqrt(np.diag(prior.covariance)) * rng.standard_normal(3)
        window = draw(rail, np.full(50, start[2]), rng, start=(start[0], start[1]), sigma_m=0.5)
        odds.append(_found(rail, window, prior).log_odds)
    assert np.mean(odds) < -0.1
    assert 0.6 < np.mean(np.exp(odds)) < 1.5
    assert max(odds) < 4.0  # the configured threshold


def test_outliers_are_no_change() -> None:
    rail = Conditioned(NOMINAL, 0.05)
    window = draw(rail, _kappas(50, 0.0), np.random.default_rng(0), sigma_m=0.5)
    wild = replace(window, position_m=window.position_m + 20.0 * np.isin(np.arange(50), (30, 38, 44)))
    assert _found(rail, wild, SURE, tail_dof=4.0).log_odds < 0.0
    assert _found(rail, wild, SURE, tail_dof=0.0).log_odds > 4.0  # a Gaussian has no other word for it


def test_while_the_brake_limits_only_a_fall_can_be_seen() -> None:
    """0.0952/0.05 = 1.904 is the limit: a rail of 3 that rises or falls to 2 shows nothing, one that falls to 1 does.

    More deceleration than the brake has, for whatever reason, is no rise.
    """
    rail = Conditioned(NOMINAL, 0.05)
    beyond = Belief(np.array([100.0, 80.0, 3.0]), np.diag([0.04, 0.01, 0.04]))
    seen = []
    for after in (4.0, 2.0, 1.0):
        used = np.minimum(np.where(np.arange(50) < 25, 3.0, after), 0.0952 / 0.05)
        seen.append(_found(rail, draw(rail, used, np.random.default_rng(3)), beyond).log_odds)
    assert seen[0] == seen[1] < 1.0
    assert seen[2] > 10.0
    stronger = draw(rail, np.where(np.arange(50) < 25, 1.904, 3.0), np.random.default_rng(3))
    assert _found(rail, stronger, beyond).log_odds < 1.0
