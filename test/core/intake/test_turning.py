# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Wheels that tell rpm, km/h or m/s, or have another radius, are left out by what positions show without a brake."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from adhesion_node.core import Config, Measurement, Outcome, State, WheelSample, init, step

S, HZ, RADIUS_M, AXLES = 10**9, 10, 0.46, 4


def coasted(
    ratio: float,
    *,
    seconds: float = 20.0,
    mps: float = 40.0,
    pressure_pa: float | None = 0.0,
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
        place = (mps * index / HZ + 0.5 * rng.standard_normal(), 0.25) if placed(index) else (0.0, math.inf)
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
    assert "multiply rpm by 0.1047, divide m/s by the radius; or is train.wheel_radius_m another?" in said


@pytest.mark.parametrize(
    "state",
    [
        coasted(1.0),
        coasted(0.8),
        coasted(1.3),
        coasted(0.5, pressure_pa=100e3),
        coasted(0.5, pressure_pa=None),
        coasted(0.5, mps=10.0),
        coasted(0.5, seconds=5.0),
        coasted(1.0, placed=lambda index: index % 10 == 0),
    ],
    ids=["right", "small", "large", "braked", "untold", "slow", "short", "1 Hz"],
)
def test_wheels_that_may_slide_or_are_hardly_known_are_used(state: State) -> None:
    assert state.counts[Outcome.WHEEL_UNIT] == state.counts[Outcome.RESET] == 0


def test_a_receiver_that_is_slow_shows_it_as_well() -> None:
    assert coasted(2.0, placed=lambda index: index % 10 == 0).counts[Outcome.WHEEL_UNIT] > 100
