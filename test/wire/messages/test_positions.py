# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Fixes and odometry as positions along the track: their variances, and every refusal by its text."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pyproj import Geod

from adhesion_node.wire.line import Line
from adhesion_node.wire.messages.codec import plain
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.topics import FIX, ODOMETRY
from adhesion_node.wire.track_line import line_of

T_NS = 12_000_000_034
GEOD = Geod(ellps="WGS84")
AZIMUTH = 30.0
START = (47.0, 8.0)


def at(way_m: float) -> tuple[float, float]:
    x, y, _ = GEOD.fwd(START[1], START[0], AZIMUTH, way_m)
    return y, x


ENDS = np.array([START, at(3000.0)])
LINE = Line(track=line_of("line.geojson", ENDS[:, 0], ENDS[:, 1], None, 10_000.0))


def fix(way_m: float = 1000.0, covariance: tuple[float, ...] = (0.0,) * 9, kind: int = 0, **changed: Any) -> Any:
    message = FIX.build(plain, T_NS, (*at(way_m), math.nan), 1.0, "gnss")
    for name, value in {"position_covariance": covariance, "position_covariance_type": kind, **changed}.items():
        setattr(message, name, value)
    return message


def horizontal(east: float, mixed: float, north: float) -> tuple[float, ...]:
    return (east, mixed, 0.0, mixed, north, 0.0, 0.0, 0.0, 99.0)


def test_a_fix_is_a_position_along_the_track_whatever_its_frame() -> None:
    sample = FIX.read(fix(), LINE)
    assert (sample.t_ns, sample.position_m) == (T_NS, pytest.approx(11_000.0, abs=1e-3))
    backwards = [FIX.read(fix(way_m), LINE).position_m for way_m in (2000.0, 1990.0)]
    assert backwards == pytest.approx([12_000.0, 11_990.0], abs=1e-3), "a train may run against the line"


@pytest.mark.parametrize(
    ("covariance", "kind", "variance_m2"),
    [
        (horizontal(0.0, 0.0, 0.0), 0, 9.0),
        (horizontal(0.0, 0.0, 0.0), 2, 9.0),
        (horizontal(4.0, 0.0, 4.0), 0, 9.0),  # of unknown type: no number counts
        (horizontal(4.0, 0.0, 4.0), 1, 4.0),
        (horizontal(4.0, 0.0, 1.0), 2, 4.0 * 0.25 + 1.0 * 0.75),
        (horizontal(4.0, 1.0, 1.0), 3, 1.75 + 2.0 * math.sin(math.radians(30.0)) * math.cos(math.radians(30.0))),
    ],
)
def test_the_variance_is_that_along_the_track(covariance: tuple[float, ...], kind: int, variance_m2: float) -> None:
    """Along a track of azimuth 30 degrees: sin^2 of the east, cos^2 of the north, 2 sin cos of what mixes them."""
    assert FIX.read(fix(covariance=covariance, kind=kind), LINE).variance_m2 == pytest.approx(variance_m2, rel=1e-3)


@pytest.mark.parametrize(
    ("message", "reason", "text"),
    [
        (fix(status=plain("", status=-1)), "NO_FIX", r"status = -1: the receiver has no fix"),
        (fix(latitude=0.0, longitude=0.0), "NO_FIX", r"latitude = longitude = 0: the receiver has no fix"),
        (fix(latitude=math.nan), "NOT_FINITE", r"latitude = nan"),
        (fix(latitude=91.0), "IMPLAUSIBLE_FIX", r"latitude = 91: latitude is in degrees"),
        (fix(longitude=181.0), "IMPLAUSIBLE_FIX", r"longitude = 181: "),
        (fix(latitude=47.01, longitude=8.0), "OFF_TRACK", r"= 47\.0100000, 8\.0000000: 55\d m beside line\.geojson"),
        (fix(3010.0), "OFF_TRACK", r"beyond an end of line\.geojson"),
        (fix(covariance=horizontal(-1.0, 0.0, 4.0), kind=2), "BAD_VARIANCE", r"covariance\[0\] = -1"),
        (fix(covariance=horizontal(1.0, -9.0, 1.0), kind=3), "BAD_VARIANCE", r"covariance\[0\] = -"),
        (fix(covariance=horizontal(1.0, 0.0, math.nan), kind=2), "NOT_FINITE", r"covariance\[0\] = nan"),
    ],
)
def test_a_bad_fix_is_refused_with_value_and_remedy(message: Any, reason: str, text: str) -> None:
    with pytest.raises(Rejected, match=text) as refusal:
        FIX.read(message, LINE)
    assert refusal.value.reason == reason


def test_a_fix_without_a_line_says_what_to_set() -> None:
    with pytest.raises(Rejected, match="track_line = '': set track_line to a GeoJSON or CSV file"):
        FIX.read(fix())
    with pytest.raises(ValueError, match="position_source = 'fix': set track_line, too"):
        Line(position_source="fix")


def test_how_far_beside_the_line_a_fix_may_lie_is_a_setting() -> None:
    latitude, longitude = at(1000.0)
    x, y, _ = GEOD.fwd(longitude, latitude, AZIMUTH + 90.0, 30.0)
    beside = fix(latitude=y, longitude=x)
    with pytest.raises(Rejected, match="30 m beside"):
        FIX.read(beside, LINE)
    assert FIX.read(beside, replace(LINE, max_cross_track_m=31.0)).position_m == pytest.approx(11_000.0, abs=0.01)


def test_odometry_is_read_as_a_position() -> None:
    assert ODOMETRY.read(ODOMETRY.build(plain, T_NS, (1234.5,), 0.25)) == (T_NS, 1234.5, 0.25)
    assert ODOMETRY.read(ODOMETRY.build(plain, T_NS, (1234.5,), 0.0)).variance_m2 == 9.0
    with pytest.raises(Rejected, match=r"header\.frame_id = 'odom', frame = 'track': set"):
        ODOMETRY.read(ODOMETRY.build(plain, T_NS, (0.0,), 1.0, "odom"))
