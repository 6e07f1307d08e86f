# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The least error of mu and excess of a curve: against a regression with the same unknowns, and where more is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tasks import computed_here

from adhesion_node.command.running import Running
from adhesion_node.core.physics.train import GRAVITY, Array
from adhesion_node.study.real.cases import chosen
from adhesion_node.study.real.point_mass import NAME as POINT_MASS
from adhesion_node.study.real.possible.courses import Course, on_the_mean
from adhesion_node.study.real.possible.excess import HOLDS, on_another_rail, way_ahead
from adhesion_node.study.real.possible.knowledge import (
    FAR_M,
    FAST_MPS,
    PITCH_STD,
    WORN_STD,
    apart,
    std_of,
    std_of_slowing,
)
from adhesion_node.study.real.possible.least import least
from adhesion_node.study.real.possible.unknown import FACTOR_STD, POWER_STD, STEP_S, Unknown, unknown_of
from sim_node.real.plant.scenarios import HIGH_SPEED
from sim_node.real.plant.train import USUAL, draw, stack
from sim_node.real.sensors.fitted import FITTED, Mounted
from sim_node.real.sensors.imu import Imu
from sim_node.real.sensors.position import Gnss
from sim_node.real.sensors.speed import Speedometer
from sim_node.real.sensors.timing import Timing
from sim_node.real.sensors.wheels import Wheels

COUNT, START = 150, 50
TIME_S = (np.arange(COUNT, dtype=np.float64) - START + 0.5) * STEP_S
COURSE = Course(
    TIME_S,
    np.full(COUNT, 30.0),
    np.where(TIME_S > 0.0, 0.08, 0.0),
    np.where(TIME_S > 0.0, 0.08, 0.0),
    (TIME_S > 2.0).astype(np.float64),
    (TIME_S > 0.0).astype(np.float64)[:, np.newaxis],
    (TIME_S > 0.0).astype(np.float64),
    [140],
    [],
    -np.inf,
    16,
    Unknown(*np.zeros((3, COUNT, 0))),
)
NO_SWINGS = np.zeros(COUNT)
TIMING = Timing(rate_hz=1.0 / STEP_S)


def test_what_no_papers_tell_is_how_the_trains_of_the_plant_differ() -> None:
    trains = stack([draw(HIGH_SPEED, USUAL, np.random.default_rng(seed)) for seed in range(4000)])
    assert (GRAVITY * trains.pitch_rad_per_mps2).std() == pytest.approx(PITCH_STD, rel=0.03)
    assert trains.radius_m.mean(axis=1).std() / HIGH_SPEED.wheel_radius_m == pytest.approx(WORN_STD, rel=0.03)


def told(course: Course = COURSE, scenario: str = POINT_MASS) -> Course:
    """A course with what is not known of it."""
    return course._replace(unknown=unknown_of(course, scenario))


def present(now: int) -> Array:
    """Weights of the mean over a second about a step."""
    return np.where(np.abs(np.arange(now + 4) - now) <= 3, 1.0 / 7.0, 0.0)


@pytest.mark.parametrize("now", [70, 140])
@pytest.mark.parametrize("speeds", [False, True])
def test_without_swings_it_is_a_regression(now: int, speeds: bool) -> None:
    """The least squares of place, speed, factor and power, written as such, with what is known beforehand as rows."""
    sensor = Speedometer(correlated_std_mps=0.0) if speeds else Gnss(0.0, white_std_m=0.5)
    speed = np.linspace(40.0, 10.0, COUNT)
    slowing = np.where(TIME_S > 0.0, 0.08, 0.0) * GRAVITY * STEP_S
    lost, bent = np.cumsum(slowing), np.cumsum(slowing * np.log(speed / speed[0]))
    time_s = TIME_S - TIME_S[0]
    rows = np.stack(
        [0 * time_s, 0 * time_s + 1, -lost, -bent]
        if speeds
        else [0 * time_s + 1, time_s, -STEP_S * np.cumsum(lost), -STEP_S * np.cumsum(bent)]
    )
    rows = rows.T[: now + 1] / (0.05 if speeds else 0.5)
    information = rows.T @ rows + np.diag([FAR_M**-2, FAST_MPS**-2, FACTOR_STD**-2, POWER_STD**-2])
    mean = present(now)
    wanted = np.array([0.0, 0.0, 0.08, 0.08 * mean @ np.log(speed[: mean.size] / speed[0])])
    expected = float(np.sqrt(wanted @ np.linalg.inv(information) @ wanted))
    course = told(COURSE._replace(speed_mps=speed))
    assert std_of(course, now, mean, [Mounted(sensor, TIMING, "one")], NO_SWINGS) == pytest.approx(expected, rel=1e-6)


def test_behind_a_change_of_the_rail_little_is_known() -> None:
    """What was learnt before it says nothing of what is behind; a rail that does not change is known by then."""
    before = (TIME_S > 0.0) & (TIME_S <= 10.0)
    changed = COURSE._replace(factors=np.column_stack([before, TIME_S > 10.0]).astype(np.float64))
    mounted = tuple(FITTED["gnss"].sensors.values())
    known = [
        [std_of(told(one), now, present(now), mounted, NO_SWINGS) for now in (106, 145)] for one in (changed, COURSE)
    ]
    assert known[0][0] > 0.75 * 0.08 * FACTOR_STD
    assert known[0][0] > 3.0 * known[0][1]
    assert known[1][0] < 0.1 * 0.08


def test_swings_that_no_sensor_sees_in_time_stay() -> None:
    """White swings of 10 %: positions of half a metre tell little of the present second."""
    swings = np.zeros(COUNT)
    swings[0] = 0.01
    mounted = tuple(FITTED["white"].sensors.values())
    alone = 0.08 * 0.1 / np.sqrt(round(1.0 / STEP_S) + 1)
    assert std_of(told(), 140, present(140), mounted, swings) == pytest.approx(alone, rel=0.15)


def test_an_accelerometer_is_known_as_the_train_pitches() -> None:
    """One without any noise, on a train whose factor is known beforehand by half: what is left is the pitch."""
    sure = Imu(bias_std_mps2=0.0, white_std_mps2=1e-6, mounting_std_rad=0.0)
    left = std_of(told(), 140, present(140), [Mounted(sure, TIMING, "one")], NO_SWINGS)
    assert left == pytest.approx(0.08 / np.hypot(1.0 / PITCH_STD, 1.0 / FACTOR_STD), rel=1e-3)


@pytest.mark.parametrize(("more", "fewer"), [("gnss_doppler", "gnss"), ("gnss_imu", "gnss"), ("gnss", "gnss_1hz")])
def test_who_measures_more_knows_more(more: str, fewer: str) -> None:
    swings = 0.03**2 * np.exp(-np.arange(COUNT) * STEP_S / 1.5)
    known = [std_of(told(), 120, present(120), tuple(FITTED[name].sensors.values()), swings) for name in (more, fewer)]
    assert known[0] < known[1]


@pytest.mark.parametrize("speeds", [False, True])
def test_rails_are_told_apart_by_what_no_place_and_speed_explain(speeds: bool) -> None:
    """The residual of a least-squares fit of place and speed to what one rail would have shown more than the other."""
    sensor = Speedometer(correlated_std_mps=0.0, scale_std=0.0) if speeds else Gnss(0.0, white_std_m=0.5)
    now, other = 110, np.where(TIME_S > 0.0, 0.03, 0.0)
    slower = GRAVITY * STEP_S * np.cumsum(COURSE.used - other)
    shown = (slower if speeds else STEP_S * np.cumsum(slower))[: now + 1]
    rows = np.vander(TIME_S[: now + 1] - TIME_S[0], 1 if speeds else 2)
    _, (squared,), *_ = np.linalg.lstsq(rows, shown, rcond=None)
    expected = float(np.sqrt(squared)) / (0.05 if speeds else 0.5)
    got = apart(COURSE, now, np.stack([other, COURSE.used]), [Mounted(sensor, TIMING, "one")], NO_SWINGS)
    assert got == pytest.approx([expected, 0.0], rel=1e-3)


def test_a_curve_is_as_long_as_on_any_rail_that_looks_the_same() -> None:
    """To a standstill within the course, 0.08 of 0.085: without sensors that of 0.02, with perfect ones its own."""
    fast = 0.085 * GRAVITY * (COUNT - START) * STEP_S
    speed = np.minimum(fast, fast - 0.085 * GRAVITY * TIME_S)
    course = told(COURSE._replace(speed_mps=np.maximum(speed, 0.0), counted=range(START, COUNT)))
    blind, poor, good, sure = (
        on_another_rail(course, START + 10, [Mounted(Gnss(0.0, white_std_m=std), TIMING, "one")], NO_SWINGS)
        for std in (100.0, 3.0, 0.3, 0.003)
    )
    now_s = TIME_S[START + 10] + 0.5 * STEP_S
    faster = (fast - 0.025 * GRAVITY * now_s) / (fast - 0.085 * GRAVITY * now_s)
    assert blind == pytest.approx(0.99 * (faster**2 * 0.085 / 0.025 - 1.0), rel=0.05)  # of steps of 0.2 s
    assert blind > poor > good > sure
    assert sure < 0.01


def test_the_mean_over_days_is_what_they_have_in_common() -> None:
    """Of days that differ by a factor nothing is left to swing; what one has alone is its swing."""
    speed = np.linspace(40.0, 5.0, COUNT)
    law = 0.1 * np.exp(-0.02 * speed + 2e-4 * speed**2)
    always = COURSE._replace(speed_mps=speed, swings=np.ones(COUNT), factors=np.ones((COUNT, 1)))
    days = [always._replace(used=factor * law) for factor in (0.8, 1.0, 1.1)]
    for day, found in zip(days, on_the_mean(days), strict=True):
        assert found.smooth == pytest.approx(day.used)
    bump = 1.0 + 0.1 * np.sin(np.arange(COUNT) / 5.0)
    *_, last = on_the_mean([*days, days[1]._replace(used=law * bump)])
    assert last.used / last.smooth == pytest.approx(bump, rel=0.02)


def test_wheels_that_are_told_by_how_much_they_slide_are_a_speedometer_of_worn_ones() -> None:
    speedometer = Speedometer(white_std_mps=30.0 * 0.003 / 4.0, correlated_std_mps=0.0, scale_std=WORN_STD)
    known = [
        std_of(told(), 120, present(120), [Mounted(sensor, TIMING, "one")], NO_SWINGS)
        for sensor in (Wheels(noise=0.003), speedometer)
    ]
    assert known[0] == pytest.approx(known[1], rel=1e-9)


def test_a_perfect_speed_tells_what_slows_the_train_down_but_not_by_what() -> None:
    """How much of it is rotating mass and running resistance its papers tell, to within what trains differ by."""
    perfect = [Mounted(Speedometer(1e-5, 0.0), TIMING, "one")]
    train = told(scenario="wet")
    assert std_of(told(), 140, present(140), perfect, NO_SWINGS) < 1e-4 * 0.08
    assert std_of_slowing(train, 140, present(140), perfect, NO_SWINGS) < 1e-4 * 0.08
    resisting = (0.1**2 + 0.05**2) ** 0.5 * (3.5e3 + 110.0 * 30.0 + 9.0 * 30.0**2) / (380e3 * GRAVITY)
    left = std_of(train, 140, present(140), perfect, NO_SWINGS)
    assert left == pytest.approx(np.hypot(USUAL.rotating_std * 0.08, resisting), rel=0.1)


def test_a_grade_that_is_not_told_hides_from_an_accelerometer_alone() -> None:
    felt, seen = ([Mounted(sensor, TIMING, "one")] for sensor in (Imu(), Speedometer()))
    level, undulating = told(scenario="wet"), told(scenario="undulating")
    assert np.sqrt((undulating.unknown.grade**2).sum(axis=1)).mean() == pytest.approx(0.004, rel=0.2)
    known = [[std_of(one, 140, present(140), some, NO_SWINGS) for one in (level, undulating)] for some in (felt, seen)]
    assert known[0][1] == pytest.approx(known[0][0], rel=1e-3)
    assert known[1][1] > 1.5 * known[1][0]


def test_a_curve_allows_for_a_brake_that_nothing_has_told_of_yet() -> None:
    """Without sensors, where the brake limits: mass and pads of trains of this type, 5 % each."""
    course = told(COURSE._replace(asked=[]), "dry")
    blind = [Mounted(Gnss(0.0, white_std_m=100.0), TIMING, "one")]
    expected = np.expm1(HOLDS * np.hypot(0.05, 0.05))
    assert way_ahead(course, 60, blind, NO_SWINGS) == pytest.approx(expected, rel=0.15)


def test_a_curve_counts_on_no_rise_of_the_rail() -> None:
    """By perfect sensors, on a rail that will give twice as much: as long as if it stayed as it is."""
    speed = np.linspace(30.0, 1.0, COUNT)
    rises = np.where(TIME_S > 0.0, 0.04, 0.0) * np.where(TIME_S > 6.0, 2.0, 1.0)
    course = told(COURSE._replace(speed_mps=speed, used=rises, smooth=rises))
    sure = [Mounted(Speedometer(1e-5, 0.0), TIMING, "one")]
    now, slowing = 75, speed[75] ** 2 / (2.0 * GRAVITY * STEP_S * speed[75:].sum())
    lacking = 0.04 * speed[(TIME_S > 6.0)].sum() / speed[now:].sum()
    assert way_ahead(course, now, sure, NO_SWINGS) == pytest.approx(slowing / (slowing - lacking) - 1.0, rel=0.05)
    brake_limits = course._replace(swings=NO_SWINGS)
    assert way_ahead(brake_limits, now, sure, NO_SWINGS) < 0.5 * way_ahead(course, now, sure, NO_SWINGS)


def test_a_case_has_bounds_where_its_sensors_are_honest(tmp_path: Path) -> None:
    names = "wet gnss", "wet gnss_doppler", "wet gnss_wheels", "dry gnss", "patches gnss", "wet tacho"
    cases = [next(case for case in chosen(name) if case.name == name) for name in names]
    with computed_here():
        found = least(cases, Running(tmp_path))
    errors, excesses = zip(*(found[case] for case in cases), strict=True)
    positions, speeds, wheels, *_ = errors
    assert wheels < speeds < 0.7 * positions
    assert excesses[2] < excesses[1] < 0.6 * excesses[0]
    assert errors[3] is None  # the brake limits
    assert excesses[3] > 0.8 * excesses[0]  # a rail of leaves looks the same for as long
    assert errors[4] > 1.5 * positions
    assert found[cases[-1]] == (None, None)  # its errors are those of a slide
