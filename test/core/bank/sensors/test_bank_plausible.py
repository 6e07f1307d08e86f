# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Positions of a wheel that slides are caught, those of a receiver whose error wanders are not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from banks import CONFIG, FULL, FULL_PA, S, bank_of
from oracles import specific_resistance

from adhesion_node.core import Measurement, Outcome, SpeedSample, State, WheelSample, init, step
from adhesion_node.core.bank.motion import Foreseen
from adhesion_node.core.bank.sensors import plausible, possible
from adhesion_node.core.bank.steps import Stepping
from adhesion_node.core.estimate import Estimate
from adhesion_node.core.physics.train import Array

DOPPLER = replace(CONFIG, speed_source="doppler")
BRAKE_S, RELEASE_S, END_S = 10.0, 26.0, 31.0
H = 0.1


def truth(mu: float, speed: float = 60.0) -> tuple[Array, Array]:
    """Positions and speeds every 0.1 s: traction holds the speed, then a full brake, then it rolls."""
    places, speeds, s = [], [], 0.0
    for index in range(round(END_S / H)):
        places.append(s)
        speeds.append(speed)
        resistance = float(specific_resistance(np.array(speed)))
        braked = BRAKE_S <= index * H < RELEASE_S
        slowing = 9.8 * (min(mu, FULL) + resistance) if braked else 9.8 * resistance if index * H >= RELEASE_S else 0.0
        s, speed = s + H * speed - 0.5 * H * H * slowing, speed - H * slowing
    return np.array(places), np.array(speeds)


def wheel(speeds: Array, rng: np.random.Generator, slip: float) -> Array:
    """Positions integrated from an axle whose creep grows to `slip` within some seconds of braking."""
    times = np.arange(speeds.size) * H
    sliding = (times > BRAKE_S + 1.0) & (times < RELEASE_S)
    creep = np.where(sliding, slip * -np.expm1(-(times - BRAKE_S - 1.0).clip(0.0)), 0.0)
    rim = speeds * (1.0 - creep) + 0.05 * rng.standard_normal(speeds.size)
    return np.concatenate(([0.0], np.cumsum(rim * H)[:-1]))


def gauss_markov(count: int, rng: np.random.Generator, std: float, lasts_s: float) -> Array:
    kept, error = math.exp(-H / lasts_s), np.zeros(count)
    error[0] = std * rng.standard_normal()
    for index in range(1, count):
        error[index] = kept * error[index - 1] + std * math.sqrt(1.0 - kept**2) * rng.standard_normal()
    return error


def followed(positions: Array, std: float, every: int = 1, speeds: Array | None = None) -> tuple[State, list[Estimate]]:
    """By one of so many positions, and the Doppler speed beside it."""
    state, estimates = init(DOPPLER, 1), []
    for index, position in tuple(enumerate(positions))[::every]:
        pressure = FULL_PA if BRAKE_S <= index * H < RELEASE_S else 0.0
        beside = None if speeds is None else float(speeds[index])
        measurement = Measurement(S + round(index * H * 1e9), float(position), std**2, pressure, beside)
        state, estimate = step(DOPPLER, state, measurement)
        estimates += [] if estimate is None else [estimate]
    return state, estimates


@pytest.mark.parametrize(("seed", "slip"), [*((seed, 0.1) for seed in range(3)), (0, 0.15), (0, 0.2), (0, 0.3)])
def test_positions_of_a_sliding_wheel_are_caught_until_the_brake_is_released(seed: int, slip: float) -> None:
    rng = np.random.default_rng(seed)
    _, speeds = truth(0.03)
    positions = wheel(speeds, rng, slip)
    state, estimates = followed(positions, 0.3)
    assert state.counts[Outcome.SLIDING] > 0
    withheld = [(each.t_ns - S) / S for each in estimates if each.withheld]
    assert withheld
    assert BRAKE_S < withheld[0] < BRAKE_S + 6.0
    assert withheld[-1] < RELEASE_S + 2.0  # a release as sudden as a dump is known when the cylinder stays empty
    assert all(each.mu_lower <= 0.03 for each in estimates if each.withheld)
    # afterwards the positions count again
    last = estimates[-1]
    assert not last.withheld
    assert last.speed_mps == pytest.approx(speeds[-1], abs=max(4.0 * last.speed_std_mps, 0.5))
    assert last.position_m == pytest.approx(positions[round((last.t_ns - S) / S / H)], abs=2.0)


@pytest.mark.parametrize("slip", [0.04, 0.06])
@pytest.mark.parametrize("seed", range(3))
def test_a_wheel_that_slides_a_little_by_turns_is_caught(seed: int, slip: float) -> None:
    """No deceleration of it is impossible, but no receiver errs so."""
    _, speeds = truth(0.08)
    times = np.arange(speeds.size) * H
    sliding = (times > BRAKE_S + 1.0) & (times < RELEASE_S)
    rim = speeds * (1.0 - np.where(sliding, slip * (1.0 - np.cos(2.5 * (times - BRAKE_S - 1.0))) / 2.0, 0.0))
    rim += 0.05 * np.random.default_rng(seed).standard_normal(rim.size)
    state, estimates = followed(np.concatenate(([0.0], np.cumsum(rim * H)[:-1])), 0.3)
    assert state.counts[Outcome.SLIDING] > 0
    assert min((each.t_ns - S) / S for each in estimates if each.withheld) < BRAKE_S + 5.0


@pytest.mark.parametrize("every", [2, 3, 5, 10])
@pytest.mark.parametrize(("slip", "more"), [(0.1, 2), (0.2, 5)])
def test_a_wheel_that_is_heard_seldom_is_caught(slip: float, more: int, every: int) -> None:
    """Down to one position a second, within so many that are off; what is off by far may first be a step.

    It creeps from 1 s behind the brake's opening on, and estimates tell so twice a second.
    """
    for seed in range(4):
        _, speeds = truth(0.03)
        state, estimates = followed(wheel(speeds, np.random.default_rng(seed), slip), 0.5, every)
        assert state.counts[Outcome.SLIDING] > 0, seed
        first = min((each.t_ns - S) / S for each in estimates if each.withheld)
        assert BRAKE_S + 1.0 < first <= BRAKE_S + 2.5 + more * every * H


def test_a_position_that_may_have_stepped_adds_nothing_and_is_the_one_before_the_next() -> None:
    """Before: the next was held against the one before the pause, and a receiver's was taken for a sliding wheel's."""
    course = plausible.Course()
    for index, (off, tells) in enumerate(((2.9, True), (0.9, False), (2.4, True), (4.2, True))):
        course = course.after(S + index * S // 10, 0.0, True, off, tells)
    assert course.running == pytest.approx(max(0.9 * 2.4 - plausible.FORESEEN, 0.0) + 2.4 * 4.2 - plausible.FORESEEN)
    assert not course.runs_off


@pytest.mark.parametrize("size_m", [-8.0, -4.0, 8.0])
@pytest.mark.parametrize(("every", "with_speed"), [(1, False), (2, False), (5, False), (5, True), (10, True)])
def test_a_step_of_the_positions_is_no_sliding_wheel(size_m: float, every: int, with_speed: bool) -> None:
    """Before: two of them in a row, five times a second or less, were, until the brake was released."""
    for seed in range(4):
        rng = np.random.default_rng(seed)
        places, speeds = truth(0.08)
        errors = gauss_markov(places.size, rng, 1.0, 60.0) + 0.1 * rng.standard_normal(places.size)
        stepped = size_m * (np.arange(places.size) * H > BRAKE_S + 6.0)
        state, estimates = followed(places + errors + stepped, 2.0, every, speeds if with_speed else None)
        assert not state.counts[Outcome.SLIDING]
        assert not any(each.withheld for each in estimates)


def test_positions_that_run_ahead_of_another_sensor_tell_of_no_sliding_wheel() -> None:
    """Before: a receiver that ran 0.6 m ahead of a Doppler speed was left out. Alone an axle that rolls again does."""
    alone = Measurement(S, 100.0, 4.0, FULL_PA)
    for beside in (
        alone._replace(speeds=(SpeedSample(S, 40.0, 0.01),)),
        alone._replace(wheels=(WheelSample(S, (40.0, 39.9)),)),
    ):
        assert not Stepping().tells(DOPPLER, beside, Foreseen(0.6))
        assert Stepping().tells(DOPPLER, beside, Foreseen(-0.6))
    assert Stepping().tells(DOPPLER, alone, Foreseen(0.6))
    of_axle = alone._replace(speeds=(SpeedSample(S, 40.0, 0.01),))
    assert Stepping().tells(CONFIG, of_axle, Foreseen(0.6)), "it may be the one that slides"


@pytest.mark.parametrize(("lasts_s", "every"), [(0.1, 10), (0.1, 1), (0.25, 1)])
def test_outliers_that_have_one_cause_are_no_sliding_wheel(lasts_s: float, every: int) -> None:
    """By 60 m behind under the brake, every 5 s: one of positions once a second, or a burst of some of ten."""
    places, _ = truth(0.05)
    index = np.arange(places.size)
    off = np.where((index * H > BRAKE_S + 2.0) & (index % 50 * H < lasts_s), -60.0, 0.0)
    state, _ = followed(places + off + 0.2 * np.random.default_rng(1).standard_normal(places.size), 0.5, every)
    assert state.counts[Outcome.OUTLIER] >= 3
    assert state.counts[Outcome.SLIDING] == 0


@pytest.mark.parametrize("every", [1, 3, 10])
@pytest.mark.parametrize(("mu", "seeds"), [(0.03, range(3)), (0.2, range(20))])
def test_a_receiver_whose_error_wanders_is_believed(mu: float, seeds: range, every: int) -> None:
    """Errors of 2 m that last 30 s."""
    places, speeds = truth(mu)
    for seed in seeds:
        rng = np.random.default_rng(seed)
        error = gauss_markov(places.size, rng, 2.0, 30.0) + 0.1 * rng.standard_normal(places.size)
        state, estimates = followed(places + error, 2.0, every)
        assert state.counts[Outcome.SLIDING] == 0, seed
        assert state.counts[Outcome.RESET] == 0
        assert not estimates[-1].withheld
        assert abs(estimates[-1].speed_mps - speeds[-1]) < 5.0 * estimates[-1].speed_std_mps


@pytest.mark.parametrize(
    ("mps2", "braked_s", "impossible"),
    [(2.0, 8.0, True), (2.0, 4.0, False), (0.5, 8.0, False), (-0.9, 8.0, False), (-4.0, 8.0, True), (-4.0, 4.0, True)],
)
def test_no_train_brakes_harder_than_its_brake_nor_gains_speed_for_long_under_it(
    mps2: float, braked_s: float, impossible: bool
) -> None:
    """3 s of positions of 0.1 m; at their beginning it has been braked for 5 s, or for 1 s."""
    times = np.arange(-30, 1) * H
    recent = [(round((60.0 + t) * S), 40.0 * t + 0.5 * mps2 * t * t) for t in times.tolist()]
    course = plausible.Course(tuple(recent), braked_ns=round((60.0 - braked_s) * S))
    assert course.is_impossible(CONFIG, bank_of([1]), 0.1) == impossible
    assert not course._replace(braked_ns=None).is_impossible(CONFIG, bank_of([1]), 0.1)
    assert not course._replace(recent=course.recent[-7:]).is_impossible(CONFIG, bank_of([1]), 0.1)


@pytest.mark.parametrize("std_m", [0.3, 2.0, 5.0])
@pytest.mark.parametrize("span_s", [3.0, 1.5])
def test_the_error_of_a_parabola_is_that_of_white_and_wandering_positions(std_m: float, span_s: float) -> None:
    """Against 2000 drawn: as white as is declared, and wandering by as much, 1 m at least, for 30 s."""
    rng, count = np.random.default_rng(3), round(span_s / H) + 1
    steps, kept = max(std_m, 1.0) * rng.standard_normal((2000, count)), math.exp(-H / 30.0)
    slow = steps.copy()
    for index in range(1, count):
        slow[:, index] = kept * slow[:, index - 1] + math.sqrt(1.0 - kept**2) * steps[:, index]
    errors = slow + std_m * rng.standard_normal(slow.shape)
    drawn = 2.0 * np.polyfit(np.arange(count) * H, errors.T, 2)[0].std()
    assert plausible._error(*plausible._errors(bank_of([1]), std_m), span_s, count) == pytest.approx(drawn, rel=0.25)


@pytest.mark.parametrize("tails", [math.inf, 2.0])
def test_errors_by_chance_are_believed(tails: float) -> None:
    """White, Gaussian or with the tails of a Student t."""
    places, _ = truth(0.05)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        errors = rng.standard_normal(places.size) if math.isinf(tails) else rng.standard_t(tails, places.size)
        state, _ = followed(places + 0.5 * errors, 0.5)
        assert state.counts[Outcome.SLIDING] == 0, seed


@pytest.mark.parametrize(("stds", "impossible"), [(4.5, False), (5.5, True)])
def test_what_comes_by_chance_within_hours_is_no_sliding_wheel(stds: float, impossible: bool) -> None:
    """Positions of 3 s that seem to gain speed by so many standard deviations: four come once in 100 long brakings."""
    times, bank = np.arange(-30, 1) * H, bank_of([1])
    gained = possible.GAIN_MPS2 + stds * plausible._error(*plausible._errors(bank, 2.0), 3.0, times.size)
    recent = [(round((60.0 + t) * S), 40.0 * t + 0.5 * gained * t * t) for t in times.tolist()]
    course = plausible.Course(tuple(recent), braked_ns=round(50.0 * S))
    assert course.is_impossible(CONFIG, bank, 2.0) == impossible
