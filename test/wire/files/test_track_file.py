# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Files with a track's centre line: every shape that is read, and what is said of those that are not."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adhesion_node.core.physics.track import Grade
from adhesion_node.wire.files.track import read_track_line
from adhesion_node.wire.settings.setup import setup_of

COORDINATES = [[8.0, 47.0], [8.01, 47.0], [8.02, 47.005]]
HIGH = [[*position, 400.0 + number] for number, position in enumerate(COORDINATES)]


def line_string(coordinates: Any) -> dict[str, Any]:
    return {"type": "LineString", "coordinates": coordinates}


def feature(geometry: Any) -> dict[str, Any]:
    return {"type": "Feature", "properties": {}, "geometry": geometry}


def collection(*geometries: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": [feature(geometry) for geometry in geometries]}


STATION = {"type": "Point", "coordinates": [8.0, 47.0]}
CSV = "".join(f"{lat},{lon}\n" for lon, lat in COORDINATES)

GOOD = {
    "line.geojson": json.dumps(line_string(COORDINATES)),
    "feature.json": json.dumps(feature(line_string(COORDINATES))),
    "collection.geojson": json.dumps(collection(STATION, line_string(COORDINATES), None)),
    "line.csv": "lat,lon\n" + CSV,
    "bom.csv": "\ufefflon, name, lat\n" + "".join(f"{lon}, x, {lat}\n" for lon, lat in COORDINATES),
    "no_heights.csv": "lat,lon,height\n" + "".join(f"{lat},{lon},\n" for lon, lat in COORDINATES),
}


def written(folder: Path, name: str, text: str) -> str:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(("name", "text"), GOOD.items(), ids=GOOD)
def test_every_shape_gives_the_same_line(tmp_path: Path, name: str, text: str) -> None:
    line = read_track_line(written(tmp_path, name, text), 100.0)
    assert (line.along_m[0], line.along_m[-1]) == pytest.approx((100.0, 100.0 + 760.6 + 942.6), abs=1.0)
    assert line.height_m is None


def test_heights_are_read_of_both(tmp_path: Path) -> None:
    rows = "".join(f"{lat},{lon},{height}\n" for lon, lat, height in HIGH)
    for name, text in {"a.geojson": json.dumps(line_string(HIGH)), "a.csv": "lat,lon,height\n" + rows}.items():
        heights = read_track_line(written(tmp_path, name, text)).height_m
        assert heights is not None
        assert (heights[0], heights[-1]) == (400.0, 402.0)


BAD = {
    "gone": ("gone.csv", None, r"track_line = .*gone\.csv: not readable \(FileNotFoundError\): give GeoJSON"),
    "no json": ("a.json", "{", r"no JSON \(.*\): give GeoJSON with one LineString of \[longitude, latitude\]"),
    "a number": ("a.json", "5", r"no GeoJSON object"),
    "nothing": ("a.json", "{}", r"holds no line: join the way"),
    "two lines": ("a.json", json.dumps(collection(*[line_string(COORDINATES)] * 2)), r"holds LineString, LineString: "),
    "multi": ("a.json", json.dumps({"type": "MultiLineString", "coordinates": []}), r"holds MultiLineString: join"),
    "short": ("a.json", json.dumps(line_string(COORDINATES[:1])), r"1 points are no line"),
    "flat": ("a.json", json.dumps(line_string([8.0, 47.0])), r"coordinates\[0\] = 8.0: give GeoJSON"),
    "no list": ("a.json", json.dumps(line_string(7)), r"track_line = .*a\.json: "),
    "text": ("a.json", json.dumps(line_string([["x", 1], [2, 3]])), r"coordinates\[0\] = .*: not numbers"),
    "metres": ("a.json", json.dumps(line_string([[1.4e6, 6.9e6], [1.4e6, 6.91e6]])), r"in m\? Give degrees, WGS84"),
    "exchanged": ("a.json", json.dumps(line_string([[8, 147], [8, 148]])), r"latitude 147 is not .*are they exchanged"),
    "some heights": (
        "a.json",
        json.dumps(line_string([*COORDINATES, HIGH[0]])),
        r"1 of 4 points have a height",
    ),
    "one place": ("a.json", json.dumps(line_string([[8, 47]] * 3)), r"all points are the same"),
    "columns": ("a.csv", "latitude;longitude\n1;2\n", r"has the columns \['latitude;longitude'\]: .*columns lat, lon"),
    "empty": ("a.csv", "", r"has the columns \[\]"),
    "cell": ("a.csv", "lat,lon\n47,8\n47.1\n", r"line 3: .*: not numbers"),
    "a raster's mark for no height": (
        "a.csv",
        "lat,lon,height\n47,8,-3.4028235e+38\n47.1,8,400\n",
        r"line 2: height -3.40282e\+38 is not within -500 to 9000 m: is it in another unit, or does it stand for none",
    ),
    "a quote that does not end": (
        "a.csv",
        'lat,lon\n"' + 30_000 * "47.1,8\n",
        r"a\.csv: field larger than .*: give GeoJSON",
    ),
    "deep": ("a.json", 100_000 * "[", r"a\.json: maximum recursion .*: give GeoJSON"),
    "digits": ("a.json", json.dumps(line_string([[10**400, 1], [2, 3]])), r"coordinates\[0\] = .*: not numbers"),
    "nan": ("a.csv", "lat,lon\n47,8\n47.1,nan\n", r"line 3: .*: not finite"),
}


@pytest.mark.parametrize(("name", "text", "message"), BAD.values(), ids=BAD)
def test_a_bad_file_is_told_with_what_to_mend(tmp_path: Path, name: str, text: str | None, message: str) -> None:
    path = str(tmp_path / name) if text is None else written(tmp_path, name, text)
    with pytest.raises(ValueError, match=message):
        setup_of({"track_line": path})


def test_a_file_that_is_no_text_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match=r"not readable \(UnicodeDecodeError\)"):
        setup_of({"track_line": str(tmp_path / "a.csv")})


def test_the_heights_of_the_line_are_the_grades_of_the_track(tmp_path: Path) -> None:
    path = written(tmp_path, "a.geojson", json.dumps(line_string(HIGH)))
    setup = setup_of({"track_line": path, "track_start_m": 5000.0, "track": "tunnel 0 100"})
    _tunnel, *grades = setup.config.track.sections
    assert all(isinstance(grade, Grade) for grade in grades)
    assert grades[0].start_m == 5000.0
    assert setup.config.track.specific_resistance(np.array([5400.0]))[0] == pytest.approx(1 / 760.6, rel=0.01)
    with pytest.raises(ValueError, match="track has grades and track_line has heights: leave out"):
        setup_of({"track_line": path, "track": "grade 0 100 1"})
