# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Resistance of grades, curves and tunnels, (7)-(10), and the profile that adds them up."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from adhesion_node.core.physics.track import LEVEL, MANY, Curve, Grade, Section, Track, Tunnel, parse_track


def test_equation_8_grade() -> None:
    assert Grade(0.0, 4000.0, 12.0).resistance(200.0) == pytest.approx(0.003)  # 12 m in 4 km
    assert Grade(1000.0, 2000.0, -20.0).resistance(200.0) == pytest.approx(-0.02)


def test_equation_9_curve_longer_than_the_train() -> None:
    assert Curve(0.0, 201.0, 3000.0, 4.0).resistance(200.0) == pytest.approx(0.0002)  # 0.6/3000


@pytest.mark.parametrize("length_m", [100.0, 200.0])
def test_equation_9_curve_no_longer_than_the_train(length_m: float) -> None:
    # 0.0105 x 2 degrees / 200 m
    assert Curve(0.0, length_m, 3000.0, 2.0).resistance(200.0) == pytest.approx(0.000105)


def test_equation_10_tunnel() -> None:
    # 0.00013e-3 x 3600 m = 0.000468 N/N: 0.0046 m/s2, not the 4.6 m/s2 of the misprint
    assert Tunnel(500.0, 4100.0).resistance(200.0) == pytest.approx(0.000468)


def test_equation_7_adds_overlapping_sections() -> None:
    grade, curve, tunnel = Grade(0.0, 1000.0, 5.0), Curve(500.0, 1500.0, 4800.0, 12.0), Tunnel(800.0, 1200.0)
    track = Track((tunnel, grade, curve), train_length_m=80.0)  # on grade and curve in steps of 10 m
    # 5/1000 = 0.005; 0.6/4800 = 0.000125; 0.00013e-3 x 400 = 0.000052
    positions = np.array([-1.0, 80.0, 499.9, 580.0, 800.0, 999.9, 1080.0, 1199.9, 1200.0, 1499.9, 1580.0, 1e6])
    expected = [0, 0.005, 0.005, 0.005125, 0.005177, 0.005177, 0.000177, 0.000177, 0.000125, 0.000125, 0, 0]
    assert track.specific_resistance(positions) == pytest.approx(np.array(expected), abs=1e-15)
    assert track.specific_resistance(positions.reshape(3, 4)).shape == (3, 4)


@pytest.mark.parametrize(
    ("section", "per_wagon"),
    [
        (Grade(300.0, 2300.0, -16.0), -0.008),
        (Grade(300.0, 400.0, 1.0), 0.01),
        (Curve(300.0, 2300.0, 600.0, 191.0), 0.001),
        (Curve(300.0, 400.0, 600.0, 9.54), 0.0010017),  # (9), of so short a one, is what the wagons on it feel
    ],
)
def test_a_grade_and_a_curve_count_by_the_wagons_that_are_on_them(section: Section, per_wagon: float) -> None:
    """The oracle adds up a train of 4000 wagons behind the front end; steps of an eighth are off by a sixteenth."""
    track, behind = Track((section,), train_length_m=400.0), np.linspace(0.0, 400.0, 4001)
    for front in np.linspace(200.0, 2900.0, 271):
        on = np.mean((front - behind >= section.start_m) & (front - behind < section.end_m))
        assert track.specific_resistance(float(front)) == pytest.approx(per_wagon * on, abs=abs(per_wagon) / 15)
    steps = track.specific_resistance(np.arange(0.05, 4000.0, 0.1))
    assert 0.1 * steps.sum() == pytest.approx(per_wagon * (section.end_m - section.start_m), rel=1e-3)


@pytest.mark.parametrize("piece_m", [20.0, 137.3, 200.0, 1500.0])
def test_a_steady_grade_is_the_same_however_it_is_cut(piece_m: float) -> None:
    ends = np.append(np.arange(0.0, 5000.0, piece_m), 5000.0)
    pieces = tuple(Grade(*map(float, (a, b, -0.02 * (b - a)))) for a, b in itertools.pairwise(ends))
    track, whole = Track(pieces), Track((Grade(0.0, 5000.0, -100.0),))
    places = np.linspace(-100.0, 5300.0, 2001)
    assert track.specific_resistance(places) == pytest.approx(whole.specific_resistance(places), abs=2.6e-3)  # a step
    assert track.least_resistance(0.0, 6e3) == pytest.approx(-0.02, abs=1e-12)


def test_equal_sections_count_twice_and_shared_ends_once() -> None:
    twice = Track((Grade(0.0, 300.0, 3.0), Grade(0.0, 300.0, 3.0)))
    assert float(twice.specific_resistance(np.array(250.0))) == pytest.approx(0.02)
    chain = Track((Grade(0.0, 300.0, 3.0), Grade(300.0, 600.0, 6.0)))
    assert chain.specific_resistance(np.array([299.9, 500.0])) == pytest.approx([0.01, 0.02])


def test_the_least_resistance_is_that_of_all_places_between() -> None:
    rng = np.random.default_rng(1)
    sections: list[Section] = []
    for start, length, kind in zip(rng.uniform(0, 5e3, 30), rng.uniform(10, 2e3, 30), range(30), strict=True):
        end = float(start + length)
        choice: tuple[Section, ...] = (Grade(start, end, -1.0), Curve(start, end, 900.0, 5.0), Tunnel(start, end))
        sections.append(choice[kind % 3])
    track, places = Track(tuple(sections)), rng.uniform(-100, 8e3, 500)
    alone = np.sum([Track((section,)).specific_resistance(places) for section in sections], axis=0)
    assert track.specific_resistance(places) == pytest.approx(alone, abs=5e-4)  # the steps are others
    for x, end in ((-50.0, 9e3), (1234.0, 1300.0), (3000.0, 4500.0), (7900.0, 9e3)):
        between = np.linspace(x, end, 200_001)
        assert track.least_resistance(x, end) == pytest.approx(track.specific_resistance(between).min(), abs=1e-14)


@pytest.mark.parametrize("middle_m", [400.0, 800.0, 1200.0])
def test_many_places_at_once_are_each_in_their_section(middle_m: float) -> None:
    track = Track((Grade(0.0, 1000.0, 5.0), Tunnel(800.0, 1200.0)))
    places = np.random.default_rng(2).normal(middle_m, 20.0, (3, MANY))
    one_by_one = [float(track.specific_resistance(np.array(place))) for place in places.flat]
    assert track.specific_resistance(places).tolist() == np.reshape(one_by_one, places.shape).tolist()
    assert [track.specific_resistance(place) for place in places.ravel().tolist()] == one_by_one


def test_level_line_and_least_resistance() -> None:
    assert LEVEL.specific_resistance(np.array([0.0, 1.0])).tolist() == [0.0, 0.0]
    hill = Track((Grade(0.0, 1000.0, -10.0), Grade(1000.0, 2000.0, 10.0)))
    assert hill.least_resistance(-5.0, 2e3) == pytest.approx(-0.01)
    assert hill.least_resistance(-5.0, -1.0) == 0.0
    assert -0.01 < hill.least_resistance(1050.0, 2e3) < 0.0  # the rear is still on the fall
    assert hill.least_resistance(1200.0, 3e3) == 0.0  # the level line behind the climb
    assert LEVEL.least_resistance(0.0, 1e3) == 0.0


def test_parses_a_text() -> None:
    track = parse_track(" grade 0 2000 -10; curve 500 1500 4800 12 ;tunnel 1000 3000;", 400.0)
    expected = (Grade(0.0, 2000.0, -10.0), Curve(500.0, 1500.0, 4800.0, 12.0), Tunnel(1000.0, 3000.0))
    assert track == Track(expected, 400.0)
    assert parse_track("", 200.0).sections == ()


@pytest.mark.parametrize("text", ["hill 0 1 2", "grade 0 1", "grade 0 1 2 3", "tunnel a b", "curve 1 2 3"])
def test_refuses_a_text_it_cannot_read(text: str) -> None:
    with pytest.raises(ValueError, match=f"track section '{text}': write 'grade START END RISE'"):
        parse_track(f"tunnel 0 100; {text}", 200.0)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (Tunnel(5.0, 5.0), r"Tunnel\(start_m=5\.0, end_m=5\.0\): give finite numbers and an end_m beyond"),
        (Grade(0.0, math.inf, 1.0), "give finite numbers"),
        (Grade(0.0, 100.0, math.nan), "give finite numbers"),
        (Curve(0.0, 100.0, 0.0, 1.0), "give a radius_m of at least 10 m"),
        (Curve(0.0, 100.0, math.nextafter(10.0, 0.0), 1.0), "give a radius_m of at least 10 m"),
        (Grade(0.0, 1e6, 5e6), "rises by 500 %, and trains climb 15 % at most: rise_m is the height gained between"),
        (Grade(0.0, 100.0, -15.1), "rises by -15.1 %, and trains climb 15 % at most"),
        (Curve(0.0, 100.0, 300.0, -20.0), "give an angle_deg of at least 0, to either side"),
        (Tunnel(-1e5, 1e5), "none is longer than 70 km: give each by itself"),
        (("grade", 0, 1, 2), r"track section \('grade', 0, 1, 2\): give a Grade, a Curve or a Tunnel"),
    ],
)
def test_refuses_an_impossible_section(section: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Track((Tunnel(0.0, 1e3), section))


@pytest.mark.parametrize("section", [Grade(0.0, 100.0, 15.0), Grade(0.0, 100.0, -15.0), Curve(0.0, 100.0, 10.0, 1.0)])
def test_takes_the_steepest_and_the_tightest(section: Section) -> None:
    assert Track((section,)).sections == (section,)


def test_refuses_what_is_no_tuple_of_sections() -> None:
    nothing: Any = Grade(0.0, 1e6, 10.0)
    with pytest.raises(ValueError, match=r"track sections = Grade\(.*\): give a tuple of them, \(Grade\("):
        Track(nothing)


@pytest.mark.parametrize("length_m", [-200.0, 0.0, math.inf, math.nan, "200"])
def test_refuses_what_is_no_length_of_a_train(length_m: Any) -> None:
    with pytest.raises(ValueError, match=f"track train_length_m = {length_m!r}: give a length above 0 m"):
        Track((), length_m)
