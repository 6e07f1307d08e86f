# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Gaussian laws and filters against the plain Kalman filter, dense algebra and finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracles import Linear, make_window, rts
from scipy import stats

from adhesion_node.core import Measurement
from adhesion_node.core.belief import tracker
from adhesion_node.core.belief.gaussian import Gaussian, coast, observe

PRIOR = Gaussian(np.array([100.0, 80.0]), np.array([[0.09, 0.01], [0.01, 0.04]]))


def test_coast_by_hand() -> None:
    law = coast(Gaussian(np.array([0.0, 10.0]), np.diag([1.0, 4.0])), 0.5, 0.6)
    # s: 0 + 0.5 x 10; P_ss = 1 + 0.25 x 4 + 0.6 x 0.125/3; P_sv = 0.5 x 4 + 0.6 x 0.25/2; P_vv = 4 + 0.6 x 0.5
    assert law.mean.tolist() == [5.0, 10.0]
    assert law.covariance == pytest.approx(np.array([[2.025, 2.075], [2.075, 4.3]]))


def test_coasting_twice_is_coasting_for_as_long_as_both() -> None:
    twice, once = coast(coast(PRIOR, 0.2, 0.3), 0.7, 0.3), coast(PRIOR, 0.9, 0.3)
    assert twice.mean == pytest.approx(once.mean)
    assert twice.covariance == pytest.approx(once.covariance)


@pytest.mark.parametrize("index", [0, 1])
def test_observe_by_hand(index: int) -> None:
    law = observe(PRIOR, index, float(PRIOR.mean[index]) + 1.0, 0.5)
    gain = PRIOR.covariance[:, index] / (PRIOR.covariance[index, index] + 0.5)
    assert law.mean == pytest.approx(PRIOR.mean + gain)
    expected = PRIOR.covariance - np.outer(gain, PRIOR.covariance[index])
    assert law.covariance == pytest.approx(expected, rel=1e-12)
    # as one line of information: P^-1 + h h'/r
    h = np.eye(2)[index]
    information = np.linalg.inv(PRIOR.covariance) + np.outer(h, h) / 0.5
    assert law.covariance == pytest.approx(np.linalg.inv(information))


def test_observe_stays_positive_with_a_near_perfect_sensor() -> None:
    law = observe(Gaussian(np.zeros(2), np.array([[1e4, 5e3], [5e3, 2.6e3]])), 0, 3.0, 1e-10)
    np.linalg.cholesky(law.covariance)
    assert law.covariance[0, 1] == law.covariance[1, 0]
    assert law.covariance[0, 0] == pytest.approx(1e-10, rel=1e-3)


def test_the_oracle_itself_is_the_dense_gaussian_posterior() -> None:
    """Guard of the guard: the smoothed last state and the likelihood from one joint Gaussian of states and data."""
    model, rng = Linear(c0=0.5, c1=0.2), np.random.default_rng(7)
    window = make_window(model, PRIOR, 0.05, rng, steps=4)
    a, b, q = model.matrix(0.1), model.push(0.1, 0.05), model.noise(0.1)
    means, cov = [PRIOR.mean], np.zeros((10, 10))
    cov[:2, :2] = PRIOR.covariance
    for k in range(1, 5):
        means.append(a @ means[-1] + b)
        now, before = slice(2 * k, 2 * k + 2), slice(0, 2 * k)
        cov[now, before] = a @ cov[2 * k - 2 : 2 * k, before]
        cov[before, now] = cov[now, before].T
        cov[now, now] = a @ cov[2 * k - 2 : 2 * k, 2 * k - 2 : 2 * k] @ a.T + q
    h = np.zeros((4, 10))
    h[range(4), range(2, 10, 2)] = 1.0
    joint = h @ cov @ h.T + np.diag(window.variance_m2)
    gain = cov @ h.T @ np.linalg.inv(joint)
    innovation = window.position_m - h @ np.concatenate(means)
    exact = rts(model, PRIOR, window, 0.05)
    assert exact.mean.ravel() == pytest.approx(np.concatenate(means) + gain @ innovation, rel=1e-9)
    posterior = cov - gain @ h @ cov
    for k in range(5):
        assert exact.cov[k] == pytest.approx(posterior[2 * k : 2 * k + 2, 2 * k : 2 * k + 2], rel=1e-7)
    expected = stats.multivariate_normal(np.zeros(4), joint).logpdf(innovation)
    assert exact.log_likelihood == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize(("sigma_m", "period_s"), [(0.1, 0.1), (0.5, 0.1), (5.0, 0.1), (0.5, 1.0)])
def test_the_tracker_settles_where_its_riccati_equation_does(sigma_m: float, period_s: float) -> None:
    law = tracker.meet(Measurement(0, 0.0, sigma_m**2), 50.0)
    rate = sigma_m**2 * period_s
    assert not tracker.is_settled(law, rate, 1.0, 1.5)
    for k in range(1, 200):
        predicted = coast(law, period_s, 1.0)
        law = tracker.correct(predicted, Measurement(k, float(predicted.mean[0]), sigma_m**2), math.inf)
        if k == 1 and period_s < 1.0:
            assert not tracker.is_settled(law, rate, 1.0, 1.5)  # two positions alone: an unknown speed
    assert tracker.is_settled(law, rate, 1.0, 1.5)
    # continuous limit: sqrt(2) q^(3/4) (r T)^(1/4) with q = 1
    assert law.covariance[1, 1] == pytest.approx(math.sqrt(2.0) * rate**0.25, rel=0.45)
