# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Files with the centre line of a track: GeoJSON (RFC 7946) and CSV."""

import csv
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..track_line import TrackLine, line_of

GEOJSON = (".geojson", ".json")

SHAPE = (
    "give GeoJSON with one LineString of [longitude, latitude] or [longitude, latitude, height], or a .csv with the "
    "columns lat, lon and, where known, height; degrees and m, WGS84"
)


NO_HEIGHT = "is it in another unit, or does it stand for none? Give all points one in m, or none"

HEIGHTS_M = -500.0, 9000.0
"""Of the Earth's surface, and some more: beyond lies what stands for no height, -9999 or -3.4e38 of a raster."""


class Point(NamedTuple):
    """A point of the line: degrees, and m where its height is known."""

    latitude: float
    longitude: float
    height_m: float | None


def read_track_line(path: str, start_m: float = 0.0) -> TrackLine:
    """Read the line of a file; its first point has the chainage `start_m`. Raises ValueError with what to mend."""
    source = f"track_line = {path}"
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{source}: not readable ({type(error).__name__}): {SHAPE}") from error
    read = _geojson if Path(path).suffix.lower() in GEOJSON else _csv
    try:
        points = [_checked(where, *values) for where, *values in read(text)]
    except (TypeError, csv.Error, RecursionError) as error:
        raise ValueError(f"{source}: {error}: {SHAPE}") from error
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error
    if len(points) < 2:
        raise ValueError(f"{source}: {len(points)} points are no line: {SHAPE}")
    heights = [point.height_m for point in points if point.height_m is not None]
    if heights and len(heights) < len(points):
        raise ValueError(
            f"{source}: {len(heights)} of {len(points)} points have a height: give all of them one, or none"
        )
    latitude, longitude = np.array([point[:2] for point in points], dtype=np.float64).T
    return line_of(source, latitude, longitude, np.array(heights) if heights else None, start_m)


def _geojson(text: str) -> Iterator[tuple[str, Any, Any, Any]]:
    """Yield where, latitude, longitude and height or None of every point."""
    try:
        root = json.loads(text)
    except ValueError as error:
        raise ValueError(f"no JSON ({error}): {SHAPE}") from error
    lines = [geometry for geometry in _geometries(root) if str(geometry.get("type")).endswith("LineString")]
    if len(lines) != 1 or lines[0]["type"] != "LineString":
        kinds = ", ".join(str(geometry["type"]) for geometry in lines) or "no line"
        raise ValueError(f"holds {kinds}: join the way of the train to one LineString")
    for number, position in enumerate(lines[0].get("coordinates") or ()):
        where = f"coordinates[{number}] = {position}"
        if not isinstance(position, list) or len(position) < 2:
            raise ValueError(f"{where}: {SHAPE}")
        longitude, latitude, *rest = position
        yield where, latitude, longitude, rest[0] if rest else None


def _geometries(node: Any) -> Iterator[dict[str, Any]]:
    """Yield the geometries in a GeoJSON object, however deep."""
    if not isinstance(node, dict):
        raise ValueError(f"no GeoJSON object: {SHAPE}")
    if node.get("type") == "Feature":
        yield from _geometries(node.get("geometry") or {})
    elif node.get("type") in ("FeatureCollection", "GeometryCollection"):
        for child in node.get("features") or node.get("geometries") or ():
            yield from _geometries(child)
    else:
        yield node


def _csv(text: str) -> Iterator[tuple[str, Any, Any, Any]]:
    """Yield where, latitude, longitude and height or None of every row."""
    rows = csv.DictReader(text.splitlines(), skipinitialspace=True)
    names = [name.strip() for name in rows.fieldnames or ()]
    if not {"lat", "lon"} <= set(names):
        raise ValueError(f"has the columns {names}: {SHAPE}")
    rows.fieldnames = names
    for row in rows:
        yield f"line {rows.line_num}", row["lat"], row["lon"], (row.get("height") or "").strip() or None


def _checked(where: str, *values: Any) -> Point:
    """A point of numbers that can be; ValueError says where none is."""
    latitude, longitude, height = values
    try:
        lat, lon = float(latitude), float(longitude)
        height_m = None if height is None else float(height)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{where}: {values}: not numbers") from None
    if not all(map(math.isfinite, (lat, lon, height_m or 0.0))):
        raise ValueError(f"{where}: {values}: not finite")
    if abs(lat) > 90 or abs(lon) > 180:
        why = (
            "are they exchanged?"
            if max(abs(lat), abs(lon)) <= 180
            else "are they in m? Give degrees, WGS84 (EPSG:4326)"
        )
        raise ValueError(f"{where}: latitude {lat:g} is not within +-90 or longitude {lon:g} not within +-180: {why}")
    if height_m is not None and not HEIGHTS_M[0] <= height_m <= HEIGHTS_M[1]:
        raise ValueError(
            f"{where}: height {height_m:g} is not within {HEIGHTS_M[0]:g} to {HEIGHTS_M[1]:g} m: {NO_HEIGHT}"
        )
    return Point(lat, lon, height_m)
