# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""An axle's odometer beside the wheels of all, an accelerometer that lies: once known the train is followed without."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from banks import CONFIG, FULL, FULL_PA, S, bank_of
from oracles import specific_resistance

from adhesion_node.core import Estimate, Measurement, Outcome, State, WheelSample, init, predict, step
from adhesion_node.core.bank.anew import MOST, unscaled
from adhesion_node.core.bank.following import followed as bank_followed
from adhesion_node.core.bank.layout import RADIUS, SPEED
from adhesion_node.core.bank.sensors.odometer import SCALE
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.intake.samples import ImuSample
from adhesion_node.core.physics.train import Array

BRAKE_S, COAST_S, AGAIN_S, H, AXLES = 30.0, 45.0, 60.0, 0.1, 8
TIMES = np.arange(round((AGAIN_S + 5.0) / H)) * H
RAIL = Rail(0.06, 0.03, 0.03)
ALL, TWO = slice(AXLES), slice(3, 5)
FOUND_S = 3.0
"""So long behind the brake axles have slid for two seconds."""


class Drive(NamedTuple):
    """A train that cruises, brakes on a rail that its axles slide on, coasts, and brakes again."""

    places: Array
    speeds: Array
    rims: Array
    """Shape (T, AXLES)."""


@cache
def drive(mu: float) -> Drive:
    """Protection lets each axle creep by up to 12 % and roll again, one behind the other."""
    speed, speeds = 40.0, []
    for t in TIMES:
        speeds.append(speed)
        slowing = 9.8 * (min(mu, FULL) + float(specific_resistance(np.array(speed)))) if braked(t) else 0.0
        speed -= H * slowing
    held = np.array(speeds)
    places = np.concatenate(([0.0], np.cumsum(0.5 * H * (held[1:] + held[:-1]))))
    phase = TIMES[:, None] / 2.0 + np.arange(AXLES) / AXLES
    slides = np.array([braked(t - 1.0) for t in TIMES])[:, None] & (mu < FULL)
    creep = np.where(slides, 0.06 * (1.0 - np.cos(2.0 * np.pi * phase)), 0.002)
    return Drive(places, held, held[:, None] * (1.0 - creep))


def braked(t_s: float) -> bool:
    """Whether the brake is applied."""
    return BRAKE_S <= t_s < COAST_S or t_s >= AGAIN_S


def followed(
    mu: float,
    positions: Array,
    std_m: float = 1.0,
    until_s: float = math.inf,
    felt: Array | None = None,
    heard: slice = ALL,
) -> tuple[State, list[Estimate], list[int]]:
    """What is told of it, and how many positions were left out by then as those of a sliding wheel.

    `felt` is what an accelerometer shows; the wheels are those of the axles that are `heard`.
    """
    state, estimates, left_out = init(CONFIG, 1), [], []
    noise = 0.02 * np.random.default_rng(7).standard_normal((TIMES.size, AXLES))
    for index, (t, place, rims) in enumerate(
        zip(TIMES.tolist(), positions.tolist(), drive(mu).rims + noise, strict=True)
    ):
        if t >= until_s:
            break
        t_ns = S + round(t * S)
        wheels = WheelSample(t_ns, tuple((rims[heard] / CONFIG.train.wheel_radius_m).tolist()))
        imu = () if felt is None else (ImuSample(t_ns, float(felt[index])),)
        pressure = FULL_PA if braked(t) else 0.0
        state, estimate = step(CONFIG, state, Measurement(t_ns, place, std_m**2, pressure, wheels=(wheels,), imu=imu))
        left_out.append(state.counts[Outcome.SLIDING])
        estimates += [] if estimate is None else [estimate]
    return state, estimates, left_out


def odometer(mu: float, axle: int, scale: float) -> Array:
    """Positions that it gives."""
    rim = drive(mu).rims[:, axle]
    way = np.concatenate(([0.0], np.cumsum(0.5 * H * (rim[1:] + rim[:-1]))))
    return np.asarray(scale * way + 0.03 * np.random.default_rng(axle).standard_normal(way.size))


def shortest_way(mu: float, speed_mps: float) -> float:
    """To a standstill on that rail, but for the resistance of the train."""
    return speed_mps**2 / (2.0 * 9.8 * (mu + float(specific_resistance(np.array(speed_mps)))))


@pytest.mark.parametrize("mu", [0.03, 0.06])
@pytest.mark.parametrize(
    ("axle", "scale", "heard", "times"),
    [(0, 1.0, ALL, 2.0), (3, 1.008, ALL, 2.0), (7, 0.992, ALL, 2.0), (3, 1.0, TWO, 5.0), (4, 0.992, TWO, 5.0)],
)
def test_the_train_is_followed_by_its_wheels(mu: float, axle: int, scale: float, heard: slice, times: float) -> None:
    """Before: its positions were believed, or the train was followed blind and its curve many times too long.

    Two wheels may well creep alike: the curve allows for it.
    """
    state, estimates, left_out = followed(mu, odometer(mu, axle, scale), heard=heard)
    truth = drive(mu)
    braking = [each for each in estimates if BRAKE_S + FOUND_S < each.t_ns / S - 1.0 < COAST_S]
    assert len(braking) > 20
    for each in braking:
        true = float(np.interp(each.t_ns / S - 1.0, TIMES, truth.speeds))
        safe = predict(CONFIG, each).safe
        assert not each.withheld
        assert abs(each.speed_mps - true) < 3.0 * each.speed_std_mps < 3.0
        assert each.mu_lower <= mu
        assert safe is not None
        assert safe.distance_m[-1] > shortest_way(mu, true)
    assert safe is not None
    assert safe.distance_m[-1] < times * shortest_way(mu, true)
    assert 0.8 * mu < braking[-1].mu < 1.2 * mu
    coasting, again = (np.array(left_out)[(start < TIMES) & (end > TIMES)] for start, end in ((50, 59), (62, 65)))
    assert coasting[0] == coasting[-1]
    assert np.all(np.diff(again) == 1)  # one look at a slide is enough, this time
    assert state.memory is not None
    assert state.memory.aside


@pytest.mark.parametrize("mu", [0.03, 0.06, 0.2])
@pytest.mark.parametrize("white_m", [0.02, 0.1, 0.3])
def test_satellites_lead_though_axles_slide(mu: float, white_m: float) -> None:
    rng = np.random.default_rng(5)
    positions = drive(mu).places + white_m * rng.standard_normal(TIMES.size)
    state, _, _ = followed(mu, positions)
    assert not state.counts[Outcome.SLIDING]


def satellites(mu: float, seed: int) -> Array:
    """Positions of a receiver that is as quiet as an odometer, and wanders by 0.5 m over 30 s."""
    rng, wandering = np.random.default_rng(seed), [0.0]
    for shock in rng.standard_normal(TIMES.size - 1):
        wandering.append((1.0 - H / 30.0) * wandering[-1] + 0.5 * math.sqrt(2.0 * H / 30.0) * shock)
    return np.asarray(drive(mu).places + np.array(wandering) + 0.05 * rng.standard_normal(TIMES.size))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("gone", ["positions", "wheels", "one wheel hangs"])
def test_a_gap_under_the_brake_makes_no_odometer_of_satellites(gone: str, seed: int) -> None:
    """The train was taken to be as fast as before the gap, or as a wheel that hangs: what rolls seemed to slide."""
    state, mu, turns = init(CONFIG, 1), 0.06, drive(0.06).rims / CONFIG.train.wheel_radius_m
    turns = turns + 0.05 * np.random.default_rng(seed).standard_normal(turns.shape)
    hung = turns[TIMES > BRAKE_S + 2.0][0]
    for index, (t, place) in enumerate(zip(TIMES.tolist(), satellites(mu, seed).tolist(), strict=True)):
        t_ns, away = S + round(t * S), BRAKE_S + 2.0 < t < BRAKE_S + 12.0
        seen = (math.nan,) * AXLES if gone == "wheels" and away else tuple(turns[index].tolist())
        seen = (*seen[:-1], float(hung[-1])) if gone == "one wheel hangs" and t > BRAKE_S + 2.0 else seen
        variance = math.inf if gone == "positions" and away else 0.25
        pressure = FULL_PA if braked(t) else 0.0
        wheels = (WheelSample(t_ns, seen),)
        state, _ = step(CONFIG, state, Measurement(t_ns, place, variance, pressure, wheels=wheels))
        assert not state.odometer.is_found, t
    assert not state.counts[Outcome.SLIDING]


@pytest.mark.parametrize("seed", range(3))
def test_axles_that_span_until_the_brake_make_no_odometer_of_satellites(seed: int) -> None:
    """Five of eight spin by 15 %: the train was taken to be as fast, and what rolls under the brake seemed to slide."""
    rng, state, speed, place = np.random.default_rng(seed), init(CONFIG, 1), 20.0, 0.0
    for tick in range(400):
        brakes, t_ns = tick >= 300, S + tick * S // 10
        creep = np.zeros(AXLES)
        creep[:5] = -0.15 * (260 <= tick <= 301)
        creep[:2] += (0.08 + 0.02 * math.sin(tick / 13.0)) * (tick > 330)
        turns = speed * (1.0 - creep) * (1.0 + 0.002 * rng.standard_normal(AXLES)) / CONFIG.train.wheel_radius_m
        seen = place + 0.05 * float(rng.standard_normal())
        wheels = (WheelSample(t_ns, tuple(turns.tolist())),)
        state, _ = step(CONFIG, state, Measurement(t_ns, seen, 0.25, FULL_PA * brakes, wheels=wheels))
        assert not state.odometer.is_found, tick
        place, speed = place + H * speed, speed + H * (-0.5 if brakes else 0.5)


def turned(mu: float) -> Array:
    """What an accelerometer that is turned round shows."""
    return np.asarray(-np.gradient(drive(mu).speeds, H) + 0.05 * np.random.default_rng(3).standard_normal(TIMES.size))


@pytest.mark.parametrize(("mu", "dead"), [(0.02, False), (0.02, True), (0.06, True)])
def test_an_accelerometer_that_lies_leaves_nothing_behind_beside_an_odometer(mu: float, dead: bool) -> None:
    """Whichever is found first. Some of it was left in the speed, 0.3 to 0.5 m/s, for seconds."""
    positions, until_s = odometer(mu, 3, 1.0), BRAKE_S + 14.0
    felt = np.zeros(TIMES.size) if dead else turned(mu)
    state, estimates, _ = followed(mu, positions, until_s=until_s, felt=felt)
    _, alone, _ = followed(mu, positions, until_s=until_s)
    assert state.memory is not None
    assert state.memory.aside
    assert state.memory.pointing.lies
    for one, other in zip(estimates, alone, strict=True):
        if one.t_ns > S + round((BRAKE_S + 6.0) * S):
            assert one.speed_mps == pytest.approx(other.speed_mps, abs=0.05)
            assert one.mu == pytest.approx(other.mu, rel=0.05)


def missed(places: Array, seed: int) -> Array:
    """Such positions, of which every seventh is off by tens of metres or more."""
    rng = np.random.default_rng(seed)
    return np.asarray(places + np.where(rng.random(TIMES.size) < 0.15, 60.0 * rng.standard_normal(TIMES.size), 0.0))


@pytest.mark.parametrize("seed", range(3))
def test_an_accelerometer_that_lies_leaves_nothing_behind_where_it_made_positions_seem_a_sliding_wheels(
    seed: int,
) -> None:
    """Wheels and the lie led on together, in one of three cases: the train was taken to be 6 m/s faster than it was."""
    positions = missed(satellites(0.02, seed), seed)
    _, estimates, _ = followed(0.02, positions, 0.5, BRAKE_S + 14.0, turned(0.02))
    for each in estimates:
        if each.t_ns > S + round((BRAKE_S + 10.0) * S):
            true = float(np.interp(each.t_ns / S - 1.0, TIMES, drive(0.02).speeds))
            assert each.speed_mps == pytest.approx(true, abs=0.3)


def test_what_is_gone_back_over_holds_what_was_not_believed_too() -> None:
    """Pressures, wheels and accelerations of the time stand beside such a position."""
    state, _, _ = followed(0.06, missed(drive(0.06).places, 1), until_s=BRAKE_S + 10.0)
    assert state.counts[Outcome.OUTLIER] > 10
    assert len(state.anew.since) == 100
    assert state.anew.before is not None
    assert state.anew.before.t_ns < state.anew.since[0].t_ns == S + round(BRAKE_S * S)


def test_behind_the_longest_way_back_another_begins() -> None:
    """Positions that were found to be an axle's only then led on, until the physical check left the train blind."""
    state, _, _ = followed(0.2, odometer(0.2, 3, 1.0), until_s=BRAKE_S + 3.0)
    before = state.memory
    assert before is not None
    full = state.anew._replace(since=state.anew.since[:1] * MOST)
    measurement = state.anew.since[-1]
    later, t_ns = full, before.t_ns
    memory = before
    for tick in range(1, 4):
        measurement = measurement._replace(t_ns=t_ns + tick * S // 10, variance_m2=math.inf)
        after = bank_followed(CONFIG, memory, measurement, lambda: RAIL)
        memory, later = later.after(CONFIG, memory, after, measurement, tick == 3)
    assert len(later.since) == 3
    assert memory.aside
    assert memory.braked


@pytest.mark.parametrize("scale", [1.008, 0.992])
def test_an_odometer_whose_axle_rolls_leads_and_its_scale_is_not_trusted(scale: float) -> None:
    """Before: the speed was told to within 0.1 m/s, and off by 0.3."""
    state, estimates, _ = followed(0.2, odometer(0.2, 3, scale))
    assert not state.counts[Outcome.SLIDING]
    for each in estimates[30:]:
        true = float(np.interp(each.t_ns / S - 1.0, TIMES, drive(0.2).speeds))
        assert abs(each.speed_mps - true) < 3.0 * each.speed_std_mps < 1.5


def test_the_speed_by_satellites_and_wheels_is_told_as_well_as_it_is_known() -> None:
    _, estimates, _ = followed(0.2, satellites(0.2, 5), 0.1)
    assert max(each.speed_std_mps for each in estimates[30:]) < 0.2


@pytest.mark.parametrize("step_m", [-6.0, 6.0])
def test_what_a_balise_corrects_is_no_noise_of_the_odometer(step_m: float) -> None:
    state, _, left_out = followed(0.06, odometer(0.06, 3, 1.0) + step_m * (TIMES > BRAKE_S - 3.0))
    assert left_out[round((BRAKE_S + FOUND_S + 1.0) / H)] > 0
    assert state.odometer.is_found


def test_what_the_speed_is_off_by_the_radii_are_the_other_way() -> None:
    """The speeds of the rims are known as well as before."""
    bank = bank_of([2, 3])
    after = unscaled(bank)
    more = after.covariance - bank.covariance
    np.testing.assert_allclose(more[:, SPEED, SPEED], (SCALE * bank.mean[:, SPEED]) ** 2)
    slope = np.zeros(bank.mean.shape)
    slope[:, SPEED], slope[:, RADIUS] = 1.0 + bank.mean[:, RADIUS], bank.mean[:, SPEED]
    np.testing.assert_allclose(np.einsum("hi,hij,hj->h", slope, more, slope), 0.0, atol=1e-9)
    assert math.isclose(float(np.linalg.eigvalsh(more).min()), 0.0, abs_tol=1e-9)
