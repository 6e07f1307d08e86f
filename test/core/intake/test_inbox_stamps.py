# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Stamps that jump, stray or come late: no sensor keeps the others back, and no position is lost."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from test_inbox import Feeder, S, anchors, position, pressure, pressures, running, speed

from adhesion_node.core import (
    Config,
    Sample,
)
from adhesion_node.core.estimator import gate_of
from adhesion_node.core.intake.outcome import Outcome


@pytest.mark.parametrize("jump_s", [-500.0, 500.0])
def test_a_jump_of_the_time_that_two_sensors_agree_on_begins_anew_at_once(jump_s: float) -> None:
    feeder = running(1000.0)
    feeder.push(pressure(1000.1 + jump_s, 5.0))
    assert feeder.outcomes == []
    feeder.push(position(1000.1 + jump_s))
    assert feeder.outcomes == [Outcome.RESET]
    assert pressures(feeder.drain()) == [5.0]


@pytest.mark.parametrize("jump_s", [-500.0, 500.0])
def test_a_jump_brings_no_old_pressure_and_loses_no_position(jump_s: float) -> None:
    feeder = running(1000.0)
    feeder.push(position(1000.1), position(1000.1 + jump_s), position(1000.2 + jump_s))
    assert [each.anchor.t_ns for each in feeder.ended] == [round(1000.1 * S)]
    assert pressures(feeder.drain()) == [None, None]
    assert feeder.outcomes == [Outcome.RESET]


def test_a_single_stray_stamp_is_set_aside_then_dropped() -> None:
    feeder = running()
    feeder.push(position(31.0))
    assert feeder.inbox.suspects == (position(31.0),)
    feeder.push(pressure(1.1, 1.0), position(1.1))
    assert feeder.outcomes == [Outcome.STRAY]
    assert feeder.details == ["PositionSample of 31 s, +29.9 s from all others"]
    assert not feeder.inbox.suspects


def test_a_stray_stamp_sent_twice_does_not_agree_with_itself() -> None:
    feeder = running()
    feeder.push(position(31.0), position(31.0), position(1.1))
    assert feeder.outcomes == [Outcome.DUPLICATE, Outcome.STRAY]


@pytest.mark.parametrize("per_position", [1, 3])
@pytest.mark.parametrize("off_s", [-3600.0, -100.0, -3.0, 3.0, 100.0, 3600.0])
@pytest.mark.parametrize("first", [0, 50])
def test_the_wrong_clock_of_a_pressure_keeps_no_position_back(first: int, off_s: float, per_position: int) -> None:
    """It comes before the first position or later, as often or more often."""
    feeder = Feeder()
    for tick in range(100):
        if tick >= first:
            feeder.push(*(pressure(5000 + tick / 10 + k / 100 + off_s, 1.0) for k in range(per_position)))
        feeder.push(position(5000 + tick / 10))
    feeder.drain()
    assert anchors(feeder.matched) == [round((5000 + tick / 10) * S) for tick in range(100)]
    assert feeder.outcomes.count(Outcome.RESET) <= 1


@pytest.mark.parametrize("per_first", [1, 2, 3])
@pytest.mark.parametrize("jitter_s", [0.0, 0.05])
def test_two_clocks_of_the_anchor_are_one_reset_at_most(per_first: int, jitter_s: float) -> None:
    """4000 s apart, for 200 s, the second one as fast or faster: one of them is followed, the other one stray."""
    rng = np.random.default_rng(1)
    stamps = [k / 10 * per_first for k in range(2000 // per_first)]
    first = [(t, sample) for t in stamps for sample in (pressure(t, 1.0), position(t))]
    second = [(k / 10 + 0.01, position(4000 + k / 10)) for k in range(2000)]
    feeder = Feeder(gate_of(Config()))
    arriving = sorted((t + jitter_s * rng.uniform(), number, s) for number, (t, s) in enumerate((*first, *second)))
    feeder.push(*(s for *_, s in arriving))
    assert feeder.outcomes.count(Outcome.RESET) <= 1
    assert len(feeder.ended + feeder.matched) > 0.9 * len(stamps)


def test_two_stray_stamps_that_agree_are_left_again() -> None:
    feeder = running()
    feeder.push(position(100.0), position(100.1), *(position(1 + k / 10) for k in range(1, 20)))
    assert feeder.outcomes.count(Outcome.RESET) == 2
    assert len(feeder.matched) > 20


def test_wild_stamps_do_not_agree_with_each_other() -> None:
    feeder = running()
    feeder.push(position(6.0), position(4000.0), pressure(9000.0, 1.0), position(1.1))
    assert feeder.outcomes == [Outcome.STRAY] * 2
    assert feeder.inbox.suspects == (pressure(9000.0, 1.0),)


def test_a_loop_of_fewer_anchors_than_a_late_run_begins_anew_too() -> None:
    feeder = Feeder(gate_of(Config(max_outliers=20)))
    for _ in range(6):
        feeder.push(*(position(k) for k in range(12)))
    assert feeder.outcomes.count(Outcome.RESET) == 2


def test_stamps_before_the_epoch_are_paired_as_all_others() -> None:
    samples = [sample for k in range(-1000, -900) for sample in (pressure(k / 10, k), position(k / 10))]
    feeder = Feeder()
    feeder.push(*samples)
    feeder.drain()
    assert pressures(feeder.matched) == list(range(-1000, -900))


def test_the_first_anchor_that_is_sorted_in_has_its_pressure() -> None:
    feeder = Feeder(gate_of(Config(max_lag_s=0.5)))
    feeder.push(pressure(1.0, 1.0), pressure(1.1, 2.0), position(1.1), position(1.0))
    assert pressures(feeder.drain()) == [1.0, 2.0]


def test_an_anchor_sorted_in_before_a_gap_shortens_it_in_every_order() -> None:
    """Nothing begins at 1.1 s or 3.05 s, where a speed would be waited for: whichever position comes first."""
    samples: tuple[Sample, ...] = (position(1.1), speed(1.1, 9.0), position(3.05))
    released = set()
    for order in itertools.permutations(samples):
        feeder = Feeder(gate_of(Config(max_lag_s=3.0)))
        feeder.push(position(0.9), pressure(1.3, 0.0), *order)
        released.add(tuple(feeder.drain()))
    assert len(released) == 1


def test_late_anchors_in_a_row_are_a_step_back_in_time() -> None:
    feeder = running(20.0)
    feeder.push(*(position(k / 10) for k in range(5)))
    assert feeder.outcomes == [Outcome.LATE] * 4 + [Outcome.RESET]
    feeder.push(position(0.5))
    assert [each.anchor.t_ns for each in feeder.drain()] == [round(0.4 * S), round(0.5 * S)]
