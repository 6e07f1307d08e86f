# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Positions that hardly wander, as an odometer's: what no brake gives is seen of a gentle slide, too."""

from __future__ import annotations

import math

import numpy as np
import pytest
from banks import CONFIG, FULL, FULL_PA, S, bank_of
from oracles import specific_resistance

from adhesion_node.core import Measurement, Outcome, State, init, step
from adhesion_node.core.bank.sensors import plausible, wandering
from adhesion_node.core.estimate import Estimate
from adhesion_node.core.physics.train import Array

BRAKE_S, END_S, H = 45.0, 63.0, 0.1
TIMES = np.arange(round(END_S / H)) * H


def truth(mu: float) -> tuple[Array, Array]:
    """Positions and speeds every 0.1 s: traction holds the speed, then a full brake."""
    places, speeds, s, speed = [], [], 0.0, 40.0
    for t in TIMES:
        places.append(s)
        speeds.append(speed)
        slowing = 9.8 * (min(mu, FULL) + float(specific_resistance(np.array(speed)))) if t >= BRAKE_S else 0.0
        s, speed = s + H * speed - 0.5 * H * H * slowing, speed - H * slowing
    return np.array(places), np.array(speeds)


def of_axle(speeds: Array, creep: float, seed: int) -> Array:
    """Positions of an axle whose creep grows within 3 s of braking, and is held; each is off by 0.1 m."""
    rim = speeds * (1.0 - creep * np.clip((TIMES - BRAKE_S - 0.5) / 3.0, 0.0, 1.0))
    way = np.concatenate(([0.0], np.cumsum(0.5 * H * (rim[1:] + rim[:-1]))))
    return np.asarray(way + 0.1 * np.random.default_rng(seed).standard_normal(way.size))


def followed(positions: Array, std: float = 0.5) -> tuple[State, list[Estimate]]:
    state, estimates = init(CONFIG, 1), []
    for t, position in zip(TIMES.tolist(), positions.tolist(), strict=True):
        measurement = Measurement(S + round(t * S), position, std**2, FULL_PA if t >= BRAKE_S else 0.0)
        state, estimate = step(CONFIG, state, measurement)
        estimates += [] if estimate is None else [estimate]
    return state, estimates


@pytest.mark.parametrize("creep", [0.08, 0.12])
@pytest.mark.parametrize("seed", range(3))
def test_an_axle_that_begins_to_slide_gently_is_caught(creep: float, seed: int) -> None:
    """Before: its positions were believed, and the speed told was too low by the creep."""
    _, speeds = truth(0.08)
    state, estimates = followed(of_axle(speeds, creep, seed))
    assert state.counts[Outcome.SLIDING] > 0
    assert min((each.t_ns - S) / S for each in estimates if each.withheld) < BRAKE_S + 6.0
    last = estimates[-1]
    assert abs(last.speed_mps - speeds[-1]) < 3.0 * last.speed_std_mps


@pytest.mark.parametrize("mu", [0.03, 0.08, 0.2])
@pytest.mark.parametrize("seed", range(3))
def test_an_axle_that_rolls_and_a_receiver_as_smooth_are_believed(mu: float, seed: int) -> None:
    places, speeds = truth(mu)
    state, _ = followed(of_axle(speeds, 0.003, seed))
    assert not state.counts[Outcome.SLIDING]
    state, _ = followed(places + 0.03 * np.random.default_rng(seed).standard_normal(places.size))
    assert not state.counts[Outcome.SLIDING]


@pytest.mark.parametrize("worn", [0.98, 1.02])
def test_the_speed_by_positions_that_hardly_wander_is_known_as_a_wheels(worn: float) -> None:
    """Before: the speed of an odometer alone was told to within 0.1 m/s, and off by 0.8."""
    _, speeds = truth(0.2)
    _, estimates = followed(of_axle(worn * speeds, 0.0, 1), 0.1)
    for each in estimates:
        t_s = (each.t_ns - S) / S
        if t_s > BRAKE_S - 10.0:
            assert abs(each.speed_mps - np.interp(t_s, TIMES, speeds)) < 3.0 * each.speed_std_mps < 1.5


@pytest.mark.parametrize("seed", range(3))
def test_the_speed_by_satellites_is_told_as_well_as_it_is_known(seed: int) -> None:
    """They wander by half a metre over a minute, as the best that were recorded."""
    places, _ = truth(0.2)
    rng, wandering = np.random.default_rng(seed), [0.0]
    for shock in rng.standard_normal(TIMES.size - 1):
        wandering.append((1.0 - H / 60.0) * wandering[-1] + 0.5 * math.sqrt(2.0 * H / 60.0) * shock)
    _, estimates = followed(places + np.array(wandering) + 0.05 * rng.standard_normal(TIMES.size))
    assert max(each.speed_std_mps for each in estimates if each.t_ns > S + 40 * S) < 0.3


@pytest.mark.parametrize("size_m", [-2.0, -1.0, -0.5, 1.0])
@pytest.mark.parametrize("at_s", [BRAKE_S + 4.0, BRAKE_S + 9.0])
def test_a_balise_that_corrects_an_axle_that_rolls_is_no_slide(size_m: float, at_s: float) -> None:
    """On dry rail under the full brake, behind 45 s of positions that hardly wander."""
    for seed in range(3):
        _, speeds = truth(0.2)
        state, estimates = followed(of_axle(speeds, 0.003, seed) + size_m * (at_s < TIMES))
        assert not state.counts[Outcome.SLIDING], seed
        assert abs(estimates[-1].speed_mps - speeds[-1]) < 5.0 * estimates[-1].speed_std_mps


def test_what_is_learnt_is_how_fast_positions_wander() -> None:
    """Against positions that were drawn so; from few looks nothing, and no more than is known of any receiver."""
    rng, rate = np.random.default_rng(1), 0.01
    for tells, speed_mps in ((True, 30.0), (False, 1.0)):
        learnt = []
        for _ in range(20):
            course = plausible.Course()
            walk = np.cumsum(math.sqrt(2.0 * rate * H) * rng.standard_normal(600))
            for index, error in enumerate(walk.tolist()):
                course = course.after(S + round(index * H * S), 30.0 * index * H + error, False, None)
                course = course.rolled(speed_mps) if index % 5 == 4 else course
                if index == 250:
                    assert course.wandering.of(1.0) == 1.0
            learnt.append(course.wandering.mean)
            assert course.wandering.of(1e-4) == 1e-4
        assert np.mean(learnt) == pytest.approx(rate if tells else 0.0, rel=0.25)
    assert wandering.Wandering(mean=0.0, learnt=wandering.MOST).of(1.0) == wandering.FLOOR


def test_a_step_within_a_look_counts_for_no_more_than_it_may_bend_it() -> None:
    """One of 1 m wherever it lies within the look, in positions of a train that brakes as hard as it can."""
    bank, brake = bank_of([1]), 9.8 * 1.1 * FULL
    times, seen = np.arange(-30, 1) * H, []
    learnt = wandering.Wandering(mean=1e-4, learnt=wandering.MOST)
    for first in range(3, 28):
        places = 40.0 * times - 0.5 * brake * times**2 - 1.0 * (np.arange(31) >= first)
        recent = tuple((round((60.0 + t) * S), place) for t, place in zip(times.tolist(), places.tolist(), strict=True))
        course = plausible.Course(recent, braked_ns=round(50.0 * S), wandering=learnt)
        stepped = course.stepped(recent[first][0], -1.0)
        assert stepped.recent == recent
        assert not stepped.is_impossible(CONFIG, bank, 0.05)
        seen.append(course.is_impossible(CONFIG, bank, 0.05))
    assert any(seen), "of a slide it would be one"
