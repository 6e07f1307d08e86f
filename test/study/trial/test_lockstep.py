# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Estimators in lockstep give what each gives alone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from oracles import drive, ride

from adhesion_node.core import Config, Estimate
from adhesion_node.study.trial import lockstep

CONFIG = Config(method="particle_em", iterations=5, window=20, step=6)


def _numbers(estimates: list[Estimate]) -> list[tuple[float, ...]]:
    return [(e.t_ns, e.mu, e.mu_std, e.mu_lower, e.position_m, e.speed_mps, e.window, e.iterations) for e in estimates]


def test_lockstep_is_the_core_through_start_release_gap_and_end() -> None:
    """Runs of different length and phase; one has no pressure, one waits for late measurements, one is disturbed."""
    braking = ride([(4.0, 0.0), (8.0, 410e3), (2.0, 0.0), (5.0, 300e3)], seed=1)
    streams = [
        braking,
        ride([(3.0, 0.0), (9.3, 410e3)], seed=2),
        [m._replace(brake_pressure_pa=None) for m in ride([(6.0, 410e3)], seed=3)],
        braking[:70] + braking[100:] + [braking[5]],
        [m._replace(position_m=m.position_m + 50.0 * (i % 9 == 4)) for i, m in enumerate(braking)],
    ]
    runs = [
        lockstep.Run(replace(CONFIG, start_mu=0.03 * i), seed=i % 2, measurements=stream)
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
    runs = [lockstep.Run(CONFIG, seed, ride([(2.0, 0.0), (5.0, 410e3)], seed=seed)) for seed in (1, 2, 3)]
    assert lockstep.drive(runs)[1] == lockstep.drive(runs[1:2])[0]


def test_several_windows_that_fall_due_at_one_measurement_are_all_evaluated() -> None:
    """One that waits for late measurements lets all go at once after a gap."""
    config = replace(CONFIG, max_lag_s=2.0)
    stream = ride([(2.0, 0.0), (6.0, 410e3)], seed=4)
    stream = [*stream[:60], *(m._replace(t_ns=m.t_ns + 3 * 10**9) for m in stream[60:])]
    (together,) = lockstep.drive([lockstep.Run(config, 1, stream)])
    _, alone = drive(config, stream, 1)
    np.testing.assert_allclose(_numbers(together), _numbers(alone), rtol=1e-9, atol=1e-10)
