# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The window's extended Kalman filter against the plain Kalman filter, dense algebra and finite differences."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from oracles import Linear, dense_information, make_window, ride, rts

from adhesion_node.core import Config
from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.rail import ignorance
from adhesion_node.core.belief.window import Window, WindowSample, window_of
from adhesion_node.core.methods.particle_em.kalman import Filtered, filtered_by
from adhesion_node.core.methods.particle_em.method import ParticleEm, ParticleWindow
from adhesion_node.core.methods.particle_em.particles import given
from adhesion_node.core.methods.protocol import Context
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import LEVEL
from adhesion_node.core.physics.train import CRH3

PRIOR = Gaussian(np.array([100.0, 80.0]), np.array([[0.09, 0.01], [0.01, 0.04]]))
MODELS = pytest.mark.parametrize("model", [Linear(), Linear(c0=0.79, c1=0.3)], ids=["free", "affine resistance"])


def filter_window(motion: Motion, prior: Gaussian, window: Window, mu: float) -> Filtered:
    return filtered_by(given(motion, prior, window), mu)


def _uneven(window: Window, rng: np.random.Generator) -> Window:
    """The window with steps, brakes and variances of all sizes and a speed at every third measurement."""
    k = window.steps
    speed_variance = np.where(np.arange(k) % 3 == 0, 0.04, math.inf)
    return replace(
        window,
        dt_s=rng.uniform(0.05, 0.4, k),
        brake=rng.choice(np.array([0.03, 0.0952]), k),
        variance_m2=rng.uniform(0.1, 2.0, k),
        speed_mps=80.0 + rng.standard_normal(k),
        speed_variance=speed_variance,
    )


@MODELS
@pytest.mark.parametrize("mu", [0.0, 0.05, 0.2])
def test_filter_is_the_kalman_filter(model: Linear, mu: float) -> None:
    rng = np.random.default_rng(2)
    window = _uneven(make_window(model, PRIOR, 0.07, rng), rng)
    filtered, exact = filter_window(model.motion, PRIOR, window, mu), rts(model, PRIOR, window, mu)
    assert filtered.mean == pytest.approx(exact.filtered_mean[1:], rel=1e-10)
    assert filtered.covariance == pytest.approx(exact.filtered_cov[1:], rel=1e-8)


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
    low, high = (filter_window(model.motion, PRIOR, window, mu + d).mean[-1] for d in (-h, h))
    sensitivity = filter_window(model.motion, PRIOR, window, mu).sensitivity
    assert sensitivity == pytest.approx((high - low) / (2 * h), rel=1e-6)


def test_extended_filter_with_the_published_resistance() -> None:
    """The one curved thing is c2 v^2; the covariance's second-order effect of it is far below the tolerance."""
    motion = Motion(CRH3, LEVEL, Linear().q_s, Linear().q_v)
    rng, h = np.random.default_rng(6), 1e-5
    window = make_window(Linear(c0=13.06), PRIOR, 0.07, rng, steps=50)
    low, high = (filter_window(motion, PRIOR, window, 0.07 + d).mean[-1] for d in (-h, h))
    filtered = filter_window(motion, PRIOR, window, 0.07)
    assert filtered.sensitivity == pytest.approx((high - low) / (2 * h), rel=1e-4)
    # the oracle linearised at 79 m/s: d/dv (c1 3.6 v + c2 12.96 v^2) = 0.02304 + 0.0029808 v -> 0.2585 per mille
    slope = 0.0064 * 3.6 + 2 * 0.000115 * 12.96 * 79.0
    linear = Linear(c0=0.79 + 0.0064 * 3.6 * 79 + 0.000115 * 12.96 * 79**2 - slope * 79, c1=slope / 3.6)
    exact = rts(linear, PRIOR, window, 0.07)
    assert filtered.mean[-1] == pytest.approx(exact.filtered_mean[-1], abs=2e-3)
    assert filtered.covariance[-1] == pytest.approx(exact.filtered_cov[-1], rel=1e-3)
    assert filtered.information == pytest.approx(dense_information(linear, PRIOR, window, 0.07), rel=1e-3)


def test_the_state_of_a_window_includes_what_mu_leaves_open() -> None:
    samples = tuple(WindowSample(m.t_ns, 0.0952, m.position_m, 0.25, 0.0, math.inf) for m in ride([(2.5, 410e3)]))
    config = Config(window=20, step=5, particles=8, iterations=8)
    prior = Gaussian(np.array([0.0, 80.0]), np.diag([0.01, 0.01]))
    context = Context(ignorance(0.05, 0.04), 0.07, True, 0.0, np.random.default_rng(0))
    verdict = ParticleEm().evaluate(config, ParticleWindow(prior, samples), context)
    assert verdict.mu is not None
    arrays, mu = window_of(samples), verdict.mu
    filtered = filter_window(config.motion, prior, arrays, mu)
    moved = filter_window(config.motion, prior, arrays, mu + 1e-4).mean[-1] - filtered.mean[-1]
    open_ = moved / 1e-4 * min(filtered.information**-0.5, config.unknown_std)
    expected = filtered.covariance[-1] + np.outer(open_, open_)
    assert verdict.belief.covariance == pytest.approx(expected, rel=1e-3)
    assert np.all(np.outer(open_, open_) > 0.2 * filtered.covariance[-1])  # it matters
    # 25 samples where S is 20 and L is 5: ten are spent, and the prior is the belief at the eleventh
    following = verdict.window
    assert isinstance(following, ParticleWindow)
    assert following.samples == samples[10:]
    assert np.array_equal(following.prior.covariance, filtered.covariance[9])
    assert np.array_equal(following.prior.mean, filtered.mean[9])
