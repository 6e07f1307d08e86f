# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The Gaussian smoother of a window where it is linear: textbook recursions, plain EM, brute force."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from loud_rail import RAIL, SEARCH, SEEN, STATE
from oracles import Array
from oracles_kappa import Conditioned, draw, em_kappa, joint, smoothed

from adhesion_node.core import Config
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.rail_condition.branch import log_likelihood, smoothed_branch
from adhesion_node.core.methods.rail_condition.hypotheses import Hypothesis
from adhesion_node.core.methods.rail_condition.problem import Belief
from adhesion_node.core.methods.rail_condition.smoother import posterior, smooth
from adhesion_node.core.physics.adhesion import SpeedLaw

PRIOR = Belief(
    np.array([100.0, 80.0, 1.2]), np.array([[0.04, 0.005, 0.01], [0.005, 0.01, -0.005], [0.01, -0.005, 0.09]])
)
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


def test_refuses_a_prior_that_is_not_positive_definite() -> None:
    rail, window = _window(0)
    covariance = PRIOR.covariance.copy()
    covariance[2, 2] = -0.09
    with pytest.raises(np.linalg.LinAlgError, match=r"(?s)the prior's covariance .* is not positive definite"):
        smooth(rail.problem(window, PRIOR._replace(covariance=covariance)), SEARCH)
