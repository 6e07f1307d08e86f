# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Sensors that lie under the brake: a speed or a position that repeats itself, an accelerometer turned or dead."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from banks import CONFIG, FULL, S, braked_run, measurements

from adhesion_node.core import ImuSample, Measurement, Outcome, SpeedSample, State, init, step
from adhesion_node.core.estimate import Estimate
from adhesion_node.core.physics.train import Array

BRAKE_S, H = 5.0, 0.1
DRY, WET = 0.3, 0.06


class Run(NamedTuple):
    """A braking, with the sensors that it was measured by and what came of it."""

    times: Array
    speeds: Array
    state: State
    estimates: list[Estimate]

    def speed_at(self, estimate: Estimate) -> float:
        return float(np.interp((estimate.t_ns - S) / S, self.times, self.speeds))


def held(values: Array, times: Array, from_s: float, until_s: float, shown: float | None = None) -> Array:
    """The same again and again from one time to another: what is `shown`, or the first."""
    kept, when = values.copy(), (times >= from_s) & (times < until_s)
    kept[when] = values[times >= from_s][0] if shown is None else shown
    return kept


def run(
    mu: float,
    seed: int,
    *,
    seconds: float = 30.0,
    speed: tuple[float, float, float] | None = None,
    place: tuple[float, float] = (0.0, 0.0),
    imu: tuple[float, float] | None = None,
    bias_mps2: float = 0.0,
    coarse_mps: float = 0.0,
    speed_mps: float = 70.0,
    held_mps: float | None = None,
    died: tuple[float, float | None] = (99.0, 0.0),
) -> Run:
    """`speed`: noise, and from when to when it is held, or `held_mps` is shown; `place`: the same.

    `imu`: factor and noise; `died`: from when it shows what.
    """
    rng = np.random.default_rng(seed + 100)
    times, truth, places = braked_run(mu, seed, seconds, speed_mps=speed_mps)
    measured = measurements(times, held(places, times, *place), 0.3)
    if speed is not None:
        noise, begin_s, end_s = speed
        shown = truth[:, 1] + noise * rng.standard_normal(times.size)
        shown = np.floor(shown / coarse_mps) * coarse_mps if coarse_mps else shown
        shown = held(shown, times, begin_s, end_s, held_mps)
        variance = (noise or 0.03) ** 2
        measured = [
            each._replace(speeds=(SpeedSample(each.t_ns, float(v), variance),))
            for each, v in zip(measured, shown, strict=True)
        ]
    if imu is not None:
        factor, noise = imu
        felt = factor * np.gradient(truth[:, 1], H) + bias_mps2 + noise * rng.standard_normal(times.size)
        felt = felt if died[0] > seconds else held(felt, times, died[0], math.inf, died[1])
        measured = [
            each._replace(imu=(ImuSample(each.t_ns, float(a), (noise or 0.05) ** 2),))
            for each, a in zip(measured, felt, strict=True)
        ]
    return Run(times, truth[:, 1], *followed(measured))


def followed(measured: list[Measurement]) -> tuple[State, list[Estimate]]:
    config = replace(CONFIG, speed_source="doppler")
    state, estimates = init(config, 1), list[Estimate]()
    for each in measured:
        state, estimate = step(config, state, each)
        estimates += [] if estimate is None else [estimate]
    return state, estimates


def assert_known(found: Run, mu: float, from_s: float, until_s: float) -> None:
    """The estimates of a time hold: the speed within what is told, the bound below what is used."""
    told = [each for each in found.estimates if from_s <= (each.t_ns - S) / S < until_s]
    assert len(told) >= 2 * (until_s - from_s) - 1
    for each in told:
        assert not each.withheld
        assert each.speed_mps == pytest.approx(found.speed_at(each), abs=max(3.5 * each.speed_std_mps, 0.15))
        assert each.mu_lower <= min(mu, FULL) + 1e-3


@pytest.mark.parametrize("mu", [DRY, WET, 0.03])
@pytest.mark.parametrize("seed", range(3))
def test_a_speed_that_repeats_itself_under_the_brake_is_left_out(mu: float, seed: int) -> None:
    found = run(mu, seed, speed=(0.08, 12.0, 14.0))
    assert 8 <= found.state.counts[Outcome.STUCK] <= 20
    assert found.state.counts[Outcome.SLIDING] == found.state.counts[Outcome.RESET] == 0
    assert_known(found, mu, 11.0, 20.0)


def test_a_speed_that_hung_before_the_brake_was_applied_is_left_out() -> None:
    found = run(DRY, 0, speed=(0.08, 3.0, 9.0))
    assert found.state.counts[Outcome.STUCK] > 20
    assert_known(found, DRY, 8.0, 20.0)


@pytest.mark.parametrize("mu", [DRY, WET, 0.03])
@pytest.mark.parametrize(("from_s", "until_s"), [(0.0, 99.0), (3.0, 99.0), (12.0, 99.0), (12.0, 14.0)])
def test_a_receiver_that_tells_a_standstill_of_a_train_that_runs_is_left_out(
    mu: float, from_s: float, until_s: float
) -> None:
    """As one does that has lost its satellites."""
    found = run(mu, 1, speed=(0.08, from_s, until_s), held_mps=0.0)
    assert found.state.counts[Outcome.STUCK] >= 19
    assert from_s == 0.0 or found.state.counts[Outcome.RESET] == 0  # from the start on nothing belies it
    assert_known(found, mu, 11.0, 25.0)


@pytest.mark.parametrize("from_s", [0.0, 3.0, 11.0])
@pytest.mark.parametrize("mu", [DRY, WET, 0.03])
def test_a_speed_of_half_the_positions_is_left_out(mu: float, from_s: float) -> None:
    times, truth, places = braked_run(mu, 1, 30.0)
    shown = np.where(times < from_s, 1.0, 0.5) * truth[:, 1]
    measured = [
        each._replace(speeds=(SpeedSample(each.t_ns, float(v), 0.05**2),))
        for each, v in zip(measurements(times, places, 0.3), shown, strict=True)
    ]
    found = Run(times, truth[:, 1], *followed(measured))
    assert found.state.counts[Outcome.STUCK] > 50
    assert_known(found, mu, from_s + 11.0, 29.0)


def test_a_train_that_stops_stands() -> None:
    """A receiver tells that it does from 1 m/s on."""
    found = run(DRY, 1, seconds=22.6, speed=(0.08, 21.6, 99.0), held_mps=0.0, speed_mps=17.0)
    assert found.state.counts[Outcome.STUCK] == 0
    assert found.estimates[-1].speed_mps == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("coarse_mps", [0.1, 1.0 / 3.6, 0.44704])
@pytest.mark.parametrize("mu", [DRY, WET, 0.02])
def test_a_coarse_speed_repeats_itself_and_is_used(mu: float, coarse_mps: float) -> None:
    found = run(
        mu, 1, seconds=60.0, speed=(0.0, 0.0, 0.0), coarse_mps=coarse_mps, speed_mps=25.0
    )  # on dry rail it stands
    assert found.state.counts[Outcome.STUCK] == 0


@pytest.mark.parametrize("mu", [DRY, WET, 0.03])
@pytest.mark.parametrize("seed", range(3))
def test_an_accelerometer_that_is_turned_round_is_left_out(mu: float, seed: int) -> None:
    found = run(mu, seed, imu=(-1.0, 0.05))
    assert found.state.counts[Outcome.TURNED] > 200
    assert found.state.counts[Outcome.SLIDING] == found.state.counts[Outcome.RESET] == 0
    assert_known(found, mu, 9.0, 25.0)


@pytest.mark.parametrize("mu", [DRY, WET, 0.03])
@pytest.mark.parametrize("seed", range(3))
def test_an_accelerometer_that_shows_nothing_is_left_out(mu: float, seed: int) -> None:
    found = run(mu, seed, imu=(0.0, 0.0))
    assert found.state.counts[Outcome.STUCK] > 200
    assert found.state.counts[Outcome.SLIDING] == found.state.counts[Outcome.RESET] == 0
    assert_known(found, mu, 9.0, 25.0)


@pytest.mark.parametrize("mu", [DRY, WET, 0.03])
@pytest.mark.parametrize("shown", [0.0, None])
def test_an_accelerometer_that_dies_under_the_brake_is_left_out(mu: float, shown: float | None) -> None:
    found = run(mu, 1, imu=(1.0, 0.05), died=(12.0, shown))
    assert found.state.counts[Outcome.STUCK] > 170
    assert found.state.counts[Outcome.SLIDING] == found.state.counts[Outcome.RESET] == 0
    assert_known(found, mu, 14.0, 25.0)


@pytest.mark.parametrize("noise", [0.05, 1.0])
@pytest.mark.parametrize("mu", [DRY, WET, 0.02])
def test_an_accelerometer_that_points_forward_is_used(mu: float, noise: float) -> None:
    found = run(mu, 2, imu=(1.0, noise))
    assert found.state.counts[Outcome.TURNED] == 0


@pytest.mark.parametrize("bias_mps2", [-0.34, 0.34, 0.6])
@pytest.mark.parametrize("mu", [DRY, WET, 0.03])
def test_an_accelerometer_mounted_by_eye_is_used(mu: float, bias_mps2: float) -> None:
    """By 2 degrees nose down or up; by 4 it feels the brake push the train forward on a film of leaves."""
    found = run(mu, 1, imu=(1.0, 0.05), bias_mps2=bias_mps2)
    assert found.state.counts[Outcome.TURNED] == found.state.counts[Outcome.SLIDING] == 0
    assert_known(found, mu, 9.0, 25.0)


def test_other_sensors_go_on_where_a_position_is_stuck() -> None:
    found = run(WET, 0, speed=(0.08, 0.0, 0.0), place=(12.0, 18.0))
    assert found.state.counts[Outcome.STUCK] > 40
    assert_known(found, WET, 11.0, 25.0)
