# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The track's centre line: places on it against geodesics of an independent way, its ends, its grades, its speed."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable

import numpy as np
import pytest
from pyproj import Geod

from adhesion_node.core.physics.track import Track
from adhesion_node.core.physics.train import Array
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.track_line import TrackLine, line_of

GEOD = Geod(ellps="WGS84")
STD_M, MOST_M = 1.0, 25.0


def walked(latitude: float, longitude: float, azimuths: Iterable[float], step_m: float) -> tuple[Array, Array]:
    """Return the points of a way of equal geodesic steps."""
    lat, lon = [latitude], [longitude]
    for azimuth in azimuths:
        x, y, _ = GEOD.fwd(lon[-1], lat[-1], azimuth, step_m)
        lat.append(y)
        lon.append(x)
    return np.array(lat), np.array(lon)


def beside(lat: Array, lon: Array, index: int, way_m: float, left_m: float) -> tuple[float, float]:
    """Return the point so far behind a point of the line and so far to the left of it."""
    azimuth, _, _ = GEOD.inv(lon[index], lat[index], lon[index + 1], lat[index + 1])
    x, y, back = GEOD.fwd(lon[index], lat[index], azimuth, way_m)
    x, y, _ = GEOD.fwd(x, y, back + 180.0 - 90.0, left_m)
    return y, x


def placed(line: TrackLine, latitude: float, longitude: float) -> float:
    return line.place(latitude, longitude, STD_M, MOST_M).along_m


CURVED = 40.0 + 30.0 * np.sin(np.arange(10_000) / 150.0)
"""Azimuths of 10 m steps: 100 km of curves of 3 km and more."""

BEGINNINGS = {"alps": (46.5, 8.0), "arctic": (68.4, 17.4), "antimeridian": (-17.0, 179.9), "equator": (-0.2, 36.0)}


@pytest.mark.parametrize("beginning", BEGINNINGS.values(), ids=BEGINNINGS)
def test_a_place_is_found_to_a_centimetre_on_100_km_of_curves(beginning: tuple[float, float]) -> None:
    lat, lon = walked(*beginning, CURVED, 10.0)
    line = line_of("line", lat, lon, None, 500.0)
    rng = np.random.default_rng(1)
    for index in rng.integers(1, CURVED.size - 1, 100):
        way_m, left_m = rng.uniform(1.0, 9.0), rng.uniform(-2.0, 2.0)
        place = line.place(*beside(lat, lon, index, way_m, left_m), STD_M, MOST_M)
        assert place.along_m == pytest.approx(500.0 + 10.0 * index + way_m, abs=0.01)
        assert place.cross_m == pytest.approx(abs(left_m), abs=0.01)
        azimuth, _, _ = GEOD.inv(lon[index], lat[index], lon[index + 1], lat[index + 1])
        assert math.degrees(math.atan2(place.east, place.north)) == pytest.approx(azimuth, abs=0.01)


@pytest.mark.parametrize(
    ("start", "end"),
    [((50.0, 8.0), (50.4, 9.3)), ((-17.0, 179.5), (-17.2, -179.6)), ((89.9, 20.0), (89.8, 200.0))],
    ids=["long", "antimeridian", "across the pole"],
)
def test_a_straight_of_two_points_is_a_geodesic(start: tuple[float, float], end: tuple[float, float]) -> None:
    azimuth, _, length_m = GEOD.inv(start[1], start[0], end[1], end[0])
    ends = np.array([start, end])
    line = line_of("line", ends[:, 0], ends[:, 1], None, 0.0)
    for share in (0.001, 0.3, 0.999):
        x, y, _ = GEOD.fwd(start[1], start[0], azimuth, share * length_m)
        place = line.place(y, x, STD_M, MOST_M)
        assert place.along_m == pytest.approx(share * length_m, abs=1e-3)
        assert place.cross_m < 1e-3


def test_a_way_with_heights_is_as_long_as_the_rail() -> None:
    """Uphill by 4 % the rail is longer by 0.08 %, and 2000 m above the sea by 0.03 %."""
    lat, lon = walked(46.5, 8.0, [70.0] * 100, 50.0)
    flat, uphill, high = (
        line_of("line", lat, lon, heights, 0.0)
        for heights in (None, np.linspace(0.0, 200.0, 101), np.full(101, 2000.0))
    )
    assert flat.along_m[-1] == pytest.approx(5000.0, abs=1e-3)
    assert uphill.along_m[-1] == pytest.approx(math.hypot(5000.0, 200.0), abs=0.1)
    assert high.along_m[-1] == pytest.approx(5000.0 * (1 + 2000.0 / 6.38e6), abs=0.01)
    assert placed(high, lat[50], lon[50]) == pytest.approx(high.along_m[-1] / 2, abs=0.01)


def test_points_that_repeat_do_no_harm() -> None:
    lat, lon = walked(46.5, 8.0, [70.0] * 4, 50.0)
    line = line_of("line", np.repeat(lat, 3), np.repeat(lon, 3), np.repeat(np.arange(5.0), 3), 0.0)
    assert placed(line, lat[2], lon[2]) == pytest.approx(100.0, abs=0.05)
    with pytest.raises(ValueError, match="all points are the same"):
        line_of("line", lat[[0, 0]], lon[[0, 0]], None, 0.0)


STRAIGHT = walked(46.5, 8.0, [70.0] * 100, 50.0)


@pytest.mark.parametrize(
    ("index", "way_m", "left_m", "text"),
    [
        (50, 20.0, 26.0, r"latitude, longitude = 46\.\d{7}, 8\.\d{7}: 26 m beside line: is track_line .*max_cross_tr"),
        (50, 20.0, -40_000.0, r": 40000 m beside line"),
        (0, -5.0, 1.0, r"beyond an end of line: .*does it reach beyond the ends"),
        (99, 55.0, -1.0, r"beyond an end of line"),
    ],
)
def test_what_is_not_on_the_line_is_refused(index: int, way_m: float, left_m: float, text: str) -> None:
    line = line_of("line", *STRAIGHT, None, 0.0)
    with pytest.raises(Rejected, match=text) as refusal:
        line.place(*beside(*STRAIGHT, index, way_m, left_m), STD_M, MOST_M)
    assert refusal.value.reason == "OFF_TRACK"


def refused(line: TrackLine, latitude: float, longitude: float) -> str | None:
    try:
        line.place(latitude, longitude, STD_M, MOST_M)
    except Rejected as refusal:
        return refusal.reason
    return None


def test_where_the_line_comes_by_twice_nothing_is_guessed() -> None:
    """Within some metres of where a spiral crosses its own way nothing is used; beside it the place is clear."""
    lat, lon = walked(46.5, 8.0, [0.0] * 20 + list(np.arange(0.0, 270.0, 18.0)) + [270.0] * 20, 100.0)
    line = line_of("line", lat, lon, None, 0.0)
    points = [beside(lat, lon, way_m // 100, way_m % 100, 0.0) for way_m in range(1, 2000, 2)]
    reasons = [refused(line, *point) for point in points]
    assert set(reasons) == {None, "AMBIGUOUS"}
    assert 2 <= reasons.count("AMBIGUOUS") <= 6
    for way_m, point, reason in zip(range(1, 2000, 2), points, reasons, strict=True):
        assert reason or placed(line, *point) == pytest.approx(way_m, abs=0.01)


def test_out_and_back_on_two_tracks_side_by_side_is_two_places() -> None:
    lat, lon = walked(46.5, 8.0, [0.0] * 50 + [90.0] + [180.0] * 50, 4.0)
    line = line_of("line", lat, lon, None, 0.0)
    with pytest.raises(Rejected, match=r"on two places 20\d m apart of line: .* a track_line of its own"):
        line.place(*beside(lat, lon, 25, 0.0, -2.0), STD_M, MOST_M)
    assert line.place(*beside(lat, lon, 25, 0.0, -0.2), 0.02, MOST_M).along_m == pytest.approx(100.0, abs=0.01)


def test_a_narrow_loop_of_a_tram_is_no_second_place() -> None:
    lat, lon = walked(46.5, 8.0, [0.0] * 50 + list(np.linspace(0.0, 180.0, 36)) + [180.0] * 50, 2.0)
    line = line_of("line", lat, lon, None, 0.0)
    assert placed(line, *beside(lat, lon, 67, 1.0, 0.0)) == pytest.approx(135.0, abs=0.1)


def test_heights_tell_the_grade_under_the_train() -> None:
    """A ramp of 10 per mille between 3 and 5 km; the oracle: by how much the front end is higher than the rear."""
    lat, lon = walked(46.5, 8.0, [70.0] * 600, 10.0)
    heights = np.clip((np.arange(601) * 10.0 - 2000.0) * 0.01, 0.0, 20.0)
    grades = line_of("line", lat, lon, heights, 1000.0).grades(400.0)
    assert (grades[0].start_m, grades[-1].end_m) == pytest.approx((1000.0, 7000.0), abs=1.0)
    assert sum(grade.rise_m for grade in grades) == pytest.approx(20.0, rel=0.01)
    track, front = Track(grades, 400.0), np.arange(1500.0, 6900.0, 25.0)
    rises = np.clip((front - 3000.0) * 0.01, 0.0, 20.0) - np.clip((front - 3400.0) * 0.01, 0.0, 20.0)
    assert track.specific_resistance(front) == pytest.approx(rises / 400.0, abs=1.5e-3)
    assert line_of("line", lat, lon, None, 0.0).grades(400.0) == ()


@pytest.mark.parametrize("seed", range(5))
def test_rough_heights_are_no_steep_railway(seed: int) -> None:
    """Errors of 4 m every 10 m, as of a terrain model."""
    lat, lon = walked(46.5, 8.0, [70.0] * 600, 10.0)
    heights = 0.2 * np.arange(601.0)
    rough: Array = heights + 4.0 * np.random.default_rng(seed).standard_normal(heights.size)
    told = [Track(line_of("line", lat, lon, each, 0.0).grades(200.0), 200.0) for each in (heights, rough)]
    places = np.arange(300.0, 5900.0, 10.0)
    exact, found = (track.specific_resistance(places) for track in told)
    assert exact == pytest.approx(0.02, abs=1e-5)
    assert np.sqrt(np.mean((found - exact) ** 2)) < 0.012


def test_heights_in_another_unit_are_told() -> None:
    lat, lon = walked(46.5, 8.0, [70.0] * 200, 10.0)
    line = line_of("line", lat, lon, np.linspace(0.0, 400.0, 201), 0.0)
    with pytest.raises(ValueError, match=r"line: rises 0\.196 m per m at \d+ m: no railway is steeper than 0\.15"):
        line.grades(200.0)


def test_a_line_of_100_000_points_is_searched_in_less_than_a_millisecond() -> None:
    lat, lon = walked(46.5, 8.0, np.repeat(CURVED, 10), 1.0)
    line = line_of("line", lat, lon, None, 0.0)
    points = [beside(lat, lon, index, 0.5, 1.0) for index in range(500, 99_500, 500)]
    spent = []
    for point in points:
        started = time.thread_time()
        placed(line, *point)
        spent.append(time.thread_time() - started)
    assert np.median(spent) < 1e-3
