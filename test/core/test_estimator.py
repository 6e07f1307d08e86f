# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The estimator as a whole: what becomes of every measurement, bit for bit; gaps; standstill; rough streams."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from oracles import drive, ride
from windowed import windowed

from adhesion_node.core import Config, Estimate, Measurement, Outcome, Regime, State, finish, init, step
from adhesion_node.core.intake.samples import ImuSample, SpeedSample

FULL = 410e3
QUICK = Config(method="particle_em", window=20, step=5, particles=8, iterations=8)
"""The mechanics do not depend on the accuracy."""
STOP: list[tuple[float, float | None]] = [(5.0, 0.0), (8.0, FULL)]


def _counts(state: State) -> dict[str, int]:
    return {outcome.name: count for outcome, count in state.counts.items() if count}


def _finite(estimate: Estimate) -> bool:
    numbers = [value for value in estimate if isinstance(value, float)]
    return len(numbers) == 9 and all(map(math.isfinite, numbers)) and estimate.mu_std >= 0 <= estimate.mu_lower


def test_seed_and_stream_decide_every_bit() -> None:
    measurements = ride(STOP)
    one, again, other = (drive(QUICK, measurements, seed)[1] for seed in (1, 1, 2))
    assert one == again
    assert one[5] == other[5]  # no chance while coasting
    assert one[-1].mu != other[-1].mu
    with pytest.raises(ValueError, match="seed = -1: give an integer of at least 0"):
        init(QUICK, -1)


@pytest.mark.parametrize("sigma_m", [0.2, 0.5, 2.0])
def test_a_window_opens_as_soon_as_the_speed_is_settled(sigma_m: float) -> None:
    """Of a train met under the brake: its variance over that of the long run, sqrt(2) q^(3/4) (r dt)^(1/4), q = 1."""
    long_run = math.sqrt(2.0) * (sigma_m**2 * 0.1) ** 0.25
    state, ratios = init(windowed(), 1), []
    for measurement in ride([(4.0, FULL)], sigma_m=sigma_m):
        state, _ = step(windowed(), state, measurement)
        assert state.belief is not None
        ratios.append(state.belief.covariance[1, 1] / long_run)
        if state.window is not None:
            break
    assert ratios[-1] <= 1.5 < ratios[-2]


def test_an_old_state_is_still_usable() -> None:
    measurements = ride(STOP)[:128]
    state = init(QUICK, 1)
    for measurement in measurements[:83]:
        state, _ = step(QUICK, state, measurement)
    before = repr(state)
    ends = []
    for _ in range(2):
        branch = state
        for measurement in measurements[83:]:  # ends within a window
            branch, _ = step(QUICK, branch, measurement)
        ends.append(finish(QUICK, branch)[1])
        step(QUICK, state, measurements[83]._replace(position_m=1e6))
        finish(QUICK, state)
    assert repr(state) == before
    assert ends[0] == ends[1] == tuple(drive(QUICK, measurements)[1][-1:])
    assert not isinstance(state.counts, dict)  # a view that cannot be written to


@pytest.mark.parametrize(
    "changes",
    [
        {"position_m": math.nan},
        {"position_m": math.inf},
        {"position_m": 1e12},
        {"variance_m2": 0.0},
        {"variance_m2": -0.25},
        {"variance_m2": math.nan},
        {"variance_m2": 1e-310},
        {"brake_pressure_pa": math.nan},
        {"speed_mps": math.inf},
        {"speed_mps": 1e3},
        {"speeds": (SpeedSample(1, 20.0, math.inf),)},
        {"imu": (ImuSample(1, 0.1, math.inf),)},
    ],
)
def test_invalid_is_counted_and_changes_nothing(changes: dict[str, Any]) -> None:
    measurements = ride(STOP)
    bad = [m._replace(t_ns=m.t_ns + 1, **changes) for m in measurements[40:120:10]]
    _, expected = drive(QUICK, measurements)
    state, estimates = drive(QUICK, sorted([*measurements, *bad], key=lambda m: m.t_ns))
    assert _counts(state) == {"ACCEPTED": 130, "INVALID": 8}
    assert estimates == expected


def _with_extra(measurements: list[Measurement], at: int, extra: Measurement) -> list[Measurement]:
    return [*measurements[:at], extra, *measurements[at:]]


@pytest.mark.parametrize("lag_s", [0.0, 0.35])
@pytest.mark.parametrize("at", [30, 90])
@pytest.mark.parametrize("name", ["LATE", "DUPLICATE", "DUPLICATE of another sensor", "OUTLIER"])
def test_refused_is_counted_and_changes_nothing(name: str, at: int, lag_s: float) -> None:
    config, measurements = replace(QUICK, max_lag_s=lag_s), ride(STOP)
    newest = measurements[at - 1]
    extra = {
        "LATE": measurements[at - 8]._replace(t_ns=measurements[at - 8].t_ns + 1),
        "DUPLICATE": newest._replace(position_m=newest.position_m - 0.3),  # the first to come counts
        "DUPLICATE of another sensor": newest._replace(brake_pressure_pa=None, speed_mps=70.0),
        "OUTLIER": newest._replace(t_ns=newest.t_ns + 10, position_m=newest.position_m + 30.0),
    }[name]
    _, expected = drive(config, measurements)
    state, estimates = drive(config, _with_extra(measurements, at, extra))
    assert _counts(state) == {"ACCEPTED": 130, name.split(maxsplit=1)[0]: 1}
    assert estimates == expected


def test_the_outcome_of_the_last_measurement_is_told() -> None:
    state = init(QUICK, 0)
    for measurement, outcome in (
        (Measurement(10**9, 0.0, 1.0), Outcome.ACCEPTED),
        (Measurement(10**9, 0.0, 1.0), Outcome.DUPLICATE),
        (Measurement(9 * 10**8, 0.0, 1.0), Outcome.LATE),
        (Measurement(11 * 10**8, math.nan, 1.0), Outcome.INVALID),
        (Measurement(12 * 10**8, 1e6, 1.0), Outcome.OUTLIER),
        (Measurement(13 * 10**8, 20.0, 1.0), Outcome.ACCEPTED),
    ):
        state, _ = step(QUICK, state, measurement)
        assert state.outcome is outcome
    assert all(outcome.value for outcome in Outcome)


@pytest.mark.parametrize("jump_s", [-1000.0, -61.5, 75.0, 1e6])
def test_a_jump_of_the_stamps_starts_anew(jump_s: float) -> None:
    """As a bag that is played in a loop: the second pass is the first one again, up to the windows' random numbers."""
    cruise, measurements = ride([(5.0, 0.0)]), ride(STOP, seed=1)
    later = [m._replace(t_ns=m.t_ns + round((5.0 + jump_s) * 1e9)) for m in measurements]
    state, estimates = drive(QUICK, [*cruise, *later])
    _, alone = drive(QUICK, measurements)
    assert _counts(state) == {"ACCEPTED": 180, "RESET": 1}
    assert [e._replace(t_ns=0) for e in estimates[-len(alone) :]] == [e._replace(t_ns=0) for e in alone]


def test_a_train_that_is_elsewhere_is_followed_there() -> None:
    measurements = ride([(12.0, 0.0)])
    moved = [m._replace(position_m=m.position_m + 5000.0 * (k >= 60)) for k, m in enumerate(measurements)]
    state, estimates = drive(replace(QUICK, max_outliers=4), moved)
    assert _counts(state) == {"ACCEPTED": 117, "OUTLIER": 3, "RESET": 1}
    assert estimates[-1].position_m == pytest.approx(5000 + 80 * 11.9, abs=1.0)


def test_outliers_now_and_then_are_no_other_place() -> None:
    measurements = ride([(12.0, 0.0)])
    jumping = [m._replace(position_m=m.position_m + 50.0 * (k % 10 == 9)) for k, m in enumerate(measurements)]
    state, _ = drive(replace(QUICK, max_outliers=2), jumping)
    assert _counts(state) == {"ACCEPTED": 108, "OUTLIER": 12}


def test_shuffled_within_the_lag_is_the_ordered_run() -> None:
    config, measurements = replace(QUICK, max_lag_s=0.5), ride(STOP)
    _, ordered = drive(config, measurements)
    assert ordered == drive(QUICK, measurements)[1]  # waiting changes no number
    rng = np.random.default_rng(3)
    for _ in range(5):
        delays = np.arange(130) * 0.1 + rng.uniform(0.0, 0.45, 130)
        shuffled = [measurements[int(k)] for k in np.argsort(delays)]
        assert shuffled != measurements
        state, estimates = drive(config, shuffled)
        assert _counts(state) == {"ACCEPTED": 130}
        assert estimates == ordered


def test_results_wait_no_longer_than_the_lag_when_the_rate_falls() -> None:
    config, measurements = replace(QUICK, max_lag_s=1.0), ride([(20.0, 0.0)])
    state = init(config, 0)
    for measurement in [*measurements[:100], *measurements[100::10]]:
        state, _ = step(config, state, measurement)
        for waiting in state.inbox.anchors.samples[:1]:
            assert measurement.t_ns - waiting.t_ns <= 1_000_000_000


@pytest.mark.parametrize("samples", [127, 128, 130])
def test_finish_evaluates_the_last_short_window(samples: int) -> None:
    measurements = ride(STOP)[:samples]
    _, estimates = drive(QUICK, measurements)
    assert [e.t_ns for e in estimates[:-1]] == [m.t_ns for m in measurements[4::5]][: len(estimates) - 1]
    assert estimates[-1].t_ns == measurements[-1].t_ns
    assert estimates[-1].window > 0
    assert len({e.t_ns for e in estimates}) == len(estimates)  # nothing twice, also without a rest
    assert finish(QUICK, init(QUICK, 0))[1] == ()


@pytest.mark.parametrize("cruise_s", [5.0, 5.3])
def test_windows_hold_s_measurements_wherever_the_brake_came(cruise_s: float) -> None:
    _, estimates = drive(QUICK, ride([(cruise_s, 0.0), (10.0, FULL)]))
    sizes = [e.window for e in estimates if e.window]
    growing = [size for size in sizes[:-1] if size < 20]
    assert all(after - before == 5 for before, after in pairwise(growing))
    assert all(20 <= size < 25 for size in sizes[len(growing) : -1])  # the first full one may take what came with L
    assert set(sizes[len(growing) + 1 : -1]) == {20}
    assert len(sizes) >= 18


@pytest.mark.parametrize(("window", "length"), [(10, 9), (10, 1), (3, 2), (3, 1)])
def test_the_extremes_of_window_and_stepdrive(window: int, length: int) -> None:
    _, estimates = drive(replace(QUICK, window=window, step=length), ride([(3.0, 0.0), (6.0, FULL)]))
    assert all(map(_finite, estimates))


def test_releasing_the_brake_ends_the_window_and_the_knowledge_fades() -> None:
    measurements = ride([(5.0, 0.0), (10.0, FULL), (20.0, 0.0)])
    released = measurements[150].t_ns
    _, estimates = drive(windowed(), measurements)
    braking = [e for e in estimates if e.window]
    assert braking[-1].t_ns == released  # its step was braked still
    free = [e for e in estimates if e.t_ns > released]
    assert len(free) >= 19
    assert {e.regime for e in free} == {Regime.COASTING}
    low = 0.03 + 8.0 / (130.0 + 3.6 * free[-1].speed_mps)  # the configured low law
    assert abs(free[-1].mu - low) < abs(free[0].mu - low)
    assert all(after.mu_std > before.mu_std for before, after in pairwise(free))
    assert free[0].speed_mps == pytest.approx(80.0 - 10 * 9.8 * (0.0726 + 0.0113), abs=3 * free[0].speed_std_mps)
    assert free[-1].speed_mps == pytest.approx(80.0 - 10 * 9.8 * (0.0726 + 0.0113), abs=0.7)


def test_what_the_window_knew_of_the_speed_is_not_lost_on_release() -> None:
    state, last = init(QUICK, 1), None
    for measurement in ride([*STOP, (0.1, 0.0)]):
        state, estimate = step(QUICK, state, measurement)
        last = estimate or last
    assert last is not None
    assert state.belief is not None
    assert state.window is None
    assert (state.belief.mean[0], state.belief.mean[1]) == (last.position_m, last.speed_mps)
    assert state.belief.speed_std == last.speed_std_mps < 0.6  # the tracker's own is 0.7 under the brake


@pytest.mark.parametrize("start_mu", [0.0, 0.05, 0.12])
def test_one_second_of_braking_claims_nothing_whatever_the_start(start_mu: float) -> None:
    """Ten measurements know little: ignorance stays, and its low law pulls, 0.03 + 8/(130 + 288) = 0.0491 at 80 m/s."""
    _, estimates = drive(windowed(start_mu=start_mu), ride([(5.0, 0.0), (1.0, FULL)]))
    _, others = drive(windowed(), ride([(5.0, 0.0), (1.0, FULL)]))
    assert estimates[-1].window == 10
    assert estimates[-1].regime is Regime.COASTING
    assert estimates[-1].mu == pytest.approx(others[-1].mu, abs=1e-6)
    assert 0.025 < estimates[-1].mu_std < 0.041
    assert 0.048 < estimates[-1].mu_lower < 0.052


@pytest.mark.parametrize("start_mu", [0.0, 0.05, 0.12])
def test_the_papers_method_claims_nothing_after_one_second_either(start_mu: float) -> None:
    config = Config(method="particle_em", step=10, start_mu=start_mu)
    _, estimates = drive(config, ride([(5.0, 0.0), (1.0, FULL)]))
    assert estimates[-1].regime is Regime.COASTING
    assert estimates[-1].mu == pytest.approx(0.0491, abs=0.015)
    assert estimates[-1].mu_std == pytest.approx(0.04, rel=0.2)


def test_braking_again_opens_a_new_window() -> None:
    _, estimates = drive(QUICK, ride([(5.0, 0.0), (4.0, FULL), (5.0, 0.0), (4.0, FULL)]))
    sizes = [(e.t_ns / 1e9, e.window) for e in estimates]
    assert all(window == 0 for t, window in sizes if t < 5.0 or 9.3 < t < 14.0)
    assert max(window for t, window in sizes if 14.0 < t < 15.0) <= 10


def test_a_speed_helps_while_coasting_and_is_ignored_under_the_brake() -> None:
    plain = ride(STOP)
    speed = 80.0 + 0.1 * np.random.default_rng(5).standard_normal(130)
    coasting = [
        m._replace(speed_mps=float(v)) if not m.brake_pressure_pa else m for m, v in zip(plain, speed, strict=True)
    ]
    sliding = [m._replace(speed_mps=20.0) if m.brake_pressure_pa else m for m in coasting]
    config = replace(QUICK, speed_std_mps=0.1)
    without, seen, slid = (drive(config, measurements)[1] for measurements in (plain, coasting, sliding))
    assert seen[3].speed_std_mps < 0.6 * without[3].speed_std_mps
    assert abs(seen[3].speed_mps - 80.0) < 0.15
    assert slid == seen
    radar = replace(config, speed_source="radar")
    true = [m._replace(speed_mps=80.0 - 0.822 * max(m.t_ns / 1e9 - 5.0, 0.0)) for m in plain]
    assert drive(radar, true)[1][-1].speed_std_mps < 0.6 * seen[-1].speed_std_mps


@pytest.mark.parametrize("sigma_m", [0.5, 2.0])
def test_a_gap_under_the_brake_ends_the_window_and_a_new_one_opens(sigma_m: float) -> None:
    measurements = ride([(5.0, 0.0), (25.0, FULL)], sigma_m=sigma_m)
    gapped = [m for m in measurements if not 12e9 <= m.t_ns < 15e9]
    state, estimates = drive(windowed(), gapped)
    assert _counts(state) == {"ACCEPTED": 270}
    after = [e for e in estimates if e.t_ns >= 15e9]
    assert after[0].window <= 10
    assert after[-2].window == 50
    # 25 s of 9.8 (0.0726 + 0.0099), the resistance at the mean speed
    assert abs(after[-1].speed_mps - (80.0 - 25 * 0.8085)) < 3 * after[-1].speed_std_mps
    assert after[-1].speed_std_mps < 0.6


def test_a_short_gap_is_bridged() -> None:
    measurements = ride(STOP)
    state, estimates = drive(QUICK, [m for m in measurements if not 8e9 <= m.t_ns < 9.5e9])
    assert _counts(state) == {"ACCEPTED": 115}
    assert min(e.window for e in estimates if e.t_ns > 7e9) >= 10


def test_standing_still_is_no_slippery_rail() -> None:
    config = replace(QUICK, iterations=30, window=30, step=10)
    measurements = ride([(5.0, 0.0), (60.0, FULL)], speed_mps=30.0)  # stands after 35 s
    _, estimates = drive(config, measurements)
    assert all(map(_finite, estimates))
    standing = [e for e in estimates if e.t_ns > 45e9]
    assert all(abs(e.speed_mps) < 2.5 and e.mu > 0.045 for e in standing)
    assert {e.window for e in standing} == {0}


@pytest.mark.parametrize("start_mu", [0.0, 0.05, 0.12])
def test_the_bound_never_exceeds_the_estimate(start_mu: float) -> None:
    phases: list[tuple[float, float | None]] = [(5.0, 0.0), (8.0, FULL), (30.0, 0.0), (6.0, FULL), (4.0, 100e3)]
    _, estimates = drive(replace(QUICK, start_mu=start_mu), ride(phases, mu=0.035))
    assert all(e.mu_lower <= e.mu for e in estimates)


@pytest.mark.parametrize("seed", range(12))
def test_rough_streams_give_finite_numbers_or_counted_drops(seed: int) -> None:
    """Random phases, gaps, noise, order, stamps, pressures and nonsense: never an exception, never a NaN."""
    rng = np.random.default_rng(seed)
    pressures = [0.0, FULL, None, float(rng.uniform(0, 6e5)), 15e3, -2e3]
    phases = [(float(rng.uniform(0.5, 8)), pressures[int(rng.integers(6))]) for _ in range(8)]
    stream = []
    for m in ride(phases, mu=float(rng.uniform(0.005, 0.2)), speed_mps=float(rng.uniform(1, 95)), seed=seed):
        chance = rng.random()
        position = m.position_m + float(rng.standard_t(1.5)) * 0.5 + (1e4 if chance < 0.01 else 0.0)
        speed = float(rng.normal(40, 40)) if rng.random() < 0.3 else None
        variance = float(10.0 ** rng.uniform(-13, 9)) if chance > 0.97 else 0.25
        shift = round(rng.normal(0, 1e8)) if chance < 0.1 else round(rng.normal(0, 1e11)) if chance > 0.995 else 0
        rough = Measurement(m.t_ns + shift, position, variance, m.brake_pressure_pa, speed)
        if chance > 0.02:
            stream.append(rough if chance < 0.95 else rough._replace(position_m=math.nan))
        if 0.5 < chance < 0.52:
            stream.append(rough._replace(brake_pressure_pa=None))
    config = replace(
        QUICK,
        window=int(rng.integers(6, 25)),
        max_lag_s=float(rng.choice([0.0, 0.3])),
        max_outliers=10,
        speed_source=("axle", "doppler")[rng.integers(2)],
    )
    state, estimates = drive(config, stream, seed)
    assert all(map(_finite, estimates))
    assert len(estimates) > 5
    assert all(e.mu_lower <= e.mu + 1e-12 for e in estimates)
    # of the last two a measurement is used without its speed; no position repeats itself here
    of_others = (Outcome.RESET, Outcome.SPEED_IN_KMH, Outcome.STUCK)
    assert sum(state.counts[o] for o in Outcome if o not in of_others) == len(stream)  # each is counted once
