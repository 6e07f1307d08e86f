# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The creep identification sample by sample: estimates, what is withheld and why, what becomes of bad samples."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adhesion_node.core.creep.config import FIXED, CreepConfig, CreepOutcome, Peak
from adhesion_node.core.creep.curve import adhesion, parameters, peak
from adhesion_node.core.creep.estimator import CreepEstimate, CreepSample, CreepState, creep_step, init
from adhesion_node.core.creep.recursion import advance, begin, full_covariance
from adhesion_node.core.physics.train import Array

DRY, WET = parameters(20.0, 0.35, 0.1), parameters(20.0, 0.20, 0.1)
NOMINAL = CreepConfig()


def samples(theta: Array, top: float, count: int, seed: int = 1, start_ns: int = 0) -> Iterator[CreepSample]:
    """Measured samples of one rise of the creep, 10 ms apart; the noise in mu has a standard deviation of 0.01."""
    rng = np.random.default_rng(seed)
    for index in range(1, count + 1):
        creep = top * index / count
        mu = float(adhesion(np.array(creep), 20.0, theta)) + 0.01 * float(rng.standard_normal())
        yield CreepSample(start_ns + index * 10_000_000, creep, mu, 0.0, 1e-4)


def feed(config: CreepConfig, state: CreepState, data: Iterator[CreepSample]) -> tuple[CreepState, list[CreepEstimate]]:
    estimates = []
    for sample in data:
        state, estimate = creep_step(config, state, sample)
        estimates += [] if estimate is None else [estimate]
    return state, estimates


def test_the_peak_is_found_with_its_spread() -> None:
    state, estimates = feed(NOMINAL, init(NOMINAL), samples(DRY, 0.1, 1000))
    last = estimates[-1]
    assert len(estimates) == 99  # of the 1000 samples the 9 below min_creep are idle
    assert last.status is Peak.KNOWN
    assert last.known
    assert [last.mu_max, last.lambda_m] == pytest.approx([0.35, 0.1], rel=0.02)
    assert [last.p1, last.p2] == pytest.approx(DRY, rel=0.05)
    assert last.mu_max_lower == pytest.approx(last.mu_max - 1.6449 * last.mu_max_std, rel=1e-4)
    assert last.mu_max_upper == pytest.approx(last.mu_max + 1.6449 * last.mu_max_std, rel=1e-4)
    assert (last.samples, state.counts[CreepOutcome.ACCEPTED], state.counts[CreepOutcome.IDLE]) == (990, 991, 9)
    assert 0.971 <= last.eta <= 1.0


def test_a_peak_is_withheld_until_the_data_tell_it() -> None:
    _, estimates = feed(NOMINAL, init(NOMINAL), samples(DRY, 0.1, 1000))
    statuses = [estimate.status for estimate in estimates]
    assert statuses[0] is Peak.FEW
    first = statuses.index(Peak.KNOWN)
    assert {Peak.UNSURE, Peak.NO_PEAK} & set(statuses[:first])
    assert all(status is Peak.KNOWN for status in statuses[first + 10 :])
    assert 250 < estimates[first].samples < 500  # creeps of 0.025 to 0.05


def test_published_peaks_are_rarely_wrong_where_most_are() -> None:
    """Up to a creep of 0.02 with noise of 0.01 most peaks are off by 10 %; hardly a run publishes such a one."""
    wrong = published_wrong = 0
    for seed in range(40):
        _, estimates = feed(NOMINAL, init(NOMINAL), samples(DRY, 0.02, 200, seed))
        off = abs(estimates[-1].mu_max - 0.35) > 0.035
        wrong += off
        published_wrong += off and estimates[-1].known
    assert wrong > 20
    assert published_wrong <= 1


def test_the_iteration_gives_the_same_estimates() -> None:
    exact = feed(NOMINAL, init(NOMINAL), samples(DRY, 0.1, 500))[1]
    config = replace(NOMINAL, solver="dfp")
    iterated = feed(config, init(config), samples(DRY, 0.1, 500))[1]
    for one, other in zip(exact[10:], iterated[10:], strict=True):
        assert (one.p1, one.p2, one.mu_max) == pytest.approx((other.p1, other.p2, other.mu_max), rel=1e-6, abs=1e-9)


def test_many_runs_at_once_are_those_one_by_one() -> None:
    data = [list(samples(DRY, 0.1, 200, seed)) for seed in range(3)]
    plain = replace(NOMINAL, min_creep=0.0, restart=False)
    many = begin(plain, (3,))
    for column in zip(*data, strict=True):
        creeps, mus = (np.array([getattr(sample, name) for sample in column]) for name in ("creep", "adhesion"))
        many = advance(plain, many, creeps, mus)
    for run, own in enumerate(data):
        state = feed(plain, init(plain), iter([sample._replace(adhesion_var=0.0) for sample in own]))[0]
        assert many.theta[run] == pytest.approx(state.recursion.theta, rel=1e-9)


def test_a_fixed_factor_stays() -> None:
    config = replace(NOMINAL, forgetting=FIXED, eta=0.98, restart=False)
    state, estimates = feed(config, init(config), samples(DRY, 0.1, 600))
    assert {estimate.eta for estimate in estimates} == {0.98}
    assert estimates[-1].remembered == pytest.approx(1 / (1 - 0.98), rel=1e-4)
    assert state.recursion.sums.weight == pytest.approx(50.0, rel=1e-4)


def test_a_new_surface_is_noticed_and_learnt() -> None:
    state, _ = feed(NOMINAL, init(NOMINAL), samples(DRY, 0.1, 1000))
    state, estimates = feed(NOMINAL, state, samples(WET, 0.1, 1000, 2, 10**11))
    assert state.counts[CreepOutcome.CHANGED] >= 1
    assert estimates[-1].status is Peak.KNOWN
    assert estimates[-1].mu_max == pytest.approx(0.20, rel=0.02)


def test_without_restarting_the_change_is_at_least_said() -> None:
    config = replace(NOMINAL, restart=False)
    state, _ = feed(config, init(config), samples(DRY, 0.1, 1000))
    state, estimates = feed(config, state, samples(WET, 0.1, 300, 2, 10**11))
    assert Peak.CHANGING in {estimate.status for estimate in estimates}
    assert state.counts[CreepOutcome.CHANGED] == 0


def test_one_surface_is_not_taken_for_another() -> None:
    for seed in range(4):
        state, _ = feed(NOMINAL, init(NOMINAL), samples(DRY, 0.1, 1000, seed))
        assert state.counts[CreepOutcome.CHANGED] == 0


def test_the_spread_of_the_peak_is_that_of_many_draws() -> None:
    spread = np.array([[1.0, -3.0], [-3.0, 25.0]])
    full = full_covariance(20.0, DRY, spread)
    drawn = np.random.default_rng(0).multivariate_normal(DRY, spread, 200_000)
    values = np.column_stack([drawn, *peak(20.0, drawn)])
    assert np.cov(values.T) == pytest.approx(full, rel=0.03, abs=1e-6)


@pytest.mark.parametrize(
    ("sample", "outcome"),
    [
        (CreepSample(10**9, math.nan, 0.1), CreepOutcome.INVALID),
        (CreepSample(10**9, 0.02, math.inf), CreepOutcome.INVALID),
        (CreepSample(10**9, 1.5, 0.1), CreepOutcome.INVALID),
        (CreepSample(10**9, 0.0005, 0.01), CreepOutcome.IDLE),
        (CreepSample(10**9, -0.02, -0.2), CreepOutcome.IDLE),
        (CreepSample(50 * 10_000_000, 0.02, 0.2), CreepOutcome.DUPLICATE),
        (CreepSample(49 * 10_000_000, 0.02, 0.2), CreepOutcome.LATE),
    ],
)
def test_what_cannot_be_used_is_counted_and_changes_nothing(sample: CreepSample, outcome: CreepOutcome) -> None:
    before, _ = feed(NOMINAL, init(NOMINAL), samples(DRY, 0.05, 50))
    after, estimate = creep_step(NOMINAL, before, sample)
    assert estimate is None
    assert (after.outcome, after.counts[outcome]) == (outcome, before.counts[outcome] + 1)
    assert after.recursion is before.recursion


def test_a_jump_back_begins_anew() -> None:
    before, _ = feed(NOMINAL, init(NOMINAL), samples(DRY, 0.05, 50, start_ns=10**12))
    after, _ = creep_step(NOMINAL, before, CreepSample(10**9, 0.02, 0.2))
    assert after.counts[CreepOutcome.RESET] == 1
    assert after.recursion.sums.weight == 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"eta_min": 0.99, "eta_max": 0.98}, r"eta_min = 0.99: choose at most eta_max, 0.98"),
        ({"gain": -1.0}, r"gain = -1.0: give a value from 0 to 100"),
        ({"solver": "magic"}, r"solver = 'magic': choose one of exact, dfp"),
        ({"start_mu_max": 1.5}, r"mu_max = 1.5: with slope 20 and lambda_m 0.1 give at most 1"),
    ],
)
def test_bad_settings_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(NOMINAL, **change)
