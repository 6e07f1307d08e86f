# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The bank as an estimator: its start, steps of the positions, its evidence, numbers that fail, a train in reverse."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from oracles import drive, ride

from adhesion_node.core import Config, Estimate, Measurement, Outcome, Regime, State, init, predict, step
from adhesion_node.core.bank import following
from adhesion_node.core.bank.memory import Memory

S = 10**9
BANK = Config(method="bank", grade_std=0.005, mass_std=0.05, brake_std=0.1, rotating_mass_std=0.02, law_probability=0.5)
STOP: list[tuple[float, float | None]] = [(8.0, 0.0), (14.0, 410e3)]


def accelerating(seed: int, mps2: float, period_s: float = 0.1) -> list[tuple[Measurement, float]]:
    """8 s of positions of a train that gains speed from 10 m/s, with its speed."""
    sigma_m = 0.5
    rng = np.random.default_rng(seed)
    times = np.arange(round(8.0 / period_s)) * period_s
    speeds = 10.0 + mps2 * times
    places = 10.0 * times + mps2 * times**2 / 2.0 + sigma_m * rng.standard_normal(times.size)
    return [
        (Measurement(round(t * 1e9), float(s), sigma_m**2, 0.0), float(v))
        for t, s, v in zip(times, places, speeds, strict=True)
    ]


@pytest.mark.parametrize("mps2", [-1.0, 0.0, 0.7, 1.3])
@pytest.mark.parametrize("period_s", [0.1, 1.0])
def test_the_speed_at_the_start_is_within_3_sigma(mps2: float, period_s: float) -> None:
    """Of all estimates of the first 8 s, over seeds, whatever the train does."""
    held = []
    for seed in range(60):
        truths = accelerating(seed, mps2, period_s)
        by_time = {m.t_ns: v for m, v in truths}
        _, estimates = drive(BANK, [m for m, _ in truths])
        assert estimates[0].t_ns == truths[1][0].t_ns  # one position tells no speed
        held += [abs(e.speed_mps - by_time[e.t_ns]) <= 3.0 * e.speed_std_mps for e in estimates]
    assert np.mean(held) >= 0.99


def test_no_estimate_comes_before_the_speed_is_known() -> None:
    """A position, then ticks: silence; then a speed."""
    state = init(BANK, 1)
    state, first = step(BANK, state, Measurement(0, 0.0, 0.25, 0.0))
    assert first is None
    for tick in range(1, 4):
        state, none = step(BANK, state, Measurement(tick * S, 0.0, math.inf, 0.0))
        assert none is None
    _, estimate = step(BANK, state, Measurement(4 * S, 0.0, math.inf, 0.0, 30.0))
    assert estimate is not None
    assert estimate.speed_mps == pytest.approx(30.0, abs=1.0)


def stepped(measurements: list[Measurement], at_s: float, size_m: float) -> list[Measurement]:
    return [m._replace(position_m=m.position_m + size_m * (m.t_ns >= at_s * S)) for m in measurements]


@pytest.mark.parametrize("at_s", [6.0, 13.0])
@pytest.mark.parametrize("size_m", [-5.0, -3.0, 2.0, 5.0, 10.0])
def test_a_step_of_the_positions_moves_neither_mu_nor_speed(size_m: float, at_s: float) -> None:
    measurements = ride(STOP, seed=3)
    every = {e.t_ns: e for e in drive(replace(BANK, estimate_s=0.0), measurements)[1]}
    state, estimates = drive(BANK, stepped(measurements, at_s, size_m))
    assert state.counts[Outcome.OUTLIER] <= 2
    assert state.counts[Outcome.RESET] == 0
    for e in (each for each in estimates if each.t_ns >= (at_s + 0.5) * S):
        without = every[e.t_ns]
        assert abs(e.mu - without.mu) < 3.0 * max(without.mu_std, e.mu_std)
        assert abs(e.speed_mps - without.speed_mps) < 3.0 * math.hypot(without.speed_std_mps, e.speed_std_mps)
        assert abs(e.position_m - size_m - without.position_m) < 1.0


@pytest.mark.parametrize("period_s", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("size_m", [-150.0, -60.0, 40.0, 200.0])
def test_a_receiver_that_is_elsewhere_for_good_moves_neither_mu_nor_speed(size_m: float, period_s: float) -> None:
    """At 14 s, 6 s behind the brake: known after 2 s. A position taken in later would be off by as much."""
    phases: list[tuple[float, float | None]] = [(8.0, 0.0), (40.0, 410e3)]
    measurements = ride(phases, seed=3, period_s=period_s)
    every = {e.t_ns: e for e in drive(replace(BANK, estimate_s=0.0), measurements)[1]}
    state, estimates = drive(BANK, stepped(measurements, 14.0, size_m))
    assert state.counts[Outcome.OUTLIER] <= 2.0 / period_s
    assert state.counts[Outcome.RESET] == state.counts[Outcome.SLIDING] == 0
    for e in (each for each in estimates if each.t_ns >= 14 * S):
        without = every[e.t_ns]
        assert abs(e.mu - without.mu) < 3.0 * max(without.mu_std, e.mu_std)
        assert abs(e.speed_mps - without.speed_mps) < 3.0 * math.hypot(without.speed_std_mps, e.speed_std_mps)
        assert e.t_ns < 16.2 * S or abs(e.position_m - size_m - without.position_m) < 3.0


@pytest.mark.parametrize("paused_s", [2.0, 4.5])
@pytest.mark.parametrize("seed", range(3))
def test_behind_a_clock_that_stood_the_train_is_slower(seed: int, paused_s: float) -> None:
    """At 14 s under the full brake: the positions seem to have stepped, and the speed with them."""
    phases: list[tuple[float, float | None]] = [(8.0, 0.0), (50.0, 410e3)]
    measurements, first, paused_ns = ride(phases, 0.2, seed=seed), 140, round(paused_s * S)
    every = {e.t_ns: e for e in drive(replace(BANK, estimate_s=0.0), measurements)[1]}
    behind = [m._replace(t_ns=m.t_ns - paused_ns) for m in measurements[first + round(10.0 * paused_s) :]]
    state, estimates = drive(BANK, measurements[:first] + behind)
    assert state.counts[Outcome.RESET] == state.counts[Outcome.SLIDING] == 0
    for e in (each for each in estimates if 16.2 * S < each.t_ns < 50 * S):
        without = every[e.t_ns + paused_ns]
        assert abs(e.speed_mps - without.speed_mps) < 3.0 * math.hypot(without.speed_std_mps, e.speed_std_mps)


def test_positions_farther_off_than_any_receiver_steps_are_another_place() -> None:
    """Once a second, 5 s of way and more behind: met anew after 2 s."""
    measurements = ride([(8.0, 0.0), (20.0, 410e3)], seed=3, period_s=1.0)
    state, estimates = drive(BANK, stepped(measurements, 14.0, -600.0))
    assert state.counts[Outcome.RESET] == 1
    assert all(e.mu_lower <= 0.0726 for e in estimates)
    assert min(e.mu_std for e in estimates if 16 * S < e.t_ns <= 17 * S) > 0.02


@pytest.mark.parametrize("seed", range(3))
def test_a_receiver_that_has_held_the_place_of_a_slow_departure_costs_nothing_that_was_learnt(seed: int) -> None:
    """It lets go at 1.5 m/s, 19 m further on: more than a balise corrects, and no other place."""
    rng, speed, way, held, measurements, speeds = np.random.default_rng(seed), 20.0, 0.0, 0.0, [], {}
    for k in range(1400):
        pressure, pull = (0.0, 0.0) if k < 200 else (290e3, -0.7) if k < 700 else (0.0, 0.06)
        held = held if k > 200 and speed < 1.5 else way + 0.5 * float(rng.standard_normal())
        measurements.append(Measurement(k * S // 10, held, 0.25, pressure))
        speeds[k * S // 10] = speed
        way, speed = way + 0.1 * speed, max(speed + 0.1 * pull, 0.0)
    state, estimates = drive(BANK, measurements)
    assert state.counts[Outcome.RESET] == 0
    behind = [e for e in estimates if e.t_ns > 98 * S]
    assert len(behind) > 50
    assert all(abs(e.speed_mps - speeds[e.t_ns]) < 3.0 * e.speed_std_mps for e in behind)


def test_positions_that_are_not_believed_silence_nothing() -> None:
    """2 s of stamps that are a second late, too short to be believed: followed without them, less sure."""
    measurements = ride([(40.0, 0.0)], seed=1)
    until = measurements[118].t_ns
    late = [m._replace(position_m=m.position_m - 40.0 * (100 <= i < 118)) for i, m in enumerate(measurements)]
    state, estimates = drive(BANK, late)
    assert state.counts[Outcome.OUTLIER] == 18
    assert state.counts[Outcome.RESET] == 0
    assert max(b.t_ns - a.t_ns for a, b in pairwise(estimates)) <= 0.5 * S
    before, blind = ([e for e in estimates if a <= e.t_ns < b] for a, b in ((8 * S, 10 * S), (11 * S, until)))
    assert min(e.speed_std_mps for e in blind) > max(e.speed_std_mps for e in before)
    sound = {e.t_ns: e for e in drive(replace(BANK, estimate_s=0.0), measurements)[1]}
    assert all(abs(e.speed_mps - sound[e.t_ns].speed_mps) < 3.0 * e.speed_std_mps for e in blind)


def test_the_next_step_may_come_a_spacing_behind_where_the_last_was_plain() -> None:
    """Three positions make it so: those of 6.0, 6.1 and 6.2 s."""
    measurements = stepped(ride(STOP, seed=3), 6.0, 5.0)
    assert drive(BANK, measurements)[0].stepping.stepped_m == measurements[62].position_m


def test_the_evidence_is_that_of_what_came_since_the_last_estimate() -> None:
    """Of white noise of 0.5 m about a train that is well followed: ln p of each position is -1/2 ln(2 pi e 0.25)."""
    _, estimates = drive(BANK, ride([(40.0, 0.0)], seed=1))
    late = [e.log_likelihood / 5.0 for e in estimates if e.t_ns > 10 * S]
    assert np.mean(late) == pytest.approx(-0.5 * math.log(2.0 * math.pi * math.e * 0.25), abs=0.1)


def test_what_an_estimate_tells_of_its_making() -> None:
    _, estimates = drive(BANK, ride(STOP))
    assert {(e.window > 0, e.iterations) for e in estimates} == {(False, 0), (True, 1)}
    braked = [e.window for e in estimates if e.window]
    assert all(later == earlier + 5 for earlier, later in pairwise(braked[:-1]))
    assert all(e.converged and e.ess >= 1.0 for e in estimates)


def broken(state: State, name: str) -> State:
    memory = state.memory
    assert memory is not None
    bank = memory.bank
    bad = {
        "nan": bank._replace(mean=bank.mean * math.nan),
        "infinite": bank._replace(covariance=bank.covariance * math.inf),
    }[name]
    return state._replace(memory=memory._replace(bank=bad))


@pytest.mark.parametrize("name", ["nan", "infinite"])
@pytest.mark.parametrize("at", [40, 120])
def test_numbers_that_fail_end_in_a_reset_that_is_told(name: str, at: int) -> None:
    measurements, state, after = ride(STOP), init(BANK, 1), list[Estimate]()
    for k, measurement in enumerate(measurements):
        state = broken(state, name) if k == at else state
        state, estimate = step(BANK, state, measurement)
        after += [] if estimate is None or k < at else [estimate]
        assert k != at or (state.outcome is Outcome.RESET and "belief lost" in str(state.events[-1]))
    assert state.counts[Outcome.RESET] == 1
    assert all(math.isfinite(value) for e in after for value in e if isinstance(value, float))
    truth = 80.0 - 14.0 * 9.8 * (0.0726 + 0.0105)
    assert after[-1].speed_mps == pytest.approx(truth, abs=1.0)


def test_a_failed_solution_is_no_crash_either(monkeypatch: pytest.MonkeyPatch) -> None:
    state = drive(BANK, ride([(3.0, 0.0)]))[0]

    def failing(*_: object) -> Memory:
        raise np.linalg.LinAlgError("singular")

    monkeypatch.setattr(following, "followed", failing)
    state, estimate = step(BANK, state, Measurement(4 * S, 320.0, 0.25, 0.0))
    assert estimate is None
    assert state.outcome is Outcome.RESET


def test_a_train_whose_positions_fall_has_a_speed_below_zero() -> None:
    backwards = [m._replace(position_m=5000.0 - m.position_m) for m in ride([(20.0, 0.0)], speed_mps=20.0)]
    _, estimates = drive(BANK, backwards)
    assert estimates[-1].speed_mps == pytest.approx(-20.0, abs=0.5)
    assert {e.regime for e in estimates} == {Regime.COASTING}
    for e in estimates[5:]:
        prediction = predict(BANK, e)
        assert prediction.nominal is not None
        assert prediction.nominal.speed_mps[0] == -e.speed_mps


def test_a_gap_under_the_brake_leaves_the_speed_within_its_interval() -> None:
    measurements = ride([(5.0, 0.0), (25.0, 410e3)])
    _, estimates = drive(BANK, [m for m in measurements if not 12e9 <= m.t_ns < 15e9])
    # 25 s of 9.8 (0.0726 + 0.0099), the resistance at the mean speed
    assert abs(estimates[-1].speed_mps - (80.0 - 25 * 0.8085)) < 3 * estimates[-1].speed_std_mps
    assert estimates[-1].speed_std_mps < 0.6


def test_one_second_of_braking_claims_nothing() -> None:
    _, estimates = drive(BANK, ride([(5.0, 0.0), (1.0, 410e3)]))
    assert estimates[-1].regime is Regime.COASTING
    assert estimates[-1].mu_lower <= 0.05
    for early in estimates[-2:]:
        assert early.ahead is not None
        assert max(early.ahead.mu) <= 0.05


@pytest.mark.parametrize("before", [[(5.0, 0.0)], [(5.0, 0.0), (6.0, 410e3), (5.0, 0.0)]])
def test_a_brake_that_builds_up_takes_nothing_from_what_was_known(before: list[tuple[float, float | None]]) -> None:
    """A part of it that the rail bears says nothing against the rail."""
    ramp = [(0.5, share * 410e3) for share in (0.15, 0.3, 0.45, 0.6)]
    _, estimates = drive(BANK, ride([*before, *ramp]))
    known, *building_up = [min(each.ahead.mu) for each in estimates if each.ahead is not None][-5:]
    assert len(building_up) == 4
    assert min(building_up) >= 0.96 * known, "but for the error of the speed"
