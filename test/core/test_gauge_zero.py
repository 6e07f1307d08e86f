# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A gauge whose zero is off by more than the threshold: what it shows without a brake is learnt, and is no brake."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from adhesion_node.core import Config, Estimate, Outcome, PositionSample, PressureSample, Regime, State, init, step

S, HZ = 1_000_000_000, 5
Shape = Callable[[float], float]
FULL_PA = Config().train.full_pressure_pa


def ridden(
    config: Config,
    seconds: float,
    pressure: Shape,
    net: Shape,
    *,
    off_pa: float = 0.0,
    speed_mps: float = 20.0,
    seed: int = 1,
    every: int = 1,
    stuck_s: float = math.inf,
) -> list[tuple[State, Estimate]]:
    """What is told of a train that gains `net` m/s^2 beside its resistance, with a gauge that shows `off_pa` more.

    From `stuck_s` on its positions stay as they are.
    """
    rng, state, told = np.random.default_rng(seed), init(config, 1), list[tuple[State, Estimate]]()
    place, seen = 0.0, 0.0
    for tick in range(round(HZ * seconds)):
        time, t_ns = tick / HZ, S + tick * S // HZ
        shown_pa = max(pressure(time) + off_pa + 1e3 * float(rng.standard_normal()), 0.0)
        state, estimate = step(config, state, PressureSample(t_ns, shown_pa))
        estimates = [estimate]
        if tick % every == 0:
            seen = place + 0.3 * float(rng.standard_normal()) if time < stuck_s else seen
            state, estimate = step(config, state, PositionSample(t_ns, seen, 0.25))
            estimates.append(estimate)
        told += [(state, estimate) for estimate in estimates if estimate is not None]
        place += speed_mps / HZ
        speed_mps += (net(time) - 9.8 * float(config.train.specific_resistance(speed_mps))) / HZ
    return told


def off_pa(told: list[tuple[State, Estimate]]) -> float:
    """What was learnt in the end, Pa."""
    state, _ = told[-1]
    return state.zero.off_pa(10e3)


def nothing(_time: float) -> float:
    return 0.0


@pytest.mark.parametrize("method", ["bank", "rail_condition", "particle_em"])
def test_a_train_that_gains_speed_is_not_braked(method: str) -> None:
    """It was, for ever: traction looked like a rail that gives nothing."""
    told = ridden(Config(method=method), 60.0, nothing, lambda time: 0.3 * (time > 20.0), off_pa=15e3)
    late = [estimate for _, estimate in told if estimate.t_ns > 15 * S]
    assert {estimate.regime for estimate in late} == {Regime.COASTING}
    assert all(estimate.window == 0 for estimate in late)
    assert off_pa(told) == pytest.approx(15e3, abs=1e3)


@pytest.mark.parametrize("off", [0.0, 8e3])
def test_a_zero_that_is_off_by_less_than_the_threshold_changes_nothing(off: float) -> None:
    assert off_pa(ridden(Config(), 40.0, nothing, nothing, off_pa=off)) == 0.0


@pytest.mark.parametrize("seed", range(3))
def test_the_bound_holds_behind_a_start_with_such_a_gauge(seed: int) -> None:
    """What traction did under a brake that was none had taught wrong brake and slope: what is used looked like more."""
    config = Config()

    def net(time: float) -> float:
        return 0.45 if time < 40.0 else -0.035 * 9.8 if time > 60.0 else 0.0

    told = ridden(config, 95.0, lambda time: FULL_PA * (time > 60.0), net, off_pa=18e3, speed_mps=0.0, seed=seed)
    late = [estimate for _, estimate in told if estimate.t_ns > 64 * S and estimate.speed_mps > 3.0]
    assert len(late) > 30
    assert all(estimate.mu_lower <= 0.035 for estimate in late)


@pytest.mark.parametrize("off", [13e3, 15e3, 17e3])
def test_estimates_go_on_as_it_is_learnt(off: float) -> None:
    """With a position a second: what is older than 2 s the monitor does not use."""
    told = ridden(Config(), 40.0, nothing, nothing, off_pa=off, every=HZ)
    assert off_pa(told) == pytest.approx(off, abs=1e3)
    assert max(np.diff([estimate.t_ns for _, estimate in told])) < 2 * S


def test_what_presses_is_counted_from_it() -> None:
    newest = [
        ridden(Config(), 40.0, lambda time: FULL_PA * (time > 30.0), lambda time: -0.9 * (time > 30.0), off_pa=off)[-1]
        for off in (0.0, 20e3)
    ]
    exact, other = (state.newest.brake_pressure_pa for state, _ in newest if state.newest is not None)
    assert exact is not None
    assert other == pytest.approx(exact, abs=1e3)


def test_the_train_is_met_anew_once() -> None:
    told = ridden(Config(), 60.0, nothing, lambda _: 0.1, off_pa=15e3)
    assert told[-1][0].counts[Outcome.RESET] == 1
    assert ridden(Config(), 60.0, nothing, lambda _: 0.1)[-1][0].counts[Outcome.RESET] == 0


@pytest.mark.parametrize("decel_mps2", [0.2, 0.5])
def test_what_is_shown_while_another_brake_slows_the_train_is_no_zero(decel_mps2: float) -> None:
    """Cylinders may press a little beside an electric brake."""
    assert off_pa(ridden(Config(), 30.0, lambda _: 15e3, lambda _: -decel_mps2, speed_mps=30.0)) == 0.0


@pytest.mark.parametrize("method", ["bank", "rail_condition", "particle_em"])
def test_nor_is_it_one_while_nothing_tells_how_fast_the_train_is(method: str) -> None:
    """Its positions are stuck: the speed of before seemed to be held."""
    told = ridden(Config(method=method), 40.0, lambda _: 20e3, lambda _: -0.5, speed_mps=30.0, stuck_s=6.0)
    assert off_pa(told) == 0.0


def test_a_brake_on_a_descent_is_no_zero_once_it_was_released() -> None:
    def light(time: float) -> float:
        return 0.0 if time < 10.0 else 20e3

    assert off_pa(ridden(Config(), 60.0, light, nothing)) == 0.0
    first = ridden(Config(), 60.0, lambda time: 20e3 if time < 30.0 else 0.0, nothing)
    assert off_pa(first[: len(first) // 2]) > 0.0  # as good as any zero, before it is released
    assert off_pa(first) == 0.0


@pytest.mark.parametrize("shown_pa", [40e3, 100e3])
def test_more_than_a_gauge_is_off_by_is_a_brake(shown_pa: float) -> None:
    assert off_pa(ridden(Config(), 60.0, lambda _: shown_pa, lambda _: 0.2)) == 0.0


def test_what_a_train_holds_where_it_stands_is_no_zero() -> None:
    assert off_pa(ridden(Config(), 40.0, lambda _: 20e3, lambda _: 0.0, speed_mps=0.0)) == 0.0


def test_a_demand_has_no_gauge() -> None:
    told = ridden(Config(pressure_kind="demanded"), 40.0, lambda _: 20e3, lambda _: 0.2)
    assert off_pa(told) == 0.0
