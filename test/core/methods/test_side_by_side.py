# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Runs side by side: a window's numbers are those that it has alone, whatever stands beside it."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from oracles import Linear, make_window

from adhesion_node.core.belief.gaussian import Gaussian
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.particle_em import smoother
from adhesion_node.core.methods.particle_em.em import Expectation, Identified, ParticleEStep, Search, identify, maximise
from adhesion_node.core.methods.particle_em.kalman import filter_windows
from adhesion_node.core.methods.particle_em.particles import ParticleFilter
from adhesion_node.core.methods.particle_em.smoother import MarginalSmoother
from adhesion_node.core.methods.particle_em.windows import Windows, stack
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import Grade, Track
from adhesion_node.core.physics.train import Train

PRIOR = Gaussian(np.array([1000.0, 75.0]), np.array([[0.04, 0.02], [0.02, 0.05]]))
SLOPED = Motion(Train(rotating_mass_fraction=0.08), Track((Grade(1010.0, 1400.0, 3.0),)), 0.004, 3e-4)


class Case(NamedTuple):
    prior: Gaussian
    window: Window
    search: Search
    seed: int


def _cases(*, steps: int = 20, iterations: int = 6, tolerance: float = 1e-7, with_speed: bool = False) -> list[Case]:
    """Windows of other trains, brakes, starts and sensors; run 3 has no speed, run 4 may be pushed forward."""
    cases = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        prior = PRIOR._replace(mean=PRIOR.mean + rng.standard_normal(2))
        window = make_window(Linear(c0=3.0), prior, 0.06 + 0.01 * seed, rng, steps=steps)
        window = replace(window, brake=np.linspace(0.07, 0.1, steps) if seed % 2 else window.brake)
        if with_speed and seed != 3:
            window = replace(window, speed_mps=np.full(steps, 74.0), speed_variance=np.full(steps, 0.5))
        cases.append(Case(prior, window, Search(0.02 * seed, iterations, tolerance, -0.05 * (seed == 4)), seed))
    return cases


def _stacked(cases: list[Case]) -> Windows:
    return stack([case.prior for case in cases], [case.window for case in cases])


def _identify(motion: Motion, cases: list[Case]) -> list[Identified]:
    rngs = [np.random.default_rng(case.seed) for case in cases]
    return identify(partial(ParticleEStep, motion, 20), _stacked(cases), [case.search for case in cases], rngs)


@pytest.mark.parametrize("motion", [Linear(c0=3.0).motion, SLOPED])
@pytest.mark.parametrize("with_speed", [False, True])
def test_em_of_a_window_is_the_same_in_company(motion: Motion, with_speed: bool) -> None:
    cases = _cases(with_speed=with_speed)
    together, alone = _identify(motion, cases), [_identify(motion, [case])[0] for case in cases]
    for ours, expected in zip(together, alone, strict=True):
        assert (ours.iterations, ours.converged) == (expected.iterations, expected.converged)
        np.testing.assert_allclose(ours, expected, rtol=1e-11, atol=1e-12)


def test_runs_end_when_they_converge() -> None:
    cases = _cases(iterations=40, tolerance=2e-3)
    together, alone = _identify(SLOPED, cases), [_identify(SLOPED, [case])[0] for case in cases]
    assert [one.iterations for one in together] == [one.iterations for one in alone]
    assert len({one.iterations for one in together}) > 1
    np.testing.assert_allclose([one.mu for one in together], [one.mu for one in alone], rtol=1e-11)


def test_many_particles_have_their_kernels_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a few steps fill the cache, the weights are those of kernels formed one at a time."""
    windows = _stacked(_cases())
    rngs = [np.random.default_rng(seed) for seed in range(6)]
    particles = ParticleFilter(SLOPED, windows, 30).run(np.full(6, 0.07), rngs)
    some = MarginalSmoother(SLOPED, windows.dt_s, 30)
    monkeypatch.setattr(smoother, "CACHED", 1)
    one = MarginalSmoother(SLOPED, windows.dt_s, 30)
    assert [len(block.steps) for block in some.blocks] == [11, 9]
    assert [len(block.steps) for block in one.blocks] == [1] * 20
    np.testing.assert_allclose(some.run(particles), one.run(particles), rtol=1e-12)


def test_a_window_that_no_particle_explains_is_still_a_law() -> None:
    """Its weights degenerate, its ESS falls to one particle, and its neighbour knows nothing of it."""
    case = _cases()[0]
    far = case._replace(prior=PRIOR._replace(mean=PRIOR.mean - 60.0))
    motion, mu = Linear().motion, np.array([0.05, 0.05])
    rngs = [np.random.default_rng(1), np.random.default_rng(2)]
    found = ParticleEStep(motion, 20, _stacked([far, case]), rngs)(mu)
    for run, each in enumerate((far, case)):
        alone = ParticleEStep(motion, 20, _stacked([each]), [np.random.default_rng(run + 1)])(mu[:1])
        for ours, expected in zip(found, alone, strict=True):
            np.testing.assert_allclose(ours[run], expected[0], rtol=1e-9, atol=1e-9)
    assert np.all(np.isfinite(found.used))
    assert 1.0 <= found.ess[0] < 1.1 < found.ess[1] <= 20.0


def test_m_step_of_a_run_is_the_same_in_company() -> None:
    rng = np.random.default_rng(5)
    used, weight = rng.normal(0.08, 0.05, (50, 12)), rng.uniform(1.0, 9.0, (50, 12))
    limit = np.where(rng.random((50, 1)) < 0.3, 0.09, rng.uniform(0.05, 0.12, (50, 12)))
    expected, lowest = (
        Expectation(used, weight, limit, np.zeros(50), np.zeros(50)),
        np.where(np.arange(50) % 2, 0, -0.05),
    )
    alone = [
        maximise(Expectation(*(part[run : run + 1] for part in expected)), lowest[run : run + 1])[0]
        for run in range(50)
    ]
    assert np.array_equal(maximise(expected, lowest), alone)


@pytest.mark.parametrize("with_speed", [False, True])
def test_filter_of_a_window_is_the_same_in_company(with_speed: bool) -> None:
    cases, mu = _cases(with_speed=with_speed), np.linspace(0.05, 0.12, 6)
    together = filter_windows(SLOPED, _stacked(cases), mu)
    for run, case in enumerate(cases):
        alone = filter_windows(SLOPED, _stacked([case]), mu[run : run + 1]).of(0)
        for ours, expected in zip(together.of(run), alone, strict=True):
            np.testing.assert_allclose(ours, expected, rtol=1e-11, atol=1e-12)


def test_windows_that_share_a_generator_share_its_numbers() -> None:
    case = _cases()[0]
    shared, other = np.random.default_rng(7), np.random.default_rng(8)
    e_step = ParticleEStep(SLOPED, 5, _stacked([case] * 3), [shared, other, shared])
    alone = ParticleEStep(SLOPED, 5, _stacked([case]), [np.random.default_rng(7)])
    for mu in (0.05, 0.06):  # and go on together
        used, expected = e_step(np.full(3, mu)).used, alone(np.array([mu])).used[0]
        assert np.array_equal(used[0], used[2])
        assert not np.array_equal(used[0], used[1])
        np.testing.assert_allclose(used[0], expected, rtol=1e-11)


def test_windows_of_other_lengths_are_refused() -> None:
    short, long = _cases(steps=4)[0], _cases(steps=5)[0]
    with pytest.raises(ValueError, match=r"windows of \[4, 5\] steps: stack those of equal length"):
        _stacked([short, long])
