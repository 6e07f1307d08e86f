# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Gaussian laws and filters against the plain Kalman filter, dense algebra and finite differences."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from oracles import Linear, dense_information, make_window, ride, rts
from scipy import stats

from adhesion_node.core import Config, Measurement
from adhesion_node.core.belief import tracker
from adhesion_node.core.belief.gaussian import Gaussian, coast, filter_window, observe
from adhesion_node.core.belief.window import Sample, Window, window_of
from adhesion_node.core.methods.particle_em.em import Search
from adhesion_node.core.methods.particle_em.method import ParticleWindow, evaluate
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import LEVEL
from adhesion_node.core.physics.train import CRH3

PRIOR = Gaussian(np.array([100.0, 80.0]), np.array([[0.09, 0.01], [0.01, 0.04]]))
MODELS = pytest.mark.parametrize("model", [Linear(), Linear(c0=0.79, c1=0.3)], ids=["free", "affine resistance"])


def _uneven(window: Window, rng: np.random.Generator) -> Window:
    """The window with steps, brakes and variances of all sizes and a speed at every third measurement."""
    k = window.steps
    speed_variance = np.where(np.arange(k) % 3 == 0, 0.04, math.inf)
    return replace(
        window,
        dt_s=rng.uniform(0.05, 0.4, k),
        brake=rng.choice([0.03, 0.0952], k),
        variance_m2=rng.uniform(0.1, 2.0, k),
        speed_mps=80.0 + rng.standard_normal(k),
        speed_variance=speed_variance,
    )


def test_log_density_against_scipy() -> None:
    states = PRIOR.mean + np.random.default_rng(0).standard_normal((3, 4, 2))
    expected = stats.multivariate_normal(PRIOR.mean, PRIOR.covariance).logpdf(states)
    assert PRIOR.log_density(states) == pytest.approx(expected, rel=1e-12)


def test_draws_have_the_law() -> None:
    count = 100_000
    x = PRIOR.draw(count, np.random.default_rng(1))
    assert x.shape == (count, 2)
    errors = (x.mean(axis=0) - PRIOR.mean) / np.sqrt(np.diag(PRIOR.covariance) / count)
    assert np.all(np.abs(errors) < 4)  # standard errors
    assert np.cov(x.T) == pytest.approx(PRIOR.covariance, rel=0.03, abs=1e-3)  # their s.e. is below 0.5 %
    assert (PRIOR.position_std, PRIOR.speed_std) == pytest.approx((0.3, 0.2))


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


@MODELS
@pytest.mark.parametrize("mu", [0.0, 0.05, 0.2])
def test_filter_window_is_the_kalman_filter(model: Linear, mu: float) -> None:
    rng = np.random.default_rng(2)
    window = _uneven(make_window(model, PRIOR, 0.07, rng), rng)
    filtered, exact = filter_window(model.motion, PRIOR, window, mu), rts(model, PRIOR, window, mu)
    for k, law in enumerate(filtered.laws):
        assert law.mean == pytest.approx(exact.filtered_mean[k + 1], rel=1e-10)
        assert law.covariance == pytest.approx(exact.filtered_cov[k + 1], rel=1e-8)
    assert len(filtered.laws) == window.steps


@MODELS
@pytest.mark.parametrize("mu", [0.05, 0.09, 0.2])
def test_information_is_the_dense_formula(model: Linear, mu: float) -> None:
    rng = np.random.default_rng(3)
    window = _uneven(make_window(model, PRIOR, 0.07, rng), rng)
    window = replace(window, speed_variance=np.full(window.steps, math.inf))
    information = filter_window(model.motion, PRIOR, window, mu).information
    assert information == pytest.approx(dense_information(model, PRIOR, window, mu), rel=1e-9)
    if mu == 0.2:
        assert information == 0.0  # above every brake: nothing is seen


def test_information_is_the_curvature_of_the_log_likelihood() -> None:
    model, rng, h = Linear(c0=0.79), np.random.default_rng(4), 1e-3
    window = replace(_uneven(make_window(model, PRIOR, 0.07, rng), rng), brake=np.full(20, 0.0952))  # speeds too
    below, here, above = (rts(model, PRIOR, window, 0.05 + d).log_likelihood for d in (-h, 0.0, h))
    curvature = (below - 2 * here + above) / h**2
    assert filter_window(model.motion, PRIOR, window, 0.05).information == pytest.approx(-curvature, rel=1e-5)


@MODELS
@pytest.mark.parametrize("mu", [0.02, 0.06])  # below both brakes, between them
def test_sensitivity_by_finite_differences(model: Linear, mu: float) -> None:
    rng, h = np.random.default_rng(5), 1e-5
    window = _uneven(make_window(model, PRIOR, 0.07, rng), rng)
    low, high = (filter_window(model.motion, PRIOR, window, mu + d).laws[-1].mean for d in (-h, h))
    sensitivity = filter_window(model.motion, PRIOR, window, mu).sensitivity
    assert sensitivity == pytest.approx((high - low) / (2 * h), rel=1e-6)


def test_extended_filter_with_the_published_resistance() -> None:
    """The one curved thing is c2 v^2; the covariance's second-order effect of it is far below the tolerance."""
    motion = Motion(CRH3, LEVEL, Linear().q_s, Linear().q_v)
    rng, h = np.random.default_rng(6), 1e-5
    window = make_window(Linear(c0=13.06), PRIOR, 0.07, rng, steps=50)
    low, high = (filter_window(motion, PRIOR, window, 0.07 + d).laws[-1].mean for d in (-h, h))
    filtered = filter_window(motion, PRIOR, window, 0.07)
    assert filtered.sensitivity == pytest.approx((high - low) / (2 * h), rel=1e-4)
    # the oracle linearised at 79 m/s: d/dv (c1 3.6 v + c2 12.96 v^2) = 0.02304 + 0.0029808 v -> 0.2585 per mille
    slope = 0.0064 * 3.6 + 2 * 0.000115 * 12.96 * 79.0
    linear = Linear(c0=0.79 + 0.0064 * 3.6 * 79 + 0.000115 * 12.96 * 79**2 - slope * 79, c1=slope / 3.6)
    exact = rts(linear, PRIOR, window, 0.07)
    assert filtered.laws[-1].mean == pytest.approx(exact.filtered_mean[-1], abs=2e-3)
    assert filtered.laws[-1].covariance == pytest.approx(exact.filtered_cov[-1], rel=1e-3)
    assert filtered.information == pytest.approx(dense_information(linear, PRIOR, window, 0.07), rel=1e-3)


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
    law = tracker.meet(Measurement(0, 0.0, sigma_m**2))
    rate = sigma_m**2 * period_s
    assert not tracker.is_settled(law, rate)
    for k in range(1, 200):
        predicted = tracker.predict(law, period_s, True, 0.009)
        law = tracker.correct(predicted, Measurement(k, float(predicted.mean[0]), sigma_m**2), math.inf)
        if k == 1 and period_s < 1.0:
            assert not tracker.is_settled(law, rate)  # two positions alone: an unknown speed
    assert tracker.is_settled(law, rate)
    # continuous limit: sqrt(2) q^(3/4) (r T)^(1/4) with q = 1
    assert law.covariance[1, 1] == pytest.approx(math.sqrt(2.0) * rate**0.25, rel=0.45)


def test_the_state_of_a_window_includes_what_mu_leaves_open() -> None:
    samples = [Sample(m.t_ns, 0.0952, m.position_m, 0.25, 0.0, math.inf) for m in ride([(2.5, 410e3)])]
    config = Config(window=20, step=5, particles=8, iterations=8)
    prior = Gaussian(np.array([0.0, 80.0]), np.diag([0.01, 0.01]))
    evaluation = evaluate(config, ParticleWindow(prior, tuple(samples)), Search(0.07, 8, 0.0), np.random.default_rng(0))
    arrays, mu = window_of(samples), evaluation.identified.mu
    filtered = filter_window(config.motion, prior, arrays, mu)
    moved = filter_window(config.motion, prior, arrays, mu + 1e-4).laws[-1].mean - filtered.laws[-1].mean
    open_ = moved / 1e-4 * min(evaluation.std, config.unknown_std)
    expected = filtered.laws[-1].covariance + np.outer(open_, open_)
    assert evaluation.belief.covariance == pytest.approx(expected, rel=1e-3)
    assert np.all(np.outer(open_, open_) > 0.2 * filtered.laws[-1].covariance)  # it matters
    # 25 samples where S is 20 and L is 5: ten are spent, and the prior is the law at the eleventh
    assert evaluation.following.samples == tuple(samples[10:])
    assert np.array_equal(evaluation.following.prior.covariance, filtered.laws[9].covariance)
    assert np.array_equal(evaluation.following.prior.mean, filtered.laws[9].mean)
