# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The studies' batched estimator gives the core's numbers, whatever runs share a batch."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from oracles import Linear, drive, make_window, ride

from adhesion_node.core import Config, Estimate
from adhesion_node.core.belief.gaussian import Gaussian, filter_window
from adhesion_node.core.belief.window import Window
from adhesion_node.core.methods.particle_em.em import Expectation, ParticleSmoother, Search, identify, maximise
from adhesion_node.core.physics.motion import Motion
from adhesion_node.core.physics.track import Grade, Track
from adhesion_node.core.physics.train import Train
from adhesion_node.study.xie import batch, lockstep
from adhesion_node.study.xie.batch_filter import filter_windows
from adhesion_node.study.xie.batch_particles import Draws, draw, stack
from adhesion_node.study.xie.batch_smoother import Expectations, Room, expectations

PRIOR = Gaussian(np.array([1000.0, 75.0]), np.array([[0.04, 0.02], [0.02, 0.05]]))
SLOPED = Motion(Train(rotating_mass_fraction=0.08), Track((Grade(1010.0, 1400.0, 3.0),)), 0.004, 3e-4)


class Case(NamedTuple):
    motion: Motion
    prior: Gaussian
    window: Window
    search: Search
    seed: int


def _cases(motion: Motion, *, steps: int = 20, iterations: int = 6, with_speed: bool = False) -> list[Case]:
    cases = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        prior = PRIOR._replace(mean=PRIOR.mean + rng.standard_normal(2))
        window = make_window(Linear(c0=3.0), prior, 0.06 + 0.01 * seed, rng, steps=steps)
        window = replace(window, brake=np.linspace(0.07, 0.1, steps) if seed % 2 else window.brake)
        if with_speed and seed != 3:
            window = replace(window, speed_mps=np.full(steps, 74.0), speed_variance=np.full(steps, 0.5))
        cases.append(Case(motion, prior, window, Search(0.02 * seed, iterations, 1e-7, -0.05 * (seed == 4)), seed))
    return cases


@pytest.mark.parametrize("motion", [Linear(c0=3.0).motion, SLOPED])
@pytest.mark.parametrize("with_speed", [False, True])
def test_em_of_many_runs_is_the_cores(motion: Motion, with_speed: bool) -> None:
    cases = _cases(motion, with_speed=with_speed)
    expected = [
        identify(ParticleSmoother(20), c.motion, c.prior, c.window, c.search, np.random.default_rng(c.seed))
        for c in cases
    ]
    found = batch.identify(
        motion,
        stack([c.prior for c in cases], [c.window for c in cases]),
        [c.search for c in cases],
        20,
        [np.random.default_rng(c.seed) for c in cases],
    )
    for ours, core in zip(found, expected, strict=True):
        assert (ours.iterations, ours.converged) == (core.iterations, core.converged)
        np.testing.assert_allclose(
            [ours.mu, ours.weight, ours.limit, ours.ess, ours.log_likelihood],
            [core.mu, core.weight, core.limit, core.ess, core.log_likelihood],
            rtol=1e-11,
            atol=1e-12,
        )


def test_runs_end_when_they_converge() -> None:
    cases = [c._replace(search=c.search._replace(iterations=40, tolerance=2e-3)) for c in _cases(SLOPED)]
    stacked = stack([c.prior for c in cases], [c.window for c in cases])
    rngs = [np.random.default_rng(c.seed) for c in cases]
    found = batch.identify(SLOPED, stacked, [c.search for c in cases], 20, rngs)
    expected = [
        identify(ParticleSmoother(20), c.motion, c.prior, c.window, c.search, np.random.default_rng(c.seed))
        for c in cases
    ]
    assert [f.iterations for f in found] == [e.iterations for e in expected]
    assert len({f.iterations for f in found}) > 1


def test_a_window_that_no_particle_explains_is_still_a_law() -> None:
    far = PRIOR._replace(mean=PRIOR.mean - 60.0)
    case = _cases(Linear().motion)[0]
    stacked = stack([far, case.prior], [case.window, case.window])
    rngs = [np.random.default_rng(1), np.random.default_rng(1)]
    room = Room.of(2, case.window.steps, 20)
    draw(rngs, room.draws)
    found = expectations(Linear().motion, stacked, np.array([0.05, 0.05]), room)
    core = ParticleSmoother(20)(Linear().motion, far, case.window, 0.05, np.random.default_rng(1))
    np.testing.assert_allclose(found.used[0], core.used, rtol=1e-9, atol=1e-9)
    assert np.all(np.isfinite(found.used))


def test_m_step_is_the_cores_for_any_limits() -> None:
    rng = np.random.default_rng(5)
    used, weight = rng.normal(0.08, 0.05, (50, 12)), rng.uniform(1.0, 9.0, (50, 12))
    limit = np.where(rng.random((50, 1)) < 0.3, 0.09, rng.uniform(0.05, 0.12, (50, 12)))
    lowest = np.where(rng.random(50) < 0.5, 0.0, -0.05)
    found = batch.maximise(Expectations(used, weight, limit, np.zeros(50), np.zeros(50)), lowest)
    expected = [
        maximise(Expectation(u, c, top, 0.0, 0.0), float(low))
        for u, c, top, low in zip(used, weight, limit, lowest, strict=True)
    ]
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("with_speed", [False, True])
def test_filter_of_many_windows_is_the_cores(with_speed: bool) -> None:
    cases = _cases(SLOPED, with_speed=with_speed)
    mu = np.linspace(0.05, 0.12, len(cases))
    stacked = stack([c.prior for c in cases], [c.window for c in cases])
    found = filter_windows(SLOPED, stacked, np.stack([c.prior.covariance for c in cases]), mu, 7)
    for run, case in enumerate(cases):
        core = filter_window(SLOPED, case.prior, case.window, float(mu[run]))
        for ours, theirs in (
            (found.mean[run], core.laws[-1].mean),
            (found.covariance[run], core.laws[-1].covariance),
            (found.passed_mean[run], core.laws[6].mean),
            (found.passed_covariance[run], core.laws[6].covariance),
            (found.sensitivity[run], core.sensitivity),
        ):
            np.testing.assert_allclose(ours, theirs, rtol=1e-11, atol=1e-12)
        assert found.information[run] == pytest.approx(core.information, rel=1e-11)


def _numbers(estimates: list[Estimate]) -> list[tuple[float, ...]]:
    return [(e.t_ns, e.mu, e.mu_std, e.mu_lower, e.position_m, e.speed_mps, e.window, e.iterations) for e in estimates]


def test_lockstep_is_the_core_through_start_release_gap_and_end() -> None:
    """Runs of different length and phase; one has no pressure, one waits for late measurements, one is disturbed."""
    config = Config(method="particle_em", iterations=5, window=20, step=6)
    braking = ride([(4.0, 0.0), (8.0, 410e3), (2.0, 0.0), (5.0, 300e3)], seed=1)
    streams = [
        braking,
        ride([(3.0, 0.0), (9.3, 410e3)], seed=2),
        [m._replace(brake_pressure_pa=None) for m in ride([(6.0, 410e3)], seed=3)],
        braking[:70] + braking[100:] + [braking[5]],
        [m._replace(position_m=m.position_m + 50.0 * (i % 9 == 4)) for i, m in enumerate(braking)],
    ]
    runs = [
        lockstep.Run(replace(config, start_mu=0.03 * i), seed=i % 2, measurements=stream)
        for i, stream in enumerate(streams)
    ]
    window_ms: list[float] = []
    together = lockstep.drive(runs, window_ms)
    for run, estimates in zip(runs, together, strict=True):
        _, alone = drive(run.config, run.measurements, run.seed)
        assert [e.regime for e in estimates] == [e.regime for e in alone]
        np.testing.assert_allclose(_numbers(estimates), _numbers(alone), rtol=1e-9, atol=1e-10)
    assert window_ms
    assert all(math.isfinite(ms) and ms > 0 for ms in window_ms)


def test_a_run_does_not_depend_on_its_company() -> None:
    config = Config(method="particle_em", iterations=5, window=20, step=6)
    runs = [lockstep.Run(config, seed, ride([(2.0, 0.0), (5.0, 410e3)], seed=seed)) for seed in (1, 2, 3)]
    assert lockstep.drive(runs)[1] == lockstep.drive(runs[1:2])[0]


def test_windows_that_share_a_generator_share_its_numbers() -> None:
    shared, other = np.random.default_rng(7), np.random.default_rng(8)
    draws, alone = Draws.empty(3, 4, 3), Draws.empty(1, 4, 3)
    draw([shared, other, shared], draws)
    draw([np.random.default_rng(8)], alone)
    assert np.array_equal(draws.normal[0], draws.normal[2])
    assert not np.array_equal(draws.normal[0], draws.normal[1])
    assert np.array_equal(draws.normal[1], alone.normal[0])
