# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Wheels in rpm, km/h or m/s, or of another radius, and positions in km, show as such while no brake is applied."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from adhesion_node.core import Config, Measurement, Outcome, State, WheelSample, init, step
from adhesion_node.core.intake.turning import Turning

S, HZ, RADIUS_M, AXLES = 10**9, 10, 0.46, 4


def coasted(
    ratio: float,
    *,
    seconds: float = 20.0,
    mps: float = 40.0,
    pressure_pa: float | None = 0.0,
    scale: float = 1.0,
    placed: Callable[[int], bool] = lambda index: True,
    method: str = "bank",
) -> State:
    """A train that runs at a speed, whose rims turn so many times as fast."""
    config = replace(Config(method=method), speed_source="doppler")
    state, rng = init(config, 1), np.random.default_rng(1)
    for index in range(round(seconds * HZ)):
        t_ns = S + index * S // HZ
        radps = ratio * mps / RADIUS_M * (1.0 + 0.005 * rng.standard_normal(AXLES))
        wheels = (WheelSample(t_ns, tuple(radps.tolist())),)
        measured_m = scale * (mps * index / HZ + 0.5 * rng.standard_normal())
        place = (measured_m, 0.25) if placed(index) else (0.0, math.inf)
        state, _ = step(config, state, Measurement(t_ns, *place, pressure_pa, wheels=wheels))
    return state


@pytest.mark.parametrize("ratio", [RADIUS_M, 3.6 * RADIUS_M, 60.0 / math.tau, 0.6])
@pytest.mark.parametrize("method", ["bank", "rail_condition"])
def test_wheels_in_another_unit_are_left_out_and_told(ratio: float, method: str) -> None:
    state = coasted(ratio, method=method)
    assert state.counts[Outcome.WHEEL_UNIT] > 120
    assert state.counts[Outcome.RESET] == 1, "the train is met anew"
    assert state.followed_mps == pytest.approx(40.0, abs=0.5)
    said = str(state.events[-1])
    assert said.startswith(f"wheel_speed: rims at {ratio:.2g} times the speed of the positions: left out until")
    assert "multiply rpm by 0.1047, divide m/s by the radius; or is train.wheel_radius_m another, or" in said


@pytest.mark.parametrize(
    "run",
    [
        partial(coasted, 1.0),
        partial(coasted, 0.8),
        partial(coasted, 1.3),
        partial(coasted, 0.5, pressure_pa=100e3),
        partial(coasted, 0.5, pressure_pa=None),
        partial(coasted, 0.5, mps=10.0),
        partial(coasted, 0.5, seconds=5.0),
        partial(coasted, 1.0, placed=lambda index: index % 10 == 0),
    ],
    ids=["right", "small", "large", "braked", "untold", "slow", "short", "1 Hz"],
)
def test_wheels_that_may_slide_or_are_hardly_known_are_used(run: Callable[[], State]) -> None:
    state = run()  # by the test: what stands among its parameters every worker runs
    assert state.counts[Outcome.WHEEL_UNIT] == state.counts[Outcome.RESET] == 0


def test_a_receiver_that_is_slow_shows_it_as_well() -> None:
    assert coasted(2.0, placed=lambda index: index % 10 == 0).counts[Outcome.WHEEL_UNIT] > 100


@pytest.mark.parametrize("scale", [1e-3, 1 / 1609.3])
@pytest.mark.parametrize("method", ["bank", "rail_condition"])
def test_positions_in_km_are_left_out_beside_wheels_and_told(scale: float, method: str) -> None:
    state = coasted(1.0, scale=scale, method=method)
    assert state.counts[Outcome.POSITION_UNIT] > 120
    assert "are they in km, not in m" in str(state.events[-1])
    assert state.counts[Outcome.WHEEL_UNIT] == 0
    if method == "bank":
        assert state.followed_mps == pytest.approx(40.0, abs=2.0), "by the wheels"


def turned(turning: Turning, rims_mps: float, running_mps: float, spans: int = 1) -> Turning:
    """After so many spans, from where it is."""
    for _ in range(spans):
        t_ns, place_m = turning.since_ns or S, turning.position_m
        for at_ns, at_m in ((t_ns, place_m), (t_ns + 2 * S, place_m + 2.0 * running_mps)):
            turning = turning.after(Measurement(at_ns, at_m, 0.25), (rims_mps,), braked=False)
    return turning


def test_wheels_that_spin_now_and_then_are_no_other_unit_of_the_positions() -> None:
    spun = Turning()
    for _ in range(3):
        spun = turned(turned(spun, 20.0, 0.2), 2.0, 2.0)
    assert not spun.crawls
    assert not turned(Turning(), 40.0, 0.0, 9).crawls, "the same to the bit: it is stuck"


def test_positions_are_believed_again_once_they_run() -> None:
    crawling = turned(Turning(), 40.0, 0.04, 3)
    assert crawling.crawls
    assert crawling.after(Measurement(9 * S, 0.0, 0.25), (), braked=True).crawls
    assert turned(crawling, 2.0, 0.002).crawls, "a slow train tells nothing"
    assert not turned(crawling, 40.0, 40.0).crawls
    left_out, (told,) = crawling.believed(Measurement(9 * S, 1.5, 0.25))
    assert (left_out.has_position, told.detail) == (False, "position x = 1.5, wheels turn")
