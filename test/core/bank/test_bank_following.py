# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""One measurement in its turn: what is believed of a train just met, and of sensors between two positions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from banks import CONFIG, FULL_PA, S
from scipy.signal import lfilter

from adhesion_node.core.bank.following import followed, met, off
from adhesion_node.core.bank.layout import BRAKE, MU, POSITION, SCALE, SPEED
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import ImuSample, Measurement, SpeedSample
from adhesion_node.core.physics.train import Array

BLIND = Measurement(S, 0.0, math.inf, 0.0)
WET = Rail(0.07, 0.01, 0.055)


def stds(memory: Memory) -> Array:
    return np.asarray(np.sqrt(np.diagonal(memory.bank.moments()[1])))


def on(config: Config, memory: Memory, *measurements: Measurement) -> Memory:
    for each in measurements:
        memory = followed(config, memory, each, lambda: WET)
    return memory


def test_a_train_just_met_is_known_as_badly_as_the_settings_say() -> None:
    config = Config(brake_std=0.06, mass_std=0.08, rotating_mass_std=0.0, speed_scale_std=0.02, unknown_speed_mps=50.0)
    found = stds(met(config, BLIND))
    assert found[BRAKE] == pytest.approx(0.1)  # 0.06 and 0.08
    assert found[SCALE] == pytest.approx(0.02)
    assert found[SPEED] == pytest.approx(50.0, rel=1e-6)
    assert found[MU] > 0.15  # under full traction, too
    assert found[POSITION] > 1e3


def test_the_first_position_places_the_train_and_a_speed_counts_as_two() -> None:
    memory = met(CONFIG, BLIND)
    assert (memory.is_placed, memory.fixes) == (False, 0)
    placed = on(CONFIG, memory, Measurement(2 * S, 700.0, 0.25, 0.0))
    assert (placed.is_placed, placed.fixes) == (True, 1)
    assert placed.bank.mean_of(POSITION) == pytest.approx(700.0)
    assert on(CONFIG, placed, Measurement(3 * S, 0.0, math.inf, 0.0, 30.0)).fixes == 3
    assert on(CONFIG, placed, Measurement(3 * S, 720.0, 0.25, 0.0)).fixes == 2


@pytest.mark.parametrize(("declared", "least", "most"), [(0.0, 0.02, 0.04), (0.25, 0.48, 0.52), (None, 0.19, 0.21)])
def test_a_speed_is_believed_as_it_declares_itself_never_to_the_last(
    declared: float | None, least: float, most: float
) -> None:
    """Without a declared variance by the setting; what its scale may be wrong by is left out here."""
    config = replace(CONFIG, speed_scale_std=1e-6, speed_std_mps=0.2)
    told = BLIND._replace(t_ns=S + 1, speeds=(SpeedSample(S + 1, 30.0, declared),))
    assert least < stds(on(config, met(config, BLIND), told))[SPEED] < most


@pytest.mark.parametrize("std", [0.05, 0.3])
def test_no_speed_tells_what_its_own_scale_is_off_by(std: float) -> None:
    """Where nothing else is heard; the first one, of a train that was believed to run at 40 m/s, did."""
    rng, memory = np.random.default_rng(1), met(CONFIG, BLIND)
    for t_ns in range(2 * S, 302 * S, S // 2):
        shown = SpeedSample(t_ns, 26.0 + std * rng.standard_normal(), std**2)
        memory = on(CONFIG, memory, BLIND._replace(t_ns=t_ns, speeds=(shown,)))
    assert stds(memory)[SCALE] == pytest.approx(CONFIG.speed_scale_std)
    assert memory.bank.mean_of(SCALE) == 0.0
    assert stds(memory)[SPEED] > 0.9 * 26.0 * CONFIG.speed_scale_std


def test_a_train_that_stands_tells_nothing_of_the_scale() -> None:
    """What a speed errs by, times itself, made the train 1.5 % too slow in 6 minutes."""
    noise = lfilter([0.01], [1.0, -0.98], np.random.default_rng(1).standard_normal(4000))  # lasts for 5 s
    memory = met(CONFIG, BLIND)
    for tick, slow_mps in enumerate(noise.tolist()):
        t_ns, runs_mps = 2 * S + tick * S // 10, 0.5 * max(20.0 - 0.1 * tick, 0.0)
        shown = SpeedSample(t_ns, runs_mps + slow_mps, 0.05**2)
        memory = on(CONFIG, memory, BLIND._replace(t_ns=t_ns, speeds=(shown,)))
    assert memory.bank.mean_of(SCALE) == 0.0


def test_a_speed_between_two_positions_counts_at_its_own_time() -> None:
    """As if the train had been asked about at that time."""
    start = on(
        CONFIG,
        met(CONFIG, Measurement(S, 0.0, 0.01, 0.0, 40.0)),
        *(Measurement(S + k * S // 5, 8.0 * k, 0.01, 0.0, 40.0) for k in range(1, 4)),
    )
    then, until, speeds = 17 * S // 10, 18 * S // 10, (SpeedSample(17 * S // 10, 40.5, 0.01),)
    at_once = on(CONFIG, start, Measurement(until, 32.0, 0.01, 0.0, speeds=speeds))
    before = Measurement(then, 0.0, math.inf, 0.0, speeds=speeds)
    in_turn = on(CONFIG, start, before, Measurement(until, 32.0, 0.01, 0.0))
    for one, other in zip(at_once.bank.moments(), in_turn.bank.moments(), strict=True):
        assert one == pytest.approx(other, rel=1e-6, abs=1e-9)


def test_what_was_foreseen_of_a_position_need_not_be_foreseen_again() -> None:
    """It is the very bank that the position is taken into, in a braking, too."""
    fixes = [Measurement(S + k * S // 5, 8.0 * k, 0.01, 0.0 if k < 4 else FULL_PA) for k in range(8)]
    *before, last = fixes
    memory = on(CONFIG, met(CONFIG, before[0]), *before[1:])
    foreseen = off(CONFIG, memory, last)
    found = followed(CONFIG, memory, last, lambda: WET, foreseen)
    for one, other in zip(found.bank, on(CONFIG, memory, last).bank, strict=True):
        assert np.array_equal(one, other)
    assert foreseen.bank is not None
    moved = foreseen._replace(bank=foreseen.bank.with_fresh(BRAKE, 0.9, 0.01))
    assert followed(CONFIG, memory, last, lambda: WET, moved).bank.mean_of(BRAKE) == pytest.approx(0.9, abs=0.02)


def test_many_accelerations_say_what_their_mean_says_with_a_part_of_the_variance() -> None:
    start = on(
        CONFIG, met(CONFIG, Measurement(S, 0.0, 0.01, 0.0, 40.0)), Measurement(S + S // 10, 4.0, 0.01, 0.0, 40.0)
    )
    then = S + S // 5
    unfelt, one, four = (
        on(CONFIG, start, Measurement(then, 8.0, 0.01, 0.0, imu=imu))
        for imu in ((), (ImuSample(then, -0.2, 0.01),), tuple(ImuSample(then, x, 0.04) for x in (-0.1, -0.3) * 2))
    )
    assert one.bank.mean_of(MU) > unfelt.bank.mean_of(MU) + 1e-3
    assert one.bank.moments()[0] == pytest.approx(four.bank.moments()[0], rel=1e-9)
    assert one.log_likelihood == pytest.approx(four.log_likelihood, rel=1e-9)


def test_an_odometer_on_a_braked_axle_is_not_believed_under_the_brake() -> None:
    start = met(CONFIG, Measurement(S, 0.0, 0.01, 0.0, 40.0))
    start = on(CONFIG, start, *(Measurement(S + k * S // 10, 4.0 * k, 0.01, FULL_PA) for k in range(1, 4)))
    axle, radar, untold = (
        on(replace(CONFIG, speed_source=source), start, Measurement(14 * S // 10, 16.0, 0.01, FULL_PA, speed))
        for source, speed in (("axle", 35.0), ("radar", 35.0), ("axle", None))
    )
    assert axle.bank.mean_of(SPEED) == untold.bank.mean_of(SPEED)
    assert radar.bank.mean_of(SPEED) < untold.bank.mean_of(SPEED) - 0.01
