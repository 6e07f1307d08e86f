# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The step of the monitor: no order, repetition or trick of time makes what is known younger or better."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import pytest
from test_supervision import CONFIG, NOW_NS, SECOND_NS, constant

from adhesion_node.core.atp.monitor import TICKS, Event, Known, Now, Part, Refused, Rules, Tick, step
from adhesion_node.core.atp.received import StampedCurve, TrainState
from adhesion_node.core.atp.supervision import Decision, Level

RULES = Rules(CONFIG, clock_timeout_s=2.0)
FRESH = Known(moved_ns=0)


def pair(t_s: float, place_m: float = 0.0, speed_mps: float = 40.0, slowing_mps2: float = 0.8) -> tuple[Event, Event]:
    """A curve and the state that it was made of, `t_s` after the start."""
    t_ns = NOW_NS + round(t_s * SECOND_NS)
    curve = StampedCurve(t_ns, place_m, constant(speed_mps, deceleration_mps2=slowing_mps2))
    return curve, TrainState(t_ns, place_m, speed_mps, 0.2, 0.1)


def run(timed: Iterable[tuple[float, Event]], known: Known = FRESH) -> tuple[Known, list[tuple[float, Decision]]]:
    """Let events happen, each at its time, s, by both clocks."""
    said = []
    for t_s, event in timed:
        since_ns = round(t_s * SECOND_NS)
        known, decision = step(RULES, known, event, Now(NOW_NS + since_ns, since_ns))
        if decision is not None:
            said.append((t_s, decision))
    return known, said


def at(t_s: float, *events: Event) -> list[tuple[float, Event]]:
    return [(t_s, event) for event in events]


SUPERVISED, FIRST = run(at(0.0, *pair(0.0)))


def test_a_pair_is_judged_and_a_lone_state_is_not_before_the_watchdog_has_waited() -> None:
    assert [one.level for _, one in FIRST] == [Level.EMERGENCY_BRAKE, Level.NORMAL]  # a curve without a state
    ticks = [(t_s, Tick.ROS) for t_s in (0.2, 0.4, 0.6)]
    _, said = run([*at(0.1, pair(0.1, 4.0)[1]), *ticks], SUPERVISED)
    assert [t_s for t_s, _ in said] == [0.4, 0.6]


def test_the_first_tick_of_all_is_judged() -> None:
    _, said = run(at(0.2, Tick.ROS))
    assert [one.level for _, one in said] == [Level.EMERGENCY_BRAKE]


def test_between_two_judgements_there_are_at_most_three_ticks() -> None:
    ticks = [(0.2 * number + 0.05, Tick.ROS) for number in range(20)]
    apart = [event for number in range(40) for event in at(0.1 * number + 0.04, pair(0.1 * number, number * 4.0)[1])]
    _, said = run(sorted([*at(0.06, *pair(0.0)), *ticks, *apart], key=lambda event: event[0]))
    gaps = [later - one for (one, _), (later, _) in pairwise(said)]
    assert max(gaps) <= 0.2 * TICKS
    assert max(gaps) > 0.2


@pytest.mark.parametrize("repeat", ["twice", "in turns"])
def test_states_sent_twice_or_out_of_order_do_not_hide_that_the_train_runs_back(repeat: str) -> None:
    """Each that begins a new course would leave no two to be held against each other."""
    pairs = [pair(number / 2, -40.0 * number, 0.0) for number in range(40)]
    order = [one // 2 for one in range(80)] if repeat == "twice" else [one ^ 1 for one in range(40)]
    _, said = run(event for number, one in enumerate(order) for event in at(max(number, one) / 2, *pairs[one]))
    late = [decision for t_s, decision in said if t_s > 4.0]
    assert late
    assert {one.level for one in late} == {Level.EMERGENCY_BRAKE}
    assert "the train runs back" in late[-1].message


@pytest.mark.parametrize("stamp_s", [0.4, 0.5])
def test_a_curve_that_comes_late_does_not_replace_a_worse_one(stamp_s: float) -> None:
    """Nor does a second one of its stamp: another estimator's, that should not be there; the node tells of it."""
    better, worse = pair(stamp_s, 40.0 * stamp_s), pair(0.5, 20.0, slowing_mps2=0.2)
    _, said = run([*at(0.5, *worse), *at(0.6, better[0])], SUPERVISED)
    (_, before), (_, after) = said
    assert before.reading is not None
    assert after.reading is not None
    assert after.reading.braking_distance_m == before.reading.braking_distance_m


def test_a_late_state_is_judged_by_the_newest_one() -> None:
    _, said = run([*at(0.5, *pair(0.5, 20.0)), *at(0.6, pair(0.4, 16.0)[1])], SUPERVISED)
    assert [one.state_age_s for _, one in said] == pytest.approx([0.0, 0.1])


def test_a_state_ahead_of_the_clock_does_not_stand_above_those_that_come_later() -> None:
    ahead = pair(5.0, 200.0)[1]
    _, said = run([*at(0.1, ahead), *at(0.2, *pair(0.2, 8.0))], SUPERVISED)
    assert said[0][1].level is Level.EMERGENCY_BRAKE
    assert "is stamped 4.9 s ahead of the clock" in said[0][1].message
    assert said[-1][1].level is Level.NORMAL


def test_a_curve_ahead_of_the_clock_is_not_used_once_the_clock_gets_there() -> None:
    curve = pair(5.0, 200.0)[0]
    later = [one for number in range(1, 12) for one in at(number / 2, pair(number / 2, 20.0 * number)[1], Tick.ROS)]
    _, said = run([*at(0.1, curve), *later], SUPERVISED)
    assert {one.level for _, one in said} == {Level.EMERGENCY_BRAKE}
    assert "braking curve: is stamped 4.9 s ahead of the clock" in said[-1][1].message
    assert (
        run(at(5.6, *pair(5.6, 224.0)), run([*at(0.1, curve), *later], SUPERVISED)[0])[1][-1][1].level is Level.NORMAL
    )


@pytest.mark.parametrize("part", [Part.STATE, Part.CURVE])
def test_a_refused_state_or_curve_takes_the_place_of_the_one_before(part: Part) -> None:
    _, said = run([*at(0.1, Refused(part, "NaN")), *at(0.5, Tick.ROS)], SUPERVISED)
    assert {one.level for _, one in said} == {Level.EMERGENCY_BRAKE}
    assert "refused: NaN" in said[-1][1].message


def stepped(known: Known, event: Event, ros_s: float, steady_s: float) -> tuple[Known, Decision | None]:
    now = Now(NOW_NS + round(ros_s * SECOND_NS), round(steady_s * SECOND_NS))
    return step(RULES, known, event, now)


@pytest.mark.parametrize("tick", [Tick.ROS, Tick.STEADY])
def test_where_the_clock_goes_back_all_that_was_heard_is_forgotten(tick: Tick) -> None:
    """Else a state 1.9 s old would be believed for two more seconds."""
    known, decision = stepped(SUPERVISED, tick, -1.9, 0.2)
    assert decision is not None
    assert decision.level is Level.EMERGENCY_BRAKE
    assert "none since the clock went back by 1.9 s" in decision.message
    known, decision = stepped(known, pair(-1.8)[0], -1.8, 0.3)
    known, decision = stepped(known, pair(-1.8)[1], -1.8, 0.3)
    assert decision is not None
    assert decision.level is Level.NORMAL


def test_a_small_step_back_makes_nothing_younger() -> None:
    known, _ = stepped(SUPERVISED, Tick.ROS, 0.5, 0.5)
    known, decision = stepped(known, Tick.ROS, 0.45, 0.7)
    assert decision is not None
    assert decision.state_age_s == 0.5


def test_a_clock_that_swings_stands_still() -> None:
    known = SUPERVISED
    for number in range(1, 30):
        known, decision = stepped(known, Tick.STEADY, -1e-3 * (number % 2), number / 10)
    assert decision is not None
    assert "the clock has stood still for 2.9 s" in decision.message


def test_a_refused_target_is_an_emergency_until_there_is_a_new_one() -> None:
    events = (Refused(Part.TARGET, "no speed"), Tick.RULES, Tick.TARGET)
    _, said = run(at(0.1, *events), SUPERVISED)
    assert [one.level for _, one in said] == [Level.EMERGENCY_BRAKE, Level.EMERGENCY_BRAKE, Level.NORMAL]
    assert "target: refused: no speed" in said[1][1].message


def test_a_curve_all_in_feet_is_consistent_and_not_believed() -> None:
    feet = 1.0 / 0.3048
    curve = StampedCurve(NOW_NS, 0.0, constant(40.0 * feet, deceleration_mps2=0.8 * feet))
    _, said = run(at(0.0, curve, TrainState(NOW_NS, 0.0, 40.0, 0.2, 0.1)))
    assert "begins at 472.4 km/h but the train runs at 145.1 km/h at most" in said[-1][1].message


@pytest.mark.parametrize("field", ["position_m", "speed_mps", "position_std_m", "speed_std_mps"])
def test_no_number_is_no_all_clear(field: str) -> None:
    curve, state = pair(0.0)
    assert isinstance(state, TrainState)
    for worst in (math.nan, math.inf):
        _, said = run(at(0.0, curve, TrainState(**{**state._asdict(), field: worst})))
        assert said[-1][1].level is Level.EMERGENCY_BRAKE
