# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The compiled loops of the particle EM: against NumPy, to rounding."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy_particles as by_numpy
import pytest
from oracles import Linear, make_window

from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.kernels import expecting, filtering, maximising, smoothing
from adhesion_node.core.methods.particle_em.em import ParticleEStep, maximise
from adhesion_node.core.methods.particle_em.particles import ParticleFilter
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import Grade, Track
from adhesion_node.core.physics.train import Train

PRIOR = Gaussian(np.array([1000.0, 75.0]), np.array([[0.04, 0.02], [0.02, 0.05]]))
LEVEL = Linear(c0=3.0).motion
SLOPED = Motion(Train(rotating_mass_fraction=0.08), Track((Grade(1010.0, 1400.0, 3.0),)), 0.004, 3e-4)


def _window(steps: int = 40, outlier_m: float = 0.0) -> Window:
    """With a brake that builds up, uneven steps and some measured speeds."""
    window = make_window(Linear(c0=3.0), PRIOR, 0.07, np.random.default_rng(1), steps=steps)
    return replace(
        window,
        brake=np.linspace(0.05, 0.1, steps),
        dt_s=np.linspace(0.1, 0.14, steps),
        position_m=window.position_m + outlier_m * (np.arange(steps) == 20),
        speed_mps=np.full(steps, 74.0),
        speed_variance=np.where(np.arange(steps) % 4 == 0, 0.5, math.inf),
    )


@pytest.mark.parametrize("outlier_m", [0.0, 40.0])
@pytest.mark.parametrize("count", [2, 20, 63, 64, 150])
@pytest.mark.parametrize("motion", [LEVEL, SLOPED], ids=["level", "profile and rotating mass"])
def test_a_pass_of_filter_and_smoother(motion: Motion, count: int, outlier_m: float) -> None:
    """Also of so many particles that those far away are left out, and of a position that none of them explains.

    The filter to rounding; the smoother, which reckons in single precision, to 1e-4 of a weight.
    """
    window, rng = _window(outlier_m=outlier_m), np.random.default_rng(3)
    ours = ParticleFilter(motion, PRIOR, window, count)
    found, draws = ours.run(0.07, rng), ours.draws
    theirs = by_numpy.filtered(motion, PRIOR, window, 0.07, draws)
    for one, other in zip(found.particles, theirs.particles, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-9)
    assert found.log_likelihood - ours.log_constant == pytest.approx(theirs.log_likelihood, rel=1e-10)
    assert found.smallest_ess == pytest.approx(theirs.smallest_ess, rel=1e-8)
    exact = by_numpy.smoothed(motion, window, found.particles)
    marginal = smoothing.smoothed(found.particles, ours.given.spread)
    np.testing.assert_allclose(marginal, exact, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(marginal.sum(axis=1), 1.0, rtol=1e-11)
    expected = by_numpy.reduced(motion, window, 0.07, found.particles, exact)
    np.testing.assert_allclose(expecting.reduced(ours.given, 0.07, found.particles, exact), expected, rtol=1e-10)
    np.testing.assert_allclose(expecting.reduced(ours.given, 0.07, found.particles, marginal), expected, rtol=1e-6)


def test_what_single_precision_costs_is_far_below_what_the_particles_leave_open() -> None:
    window, rng = _window(), np.random.default_rng(3)
    e_step, found, off = ParticleEStep(LEVEL, 20, PRIOR, window, rng), [], []
    for _ in range(40):
        found.append(maximise(e_step(0.07), 0.0))
        particles = e_step.filter.particles
        exact = expecting.reduced(e_step.filter.given, 0.07, particles, by_numpy.smoothed(LEVEL, window, particles))
        off.append(abs(found[-1] - maximising.maximised(exact, 0.0)[0]))
    assert max(off) < 1e-5 * np.std(found)


def test_resampling() -> None:
    rng = np.random.default_rng(2)
    for count in (2, 7, 100):
        weights, offset = rng.exponential(size=count) * (rng.random(count) < 0.7) + 1e-12, float(rng.random())
        np.testing.assert_array_equal(filtering.systematic(weights, offset), by_numpy.systematic(weights, offset))


def test_the_exponentials() -> None:
    given = np.append(0.0, np.random.default_rng(0).uniform(-300.0, 1.0, 1000))
    np.testing.assert_allclose([filtering._exp(x) for x in given], np.exp(given), rtol=1e-13)
    singles = (given * 0.25).astype(np.float32)
    found = [smoothing._power(x) for x in singles]
    np.testing.assert_allclose(found, np.exp2(singles.astype(np.float64)), rtol=3e-7)


def test_the_noise_of_four_passes_is_mirrored() -> None:
    """Four passes of a window, and then four others: each noise is as drawn, and their sum nothing."""
    passes, rng = ParticleFilter(LEVEL, PRIOR, _window(), 30), np.random.default_rng(5)
    draws = []
    for _ in range(8):
        passes.run(0.07, rng)
        draws.append(np.concatenate((passes.draws.normal.reshape(2, -1), passes.draws.start.T), axis=1))
    np.testing.assert_array_equal(np.abs(draws[:4]), np.abs(draws[:1] * 4))
    np.testing.assert_array_equal(np.sum(draws[:4], axis=0), 0.0)
    assert len({one.tobytes() for one in draws}) == 8
    np.testing.assert_allclose(np.std(draws[4], axis=1), 1.0, atol=0.05)


def test_a_generator_gives_the_same_numbers_to_every_pass_of_its_own() -> None:
    one, two = (ParticleEStep(SLOPED, 5, PRIOR, _window(), np.random.default_rng(7)) for _ in range(2))
    for mu in (0.05, 0.06):
        np.testing.assert_array_equal(one(mu).statistics, two(mu).statistics)
    assert not np.array_equal(one(0.06).statistics, one(0.06).statistics)


@pytest.mark.parametrize("turned", [-1.2, -0.3, 0.0, 0.5, 1.5])
def test_particles_are_ordered_along_the_direction_in_which_they_lie_farthest_apart(turned: float) -> None:
    drawn = np.random.default_rng(2).standard_normal((5000, 2)) * [3.0, 1.0]
    cosine, sine = smoothing._direction(
        *(drawn @ [[math.cos(turned), math.sin(turned)], [-math.sin(turned), math.cos(turned)]]).T
    )
    assert abs(cosine * math.cos(turned) + sine * math.sin(turned)) == pytest.approx(1.0, abs=1e-3)


def test_a_particle_that_none_explains_well_goes_to_its_likeliest_ancestors() -> None:
    """In shares of the weight times the Gaussian density, here of ancestors 30 standard deviations away."""
    rng = np.random.default_rng(6)
    places, logs, after = rng.standard_normal((2, 6)), np.log(rng.dirichlet(np.ones(6))), np.array([30.0, -2.0])
    now = np.full(6, 0.01)
    smoothing._alone(places, logs, after, 0.3, now)
    densities = np.exp(logs - 0.5 * ((places - after[:, None]) ** 2).sum(axis=0))
    assert now == pytest.approx(0.01 + 0.3 * densities / densities.sum(), rel=1e-9)
