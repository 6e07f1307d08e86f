# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Wheels whose sensors lie: they stand while the train runs, fall silent, or show the same again and again."""

from __future__ import annotations

import math

import numpy as np
import pytest
from banks import FULL, S, braked_run, measurements
from test_bank_trust import DRY, WET, Run, assert_known, followed

from adhesion_node.core import Outcome, Regime, WheelSample
from adhesion_node.core.bank.gear.axles import Axles
from adhesion_node.core.physics.train import Array

AXLES, RADIUS_M, FAULT_S = 4, 0.46, 12.0


def turned(times: Array, speeds: Array, mu: float, seed: int) -> Array:
    """Rims, m/s, (N, A): they roll, or slide by a tenth from 1 s behind the brake on."""
    creep = 0.1 * (times > 6.0) * (mu < FULL)
    noise = 0.002 * np.random.default_rng(seed + 300).standard_normal((times.size, AXLES))
    return np.asarray(speeds[:, None] * (1.0 - creep[:, None] + noise))


def run(mu: float, fault: str, axles: int, seed: int = 0) -> Run:
    """So many `axles` count backwards or stand from the start on, or fall silent or are held under the brake."""
    times, truth, places = braked_run(mu, seed, 30.0)
    rims, late = turned(times, truth[:, 1], mu, seed), times >= FAULT_S
    if fault == "held":
        rims[late, :axles] = rims[late][0, :axles]
    elif fault == "backwards":
        rims[:, :axles] *= -1.0
    elif fault:
        rims[late if fault == "silent" else times >= 0.0, :axles] = 0.0
    measured = [
        each._replace(wheels=(WheelSample(each.t_ns, tuple(row / RADIUS_M)),))
        for each, row in zip(measurements(times, places, 0.3), rims, strict=True)
    ]
    return Run(times, truth[:, 1], *followed(measured))


@pytest.mark.parametrize("mu", [DRY, WET, 0.03])
@pytest.mark.parametrize("fault", ["dead", "silent", "held"])
@pytest.mark.parametrize("axles", [1, 2, AXLES])
def test_wheels_that_lie_are_left_out(mu: float, fault: str, axles: int) -> None:
    found = run(mu, fault, axles)
    assert found.state.counts[Outcome.STUCK] > 150
    assert found.state.counts[Outcome.SLIDING] == found.state.counts[Outcome.RESET] == 0
    assert_known(found, mu, FAULT_S + 1.0, 25.0)
    wrong = Regime.ADHESION_LIMITED if mu == DRY else Regime.BRAKE_LIMITED
    assert wrong not in {each.regime for each in found.estimates if (each.t_ns - S) / S > FAULT_S + 1.0}


@pytest.mark.parametrize("mu", [DRY, WET, 0.03])
@pytest.mark.parametrize("axles", [1, 2, AXLES])
def test_axles_that_count_backwards_tell_as_much_as_others(mu: float, axles: int) -> None:
    """As those on the train's other side may. Before: on a dry rail they seemed to slide."""
    found, others = run(mu, "backwards", axles), run(mu, "", 0)
    for one, other in zip(found.estimates, others.estimates, strict=True):
        if one.t_ns > S + 10 * S:
            assert one.regime is other.regime
            assert one.mu == pytest.approx(other.mu, rel=0.02)
            assert one.mu_lower == pytest.approx(other.mu_lower, rel=0.02)


@pytest.mark.parametrize("mu", [DRY, WET])
def test_wheels_that_turn_are_all_believed(mu: float) -> None:
    assert run(mu, "", 0).state.counts[Outcome.STUCK] == 0


def test_an_axle_that_locks_slides_and_is_believed() -> None:
    """By 60 m/s^2 at its rim, on its way from 40 m/s, to stand then."""
    axles = Axles()
    for index in range(40):
        axles = axles.after((max(40.0 - 6.0 * index, 0.0), 40.0 - 0.1 * index), index * S // 10, 0.1 * index, False)
        assert axles.lying(0.1 * index) == ()


def test_a_wheel_counts_again_once_it_turns() -> None:
    axles = Axles()
    for index, (rim, lies) in enumerate(((0.0, (0,)), (math.nan, (0,)), (30.0, ()), (30.1, ()))):
        axles = axles.after((rim, 30.0), index * S // 10, 0.0, True)
        assert axles.lying(0.0) == lies


def test_a_train_of_other_axles_is_met_anew() -> None:
    axles = Axles().after((0.0, 0.0), S, 0.0, True)
    assert axles.lying(0.0) == (0, 1)
    assert axles.after((0.0, 0.0, 0.0), 3 * S, 0.0, False).lying(0.0) == ()


@pytest.mark.parametrize("seed", range(5))
def test_an_axle_that_tells_the_same_twice_by_chance_turns(seed: int) -> None:
    """Ten times a second, in steps of 0.01 m/s, while the train loses 1.1 m/s^2: that is its noise of 0.3 %."""
    slowed = 0.11 * np.arange(300)
    noise = 0.003 * np.random.default_rng(seed).standard_normal((slowed.size, AXLES))
    rims = ((40.0 - slowed)[:, np.newaxis] * (1.0 + noise)).round(2)
    assert np.any(np.diff(rims, axis=0) == 0.0)
    axles = Axles()
    for index, (row, lost) in enumerate(zip(rims.tolist(), slowed.tolist(), strict=True)):
        axles = axles.after(row, index * S // 10, lost, False)
        assert axles.lying(lost) == ()
    for index in range(300, 305):  # it is held from here on
        axles = axles.after((rims[-1, 0], *rims[-1, 1:] - 0.11 * (index - 299)), index * S // 10, 0.11 * index, False)
    assert axles.lying(0.11 * 304) == (0,)
