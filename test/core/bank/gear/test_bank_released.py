# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A brake that lets go, or that no gauge shows: it tells nothing of the rail, and wheels may slide all the same."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from banks import FULL_PA, S
from pressures import cycling

from adhesion_node.core.config import Config
from adhesion_node.core.estimate import Estimate
from adhesion_node.core.estimator import init, step
from adhesion_node.core.intake.samples import Measurement, PressureSample, WheelSample

AXLES, USED = 8, 0.035
Shape = Callable[[float], float]


def by_gauge(heard: PressureSample) -> dict[str, Any]:
    """What a gauge tells of the brake."""
    return {"brake_pressure_pa": heard.pressure_pa, "pressures": (heard,)}


def by_handle(heard: PressureSample) -> dict[str, Any]:
    """What a driver's handle tells of it."""
    return {"demand_pa": heard.pressure_pa}


def ridden(
    config: Config,
    seed: int,
    seconds: float,
    used: Shape,
    creep: Shape,
    pressure: Shape,
    *,
    told_by: Callable[[PressureSample], dict[str, Any]] = by_gauge,
    every: int = 1,
    dark_s: float = np.inf,
) -> list[tuple[float, float, Estimate]]:
    """Coast for 15 s from 30 m/s, then use so much adhesion; time behind that, true speed and estimate of each.

    Axles creep by so much, one after the other; all is heard 10 times a second, a position at `every` of them with an
    error of 0.3 m, from `dark_s` on none.
    """
    rng, state, speed, place = np.random.default_rng(seed), init(config, 1), 30.0, 0.0
    told = list[tuple[float, float, Estimate]]()
    for tick in range(round(10.0 * (15.0 + seconds))):
        time, t_ns = 0.1 * tick - 15.0, S + tick * S // 10
        own = creep(time) * (0.75 + 0.25 * np.sin(2.0 * time + np.arange(AXLES)))
        rims = speed * (1.0 - own) * (1.0 + 5e-4 * rng.standard_normal(AXLES))
        wheels = (WheelSample(t_ns, tuple((rims / config.train.wheel_radius_m).tolist())),)
        heard = PressureSample(t_ns, pressure(time) + 300.0 * abs(float(rng.standard_normal())))
        seen = place + 0.3 * float(rng.standard_normal())
        variance_m2 = 1.0 if tick % every == 0 and time < dark_s else np.inf
        measured = Measurement(t_ns, seen, variance_m2, wheels=wheels, **told_by(heard))
        state, estimate = step(config, state, measured)
        if estimate is not None:
            told.append((time, speed, estimate))
        slowing = 9.8 * (used(time) + float(config.train.specific_resistance(speed)))
        place, speed = place + 0.1 * speed, speed - 0.1 * slowing
    return told


@pytest.mark.parametrize("kind", ["cylinder", "mean"])
@pytest.mark.parametrize("seed", range(3))
def test_a_release_on_leaves_leaves_what_was_known_of_the_rail(seed: int, kind: str) -> None:
    """What presses no more looks like a rail that gives nothing: for half a minute there was no safe curve."""
    dumped = cycling(2.0, 0.2 * FULL_PA)
    told = ridden(
        Config(method="bank", pressure_kind=kind),
        seed,
        22.0,
        used=lambda time: USED * (0.5 < time < 12.5),
        creep=lambda time: 0.1 * (1.0 < time < 12.5),
        pressure=lambda time: (
            0.0 if time < 0.0 else dumped(time) if time < 12.0 else dumped(12.0) * max(13.0 - time, 0.0)
        ),
    )
    coasted = [estimate for time, _, estimate in told if time > 16.0]
    assert coasted
    assert all(0.5 * USED < estimate.mu_lower <= USED for estimate in coasted)


@pytest.mark.parametrize(("kind", "told_by"), [("demanded", by_gauge), ("cylinder", by_handle)])
@pytest.mark.parametrize("seed", range(3))
def test_wheels_may_slide_for_long_behind_a_demand(
    seed: int, kind: str, told_by: Callable[[PressureSample], dict[str, Any]]
) -> None:
    """No gauge shows how a brake lets go: the wheels that it still held were taken for the train."""
    told = ridden(
        Config(method="bank", pressure_kind=kind, brake_build_up_s=3.0),
        seed,
        26.0,
        used=lambda time: USED * (0.5 < time < 18.0),
        creep=lambda time: 0.03 * min(max(time, 0.0), 5.0) * (time < 18.0),
        pressure=lambda time: FULL_PA * (0.0 < time < 12.0),
        told_by=told_by,
        every=10,
    )
    off = [(estimate.speed_mps - speed) / estimate.speed_std_mps for time, speed, estimate in told if time > 12.0]
    assert np.max(np.abs(off)) < 4.0


@pytest.mark.parametrize("seed", range(3))
def test_wheels_that_a_brake_holds_which_no_gauge_shows_are_not_taken_for_the_train(seed: int) -> None:
    """The electric brake of a metro train stops it alone: all axles slide deeper and deeper."""
    told = ridden(
        Config(method="bank"),
        seed,
        20.0,
        used=lambda time: USED * (time > 0.0),
        creep=lambda time: 0.06 * min(max(time, 0.0), 8.0),
        pressure=lambda _: 0.0,
    )
    off = [(estimate.speed_mps - speed) / estimate.speed_std_mps for _, speed, estimate in told]
    assert np.max(np.abs(off)) < 4.0


@pytest.mark.parametrize("seed", range(3))
def test_wheels_that_agree_are_believed_on_a_slope_that_nobody_told(seed: int) -> None:
    """In a tunnel they are all there is: a slope of 15 ‰ was taken for a brake, and the speed known to 2 to 7 m/s."""
    told = ridden(
        Config(method="bank"),
        seed,
        40.0,
        used=lambda time: 0.015 * (time > -5.0),
        creep=lambda _: 0.0,
        pressure=lambda _: 0.0,
        dark_s=0.0,
    )
    assert told[-1][0] > 35.0
    assert all(estimate.speed_std_mps < 0.3 for time, _, estimate in told if time > -10.0)
    assert all(abs(estimate.speed_mps - speed) < 0.6 for time, speed, estimate in told if time > -10.0)


@pytest.mark.parametrize("seed", range(3))
def test_wheels_tell_nothing_of_a_train_that_runs_back(seed: int) -> None:
    """They turn without a sign: at 5 m/s backwards the speed leapt to 5 m/s forwards, sure to 0.1."""
    config = Config(method="bank")
    rng, state, speed, place = np.random.default_rng(seed), init(config, 1), 3.0, 0.0
    off = list[float]()
    for tick in range(700):
        t_ns = S + tick * S // 10
        rims = abs(speed) * (1.0 + 5e-4 * rng.standard_normal(AXLES))
        wheels = (WheelSample(t_ns, tuple((rims / config.train.wheel_radius_m).tolist())),)
        heard = PressureSample(t_ns, 0.0)
        seen = place + 0.3 * float(rng.standard_normal())
        placed = Measurement(t_ns, seen, 4.0 if tick % 10 == 0 else np.inf, wheels=wheels, **by_gauge(heard))
        state, estimate = step(config, state, placed)
        if estimate is not None and speed < -4.0:
            off.append((estimate.speed_mps - speed) / estimate.speed_std_mps)
        place, speed = place + 0.1 * speed, speed - 0.025 * (tick > 100)
    assert speed < -10.0
    assert np.max(np.abs(off)) < 5.0
