# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.
"""Steps of the positions: which deviations are one, and what is not."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from banks import CONFIG, S

from adhesion_node.core.bank.following import followed, met
from adhesion_node.core.bank.layout import POSITION, SPEED
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.bank.motion import Foreseen
from adhesion_node.core.bank.steps import Stepping
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.intake.samples import Measurement

CALM = replace(CONFIG, position_step_std_m=2.0, position_step_spacing_m=300.0)
"""Positions of 0.5 m that are foreseen to 1 m: a step is of 2.5 m at least and of 8 m at most."""


def seen(off_m: list[float | None], start: Stepping | None = None, std_m: float = 0.5) -> Stepping:
    """Positions from 1000 m on, each 4 m further, off by so much; None: a tick."""
    memory = met(CALM, Measurement(S, 1000.0, 0.25, 0.0, 40.0))
    stepping = start or Stepping()
    for k, off in enumerate(off_m):
        variance = math.inf if off is None else std_m**2
        measured = Measurement(S + k * S // 10, 1000.0 + 4.0 * k, variance, 0.0)
        stepping = stepping.after(CALM, memory, measured, Foreseen() if off is None else Foreseen(off, 1.0, abs(off)))
    return stepping


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("off_m", "size_m"),
    [
        ([0.1, 5.0, 5.2, 4.8], 5.0),
        ([0.1, 5.0, 5.2], 0.0),  # two
        ([0.1, 5.0, None, 5.2, None, 4.8], 5.0),  # ticks say nothing
        ([0.1, 2.6, 2.6, 2.6], 2.6),
        ([0.1, 2.4, 2.4, 2.4], 0.0),  # as chance may have it
        ([0.1, 2.6, 1.8, 1.8], 0.0),  # all of them are
        ([0.1, 7.9, 7.9, 7.9], 7.9),
        ([0.1, 8.1, 8.1, 8.1], 0.0),  # larger than any step
        ([3.1, 5.0, 5.0, 5.0], 0.0),  # it grows: motion
        ([-3.1, 5.0, 5.0, 5.0], 0.0),  # it swings
        ([2.9, 5.0, 5.0, 5.0], 5.0),
        ([0.1, 5.0, 3.3, 5.0], 5.0 - 1.7 / 3.0),
        ([0.1, 5.0, 3.2, 5.0], 0.0),  # they differ by more than 3.5 of what they declare
        ([0.1, 5.0, 0.2, 5.0, 5.0], 0.0),
    ],
)
def test_a_step_is_abrupt_likely_of_its_size_and_borne_out_by_three(
    off_m: list[float | None], size_m: float, sign: float
) -> None:
    found = seen([None if off is None else sign * off for off in off_m]).size_m(CALM, 1.0)
    assert found == pytest.approx(sign * size_m)


@pytest.mark.parametrize(("last_m", "size_m"), [(750.0, 0.0), (1250.0, 0.0), (650.0, 5.0), (1350.0, 5.0)])
def test_steps_lie_a_spacing_apart(last_m: float, size_m: float) -> None:
    assert seen([0.1, 5.0, 5.0, 5.0], Stepping(stepped_m=last_m)).size_m(CALM, 1.0) == size_m


@pytest.mark.parametrize(("off_m", "size_m"), [(-5.0, -5.0), (-3.6, -3.6), (-3.2, 0.0), (-6.8, 0.0), (5.0, 0.0)])
def test_a_step_may_be_taken_back_at_any_time(off_m: float, size_m: float) -> None:
    """What reflects a satellite's signal goes by."""
    assert seen([0.1, off_m, off_m, off_m], Stepping(stepped_m=990.0, by_m=5.0)).size_m(CALM, 1.0) == pytest.approx(
        size_m
    )


@pytest.mark.parametrize(
    ("last_m", "by_m", "size_m"), [(990.0, -3.0, 0.0), (860.0, -3.0, 0.0), (840.0, -3.0, -3.0), (990.0, 3.0, -3.0)]
)
def test_nothing_steps_the_same_way_again_soon(last_m: float, by_m: float, size_m: float) -> None:
    """Before: positions that declare 2 m did, each time that an axle that slides fell behind."""
    before = Stepping(stepped_m=last_m, by_m=by_m)
    assert seen([0.1, -3.0, -3.0, -3.0], before, 2.0).size_m(CALM, 1.0) == size_m


def test_a_step_behind_a_chance_error_is_one() -> None:
    assert seen([0.1, 2.6, 2.4, 2.5, 2.4]).size_m(CALM, 1.0) == 0.0  # it was decided by the third
    assert seen([0.1, 2.6, 2.0, 0.1, 7.0, 7.0, 7.0]).size_m(CALM, 1.0) == pytest.approx(7.0)
    assert seen([0.1, -2.6, 7.0, 7.1, 6.9]).size_m(CALM, 1.0) == pytest.approx(7.0)


@pytest.mark.parametrize(
    ("off_m", "size_m"),
    [
        ([0.1, *[50.0] * 21], 50.0),
        ([0.1, *[-50.0] * 21], -50.0),
        ([0.1, *[50.0] * 20], 0.0),  # shorter than 2 s
        ([0.1, *[each for _ in range(11) for each in (50.0, None)]], 50.0),  # ticks are no positions
        ([0.1, *[each for _ in range(10) for each in (50.0, None)]], 0.0),
        ([0.1, *(50.0 + 0.3 * k for k in range(21))], 53.0),
        ([0.1, *(50.0 + 0.5 * k for k in range(21))], 0.0),  # it grows: motion
        ([40.0, *[50.0] * 21], 0.0),
    ],
)
def test_a_far_step_lies_off_alike_for_two_seconds(off_m: list[float | None], size_m: float) -> None:
    assert seen(off_m).size_m(CALM, 1.0) == pytest.approx(size_m)


@pytest.mark.parametrize("off_m", [[0.1, 2.4, 2.4, 2.4, 0.3], [0.1, *[50.0] * 21, 3.0]])
def test_what_was_decided_is_over(off_m: list[float | None]) -> None:
    assert not seen(off_m).off_m


def test_a_step_moves_where_the_train_is_and_not_how_fast() -> None:
    memory = met(CALM, Measurement(S, 1000.0, 0.25, 0.0, 40.0))
    for k in range(1, 30):
        memory = next_of(memory, Measurement(S + k * S // 10, 1000.0 + 4.0 * k, 0.25, 0.0, 40.0))
    since = [Measurement(S + k * S // 10, 1005.0 + 4.0 * k, 0.25, 0.0, 40.0) for k in range(30, 33)]
    stepping = Stepping(memory, tuple(since), (5.0, 5.0, 5.0))
    moved, after = stepping.taken(CALM, 5.0, lambda: Rail(0.0, 1.0, 0.0))
    assert after == Stepping(stepped_m=since[-1].position_m, by_m=5.0)
    assert moved.t_ns == since[-1].t_ns
    assert moved.bank.mean_of(POSITION) == pytest.approx(1005.0 + 4.0 * 32, abs=0.6)
    assert moved.bank.mean_of(SPEED) == pytest.approx(40.0, abs=0.1)


def next_of(memory: Memory, measurement: Measurement) -> Memory:
    return followed(CALM, memory, measurement, lambda: Rail(0.0, 1.0, 0.0))
