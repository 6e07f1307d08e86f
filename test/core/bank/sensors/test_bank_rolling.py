# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.
"""Positions that a wheel has rolled: known as such within seconds, and soon seen to slide, however seldom they come."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from banks import CONFIG, FULL, FULL_PA, S, bank_of
from oracles import specific_resistance

from adhesion_node.core import Config, Measurement, Outcome, State, init, step
from adhesion_node.core.bank.layout import POSITION
from adhesion_node.core.bank.sensors.coarse import Coarse
from adhesion_node.core.bank.sensors.plausible import Course
from adhesion_node.core.bank.sensors.possible import possible_of
from adhesion_node.core.bank.sensors.rolling import Rolling, _stepping
from adhesion_node.core.bank.sensors.wandering import Wandering
from adhesion_node.core.estimate import Estimate
from adhesion_node.core.physics.track import Grade, Track
from adhesion_node.core.physics.train import Array

H, BRAKE_S, PULSE_M = 0.1, 18.0, 0.02


def driven(mu: float, grade: float = 0.0, brake: float = 1.0, begins_s: float = BRAKE_S) -> tuple[Array, Array]:
    """Stamps, s, and speeds of a train that coasts, and brakes fully on such a rail."""
    times, speeds, speed = np.arange(0.0, begins_s + 15.0, H), [], 40.0
    for t in times.tolist():
        speeds.append(speed)
        used = min(mu, brake * FULL * min(max(t - begins_s, 0.0) / 1.5, 1.0))
        speed -= 9.8 * H * (used + float(specific_resistance(np.array(speed))) + grade)
    return times, np.array(speeds)


def placed(speeds: Array, rng: np.random.Generator, pulse_m: float = PULSE_M) -> Array:
    """What an axle of such speeds has rolled, in pulses."""
    way = np.concatenate(([0.0], np.cumsum(0.5 * H * (speeds[1:] + speeds[:-1]))))
    return np.asarray(pulse_m * np.floor(way / pulse_m + rng.random()))


def followed(
    times: Array,
    places: Array,
    rate_hz: float,
    config: Config = CONFIG,
    begins_s: float = BRAKE_S,
    pressure_pa: float = FULL_PA,
) -> tuple[State, list[Estimate]]:
    """What is made of positions that come so often and declare half a metre."""
    state, estimates = init(config, 1), []
    for t, place in list(zip(times.tolist(), places.tolist(), strict=True))[:: round(1.0 / rate_hz / H)]:
        measurement = Measurement(S + round(t * S), place, 0.25, pressure_pa if t >= begins_s else 0.0)
        state, estimate = step(config, state, measurement)
        estimates += [] if estimate is None else [estimate]
    return state, estimates


@pytest.mark.parametrize("rate_hz", [1.0, 2.0, 5.0, 10.0])
@pytest.mark.parametrize("seed", range(3))
def test_an_axle_that_is_heard_seldom_is_seen_to_slide(rate_hz: float, seed: int) -> None:
    """By 7 % within 1.5 s. Before: at 1 and 2 Hz it was believed for the whole braking."""
    times, speeds = driven(0.07)
    creep = 0.07 * np.clip((times - BRAKE_S - 1.2) / 1.5, 0.0, 1.0)
    state, estimates = followed(times, placed(speeds * (1.0 - creep), np.random.default_rng(seed)), rate_hz)
    assert state.counts[Outcome.SLIDING] > 0
    told_s = min((each.t_ns - S) / S for each in estimates if each.withheld)
    assert BRAKE_S + 1.0 < told_s < BRAKE_S + 2.8 + 1.0 / rate_hz


@pytest.mark.parametrize("rate_hz", [1.0, 2.0, 5.0, 10.0])
@pytest.mark.parametrize("pulse_m", [0.02, 0.1037, 0.3])
@pytest.mark.parametrize("grade", [0.02, 0.0, -0.02])
def test_an_axle_that_rolls_is_believed(rate_hz: float, pulse_m: float, grade: float) -> None:
    """By a brake that is stronger than told, on a grade that is told, while it creeps by 1 %."""
    track = Track((Grade(-1000.0, 9000.0, 1e4 * grade),)) if grade else Track()
    config = dataclasses.replace(CONFIG, track=track, brake_std=0.3)
    times, speeds = driven(0.3, grade, 1.6)
    creep = 0.01 * np.clip((times - BRAKE_S - 1.2) / 0.4, 0.0, 1.0)
    places = placed(speeds * (1.0 - creep), np.random.default_rng(2), pulse_m)
    state, _ = followed(times, places, rate_hz, config)
    assert state.counts[Outcome.SLIDING] == 0


@pytest.mark.parametrize("rate_hz", [1.0, 5.0, 10.0])
def test_a_brake_that_presses_harder_than_the_full_one_slows_down_so(rate_hz: float) -> None:
    times, speeds = driven(0.3, brake=1.8)
    places = placed(speeds, np.random.default_rng(2))
    state, _ = followed(times, places, rate_hz, pressure_pa=1.8 * FULL_PA)
    assert state.counts[Outcome.SLIDING] == 0
    state, _ = followed(times, places, rate_hz)
    assert state.counts[Outcome.SLIDING] > 0


@pytest.mark.parametrize("rate_hz", [1.0, 2.0, 10.0])
def test_pulses_that_come_evenly_are_not_thought_exact(rate_hz: float) -> None:
    """A train holds 20 m/s to the pulse, and brakes as hard as it can."""
    times, speeds = driven(0.3, brake=1.15)
    speeds = np.where(times < BRAKE_S, 20.0, 20.0 + speeds - speeds[round(BRAKE_S / H)])
    state, _ = followed(times, placed(speeds, np.random.default_rng(2), 0.1), rate_hz)
    assert state.counts[Outcome.SLIDING] == 0


@pytest.mark.parametrize(
    ("mps2", "braked_s", "impossible"),
    [(1.8, 8.0, True), (0.5, 8.0, False), (0.0, 8.0, False), (-0.9, 8.0, True), (-0.9, 4.0, False)],
)
@pytest.mark.parametrize("rate_hz", [1.0, 10.0])
def test_no_axle_that_rolls_gains_speed_for_long_under_the_brake(
    mps2: float, braked_s: float, impossible: bool, rate_hz: float
) -> None:
    """Once a second, or ten times; 3.3 s are looked at, where it has been braked for 3 s before."""
    times = np.arange(-round(3.2 * rate_hz), 1) / rate_hz
    recent = [(round((60.0 + t) * S), 40.0 * t - 0.5 * mps2 * t * t) for t in times.tolist()]
    rolling = Rolling(Wandering(mean=1e-4, learnt=60))
    course = Course(tuple(recent), braked_ns=round((60.0 - braked_s) * S), rolling=rolling)
    assert course.is_impossible(CONFIG, bank_of([1]), 0.5, rolled=True) == impossible
    assert not course.is_impossible(CONFIG, bank_of([1]), 0.5)


@pytest.mark.parametrize("size_m", [-2.0, -1.0, -0.5, -0.3, 0.3, 0.5, 2.0])
@pytest.mark.parametrize("rate_hz", [2.0, 5.0, 10.0])
def test_what_a_balise_corrects_is_no_slide(size_m: float, rate_hz: float) -> None:
    """Before it was one twice a second."""
    times, speeds = driven(0.2)
    places = placed(speeds, np.random.default_rng(4)) + size_m * (times > BRAKE_S + 6.0)
    state, estimates = followed(times, places, rate_hz)
    assert state.counts[Outcome.SLIDING] == 0
    assert abs(estimates[-1].speed_mps - speeds[-1]) < 5.0 * estimates[-1].speed_std_mps


@pytest.mark.parametrize("size_m", [-1.0, 1.0])
def test_a_step_in_what_comes_once_a_second_is_taken_for_a_slide(size_m: float) -> None:
    """One second of sliding looks the same. Those that came before do not count."""
    times, speeds = driven(0.2, begins_s=60.0)
    places = placed(speeds, np.random.default_rng(4)) + size_m * (times > 20.0)
    state, _ = followed(times, places + size_m * (times > 66.0), 1.0, begins_s=60.0)
    assert state.counts[Outcome.SLIDING] > 0
    state, _ = followed(times, places, 1.0, begins_s=60.0)
    assert state.counts[Outcome.SLIDING] == 0


def test_a_receiver_scatters_more_than_a_wheel() -> None:
    """Of 0.05 m white, wandering by half a metre over a minute, as the best; and one that wanders by nothing."""
    known: dict[tuple[str, float], int] = {}
    for name, white_m, wanders_m in (("wheel", 0.006, 0.0), ("receiver", 0.05, 0.5)):
        for rate_hz in (1.0, 10.0):
            for seed in range(40):
                rng, course, error = np.random.default_rng(seed), Course(), 0.0
                for index in range(round(12.0 * rate_hz)):
                    error += wanders_m * math.sqrt(2.0 / rate_hz / 60.0) * rng.standard_normal()
                    place = 30.0 * index / rate_hz + error + white_m * rng.standard_normal()
                    course = course.after(S + round(index / rate_hz * S), place, False, None)
                    for _ in range(round(2.0 / rate_hz)) or range(index % 5 == 0):
                        course = course.rolled(30.0)
                known[name, rate_hz] = known.get((name, rate_hz), 0) + course.rolling.is_known
    assert known == {("wheel", 1.0): 40, ("wheel", 10.0): 40, ("receiver", 1.0): 0, ("receiver", 10.0): 0}


@pytest.mark.parametrize("step_m", [0.0513, 0.0777, 0.2617, 0.4223])
def test_positions_in_steps_of_an_odd_length_are_pulses(step_m: float) -> None:
    assert _stepped(step_m).are_pulses


@pytest.mark.parametrize("step_m", [0.01, 0.05, 0.0625, 0.1, 0.125, 0.25, 0.3048, 1.0, 1.609344, 3.048, 5.0])
def test_rounded_positions_are_no_pulses(step_m: float) -> None:
    assert not _stepped(step_m).are_pulses


def _stepped(step_m: float) -> Coarse:
    coarse = Coarse()
    for position in step_m * np.cumsum(np.random.default_rng(2).integers(1, 9, 60)):
        coarse = coarse.after(float(position))
    return coarse


@pytest.mark.parametrize("pulse_m", [0.02, 0.2617])
def test_the_speed_by_an_axle_that_may_creep_is_told_so(pulse_m: float) -> None:
    """Held at 5 % of creep on a rail that limits."""
    times, speeds = driven(0.06, begins_s=60.0)
    creep = 0.05 * np.clip((times - 61.0) / 8.0, 0.0, 1.0)
    places = placed(speeds * (1.0 - creep), np.random.default_rng(3), pulse_m)
    state, estimates = followed(times, places, 5.0, begins_s=60.0)
    assert state.counts[Outcome.SLIDING] == 0
    assert abs(estimates[-1].speed_mps - speeds[-1]) < 3.0 * estimates[-1].speed_std_mps


@pytest.mark.parametrize("count", [4, 5, 12])
def test_a_step_changes_no_deceleration_that_allows_for_it(count: int) -> None:
    time = np.sort(-np.random.default_rng(count).uniform(0.0, 3.3, count))
    weights = _stepping(time)
    for index in range(count - 1):
        places = 7.0 + 20.0 * time - 0.6 * time**2 - 3.0 * (np.arange(count) > index)
        assert places @ weights[:, index] == pytest.approx(1.2)


def test_what_a_grade_does_that_is_told_is_possible() -> None:
    level, climbing, falling = (
        possible_of(dataclasses.replace(CONFIG, track=track), bank_of([1]), np.zeros(1))
        for track in (Track((Grade(-1000.0, 9000.0, rise_m),)) for rise_m in (0.0, 200.0, -200.0))
    )
    assert climbing.most_mps2 - level.most_mps2 == pytest.approx(9.8 * 0.02)
    assert level.least_mps2 - falling.least_mps2 == pytest.approx(9.8 * 0.02)
    assert falling.most_mps2 == level.most_mps2
    assert climbing.least_mps2 == level.least_mps2


def test_a_wheel_that_has_slid_far_within_a_second_is_no_outlier() -> None:
    """Once a second, by 30 % at once: the first position that shows it is enough. Before it took two of them."""
    times, speeds = driven(0.07)
    creep = 0.3 * np.clip((times - BRAKE_S - 1.2) / 0.6, 0.0, 1.0)
    _, estimates = followed(times, placed(speeds * (1.0 - creep), np.random.default_rng(1)), 1.0)
    assert min((each.t_ns - S) / S for each in estimates if each.withheld) == pytest.approx(BRAKE_S + 2.0)


@pytest.mark.parametrize(("rise_m", "impossible"), [(40.0, False), (0.0, True)])
def test_a_climb_that_a_tram_has_just_left_slowed_it_down(rise_m: float, impossible: bool) -> None:
    bank = bank_of([1])
    ends_m = bank.mean_of(POSITION) - 35.0
    track = Track((Grade(ends_m - 1000.0, ends_m, rise_m),), train_length_m=30.0)
    recent = [(round((60.0 + t) * S), 40.0 * t - 0.8 * t * t) for t in (H * np.arange(-33, 1)).tolist()]
    course = Course(tuple(recent), braked_ns=round(52.0 * S), rolling=Rolling(Wandering(mean=1e-4, learnt=60)))
    config = dataclasses.replace(CONFIG, track=track)
    assert course.is_impossible(config, bank, 0.5, rolled=True) == impossible
