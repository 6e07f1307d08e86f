# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the supervision does not believe: states too unsure, running back or against themselves, impossible curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from test_supervision import CONFIG, CURVE, GOOD_STATE, NEEDED_M, NOW_NS, SECOND_NS, constant

from adhesion_node.core.atp.plausibility import COURSE_S, MAX_EXCESS_MPS, Course, _misplaced
from adhesion_node.core.atp.received import StampedCurve, TrainState
from adhesion_node.core.atp.supervision import Level, decide


def judged(state: TrainState, braking: StampedCurve = CURVE) -> str:
    """The message that says why no distance is known; "" where one is."""
    decision = decide(CONFIG, NOW_NS, state, braking)
    assert decision.reading is not None or decision.level is Level.EMERGENCY_BRAKE
    return "" if decision.reading is not None else decision.message


def test_a_train_may_be_three_standard_deviations_ahead_and_faster() -> None:
    position = 5000.0 - 10.0 - NEEDED_M - 500.0
    unsure = TrainState(NOW_NS, position, 40.0, position_std_m=4.0, speed_std_mps=0.5)
    decision = decide(CONFIG, NOW_NS, unsure, CURVE._replace(position_m=position))
    assert decision.reading is not None
    # 40 to 41.5 m/s: (41.5^2 - 1600)/1.6/(1 - 1.5/50) = 78.8 m more, 2 s of build-up 3 m more, 12 m further ahead.
    assert decision.reading.margin_m == pytest.approx(500.0 - 78.769 - 3.0 - 12.0, abs=1e-3)
    assert decision.reading.supervised_mps == 41.5
    assert decision.reading.distance_to_target_m == 5000.0 - position


@pytest.mark.parametrize("sign", [1, -1])
def test_a_curve_lies_ahead_of_its_train_whichever_way_places_count(sign: int) -> None:
    places = CURVE._replace(position_m=3000.0, sign=sign).places_m
    assert places[0] == 3000.0
    assert places[-1] == pytest.approx(3000.0 + sign * 1000.0)  # 40 m/s at 0.8 m/s²
    assert np.all(sign * np.diff(places) > 0.0)


def test_since_its_state_a_train_may_have_accelerated() -> None:
    config = replace(CONFIG, acceleration_mps2=1.0, traction_cut_off_s=0.0)
    state = TrainState(NOW_NS - SECOND_NS, 1000.0, 40.0)
    decision = decide(config, NOW_NS, state, CURVE._replace(position_m=1040.0))
    assert decision.reading is not None
    assert decision.reading.supervised_mps == 41.0
    assert state.at_most(config, NOW_NS) == (1040.5, 41.0)
    # 0.5 m further, and 1600/1.6, above that (41.8^2 - 1600)/1.6/(1 - 1.8/50), and (41.0 + 0.4) 2 s.
    needed = 1000.0 + (41.8**2 - 1600.0) / 1.6 / (1.0 - 1.8 / 50.0) + 41.4 * 2.0
    assert decision.reading.margin_m == pytest.approx(5000.0 - 1040.5 - 10.0 - needed, abs=0.5)


@pytest.mark.parametrize(
    ("state", "message"),
    [
        (GOOD_STATE._replace(speed_std_mps=2.1), "state is too unsure: its speed has a standard deviation of 2.1 m/s"),
        (GOOD_STATE._replace(speed_std_mps=2.1), "at most 2 is used (max_speed_std_mps)"),
        (
            GOOD_STATE._replace(position_std_m=20.1),
            "its position has a standard deviation of 20.1 m, at most 20 is used (max_position_std_m)",
        ),
        (GOOD_STATE._replace(speed_std_mps=float("nan")), "its speed has a standard deviation of nan m/s"),
        (GOOD_STATE._replace(t_ns=NOW_NS + SECOND_NS // 9), "stamped 0.111 s ahead of the clock, at most 0.1 s"),
    ],
)
def test_a_state_that_is_too_unsure_or_ahead_of_time_is_unsafe_and_says_why(state: TrainState, message: str) -> None:
    assert message in judged(state)


@pytest.mark.parametrize("seconds", [-1.5, 0.0, 1.5])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_curve_may_begin_as_far_off_as_a_train_can_change_its_speed_meanwhile(seconds: float, sign: float) -> None:
    """By 3 m/s^2 for 1.5 s, 3.375 m; 10 m of margin, and 1 m/s and 2 m for three standard deviations."""
    state = TrainState(NOW_NS, 1000.0, 40.0, position_std_m=2.0 / 3.0, speed_std_mps=1.0 / 3.0)
    allowed = 12.0 + abs(seconds) + 1.5 * seconds**2
    for off, message in ((allowed - 0.1, ""), (allowed + 0.1, "by which the train should be at")):
        place = 1000.0 - 40.0 * seconds + sign * off
        curve = CURVE._replace(t_ns=NOW_NS - round(seconds * SECOND_NS), position_m=place)
        assert message in _misplaced(CONFIG, curve, state)
        assert bool(message) == bool(_misplaced(CONFIG, curve, state))


def test_a_stamp_may_be_a_tenth_of_a_second_ahead() -> None:
    assert judged(GOOD_STATE._replace(t_ns=NOW_NS + SECOND_NS // 10)) == ""


@pytest.mark.parametrize("sigma", [0.0, 0.5])
def test_a_curve_covers_the_speed_and_its_margin_up_to_20_kmh(sigma: float) -> None:
    reach = 40.0 + MAX_EXCESS_MPS - 3.0 * sigma
    assert pytest.approx(20 / 3.6) == MAX_EXCESS_MPS
    covered = TrainState(NOW_NS, 0.0, reach - 1e-6, speed_std_mps=sigma)
    assert judged(covered) == ""
    assert "begins at 144.0 km/h but the train runs at 164.0 km/h at most" in judged(
        covered._replace(speed_mps=reach + 0.01)
    )


@pytest.mark.parametrize(
    ("braking", "message"),
    [
        (CURVE._replace(position_m=20.0), "begins at 20 m, by which the train should be at 20 m, but it is at 0 m"),
        (CURVE._replace(position_m=-11.0), "begins at -11 m"),
        (CURVE._replace(t_ns=NOW_NS - SECOND_NS), "begins at 0 m, by which the train should be at 40 m, but it is"),
        (
            CURVE._replace(curve=constant(40.0, deceleration_mps2=3.1)),
            "decelerates by 3.1 m/s^2, at most 3 is believed",
        ),
    ],
)
def test_a_curve_of_another_place_or_better_than_any_brake_is_unsafe(braking: StampedCurve, message: str) -> None:
    assert message in judged(GOOD_STATE, braking)


def test_a_curve_begins_at_the_train_as_well_as_its_place_is_known() -> None:
    assert judged(GOOD_STATE, CURVE._replace(position_m=9.9)) == ""
    assert judged(GOOD_STATE._replace(position_std_m=4.0), CURVE._replace(position_m=21.9)) == ""
    assert judged(GOOD_STATE, CURVE._replace(t_ns=NOW_NS - SECOND_NS, position_m=-40.0)) == ""


def complaints(place: Callable[[float], float], speed: Callable[[float], float], std_mps: float = 0.1) -> list[str]:
    """What is said of 60 s of states, two per second."""
    course, said = Course(), []
    for step in range(120):
        t = step / 2
        course = course.after(TrainState(step * SECOND_NS // 2, place(t), speed(t), 0.2, std_mps))
        said.append(course.complaint(CONFIG))
    return said


@pytest.mark.parametrize(
    ("place", "speed"),
    [
        (lambda t: 50.0 * t, lambda _: 50.0),
        (lambda t: 80.0 * t - t**2 / 2, lambda t: 80.0 - t),  # braking at 1 m/s^2
        (lambda t: 50.0 * t + 100.0 * (t > 30.0), lambda _: 50.0),  # a balise
        (lambda t: 50.0 * t - 100.0 * (t > 30.0), lambda _: 50.0),
        (lambda _: 7.0, lambda _: 0.0),
        (lambda t: 7.0 + np.sin(t), lambda t: 0.1 * np.cos(3.0 * t)),  # noise at a stand
        (lambda t: 100.0 - 1.9 * min(t / 10.0, 1.0), lambda t: -0.19 * (t < 10.0)),  # rolls back a little
    ],
)
def test_states_that_tell_of_one_way_are_believed(
    place: Callable[[float], float], speed: Callable[[float], float]
) -> None:
    assert set(complaints(place, speed)) == {""}


@pytest.mark.parametrize(
    ("place", "speed", "message", "latest"),
    [
        (lambda t: -83.0 * t, lambda _: 0.0, "the train runs back, by 41.5 m so far: positions must grow", 2),
        (lambda t: -83.0 * t, lambda _: -83.0, "the train runs back, by 41.5 m", 2),
        (lambda t: -0.5 * t, lambda _: 0.0, "the train runs back", 20),
        (lambda t: 5000.0 - 0.5 * t, lambda _: -0.5, "the train runs back", 20),
        (lambda t: 83.0 * t, lambda _: 0.0, "its places and its speeds differ by 41.5 m within 1 s", 2),
        (lambda t: 83.0 * t, lambda _: 80.0, "its places and its speeds differ", 20),
        (lambda _: 0.0, lambda _: 83.0, "is the position sensor right", 2),
        (lambda t: 83.0 * t, lambda _: 83.0 * 3.6, "its places and its speeds differ", 2),
    ],
)
def test_a_train_that_runs_back_or_against_its_speed_is_never_believed_again(
    place: Callable[[float], float], speed: Callable[[float], float], message: str, latest: int
) -> None:
    said = complaints(place, speed)
    assert message in next(text for text in said if text)
    assert all(said[latest:])


def test_a_train_may_roll_back_by_the_tolerance_and_what_its_places_leave_open() -> None:
    """2 m and three times 0.2 m and 0.2 m, beyond the greatest single step: of half a metre each the eighth is more."""
    said = complaints(lambda t: 5000.0 - t, lambda _: -1.0)
    assert [bool(text) for text in said] == [step >= 8 for step in range(120)]


def test_states_that_come_seldom_are_held_together_too() -> None:
    """Each would expire before the next one comes: between, and with each of them, there must be no all-clear."""
    course = Course()
    for step in range(20):
        course = course.after(TrainState(5 * step * SECOND_NS, -415.0 * step, 0.0, 0.2, 0.1))
        assert ("the train runs back" in course.complaint(CONFIG)) == (step >= 2)


def test_a_course_is_bounded_and_begins_anew_after_a_gap_or_a_jump_of_time() -> None:
    course = Course()
    for step in range(5000):
        course = course.after(TrainState(step * SECOND_NS // 100, 0.5 * step, 50.0))
    assert COURSE_S / 0.5 <= len(course.states) <= COURSE_S / 0.4 + 2
    newest = course.states[-1].t_ns
    for t_ns in (newest + round(10.1 * SECOND_NS), newest, newest - 100 * SECOND_NS):
        assert len(course.after(TrainState(t_ns, -1e6, 0.0)).states) == 1
