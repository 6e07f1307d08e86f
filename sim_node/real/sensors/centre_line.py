# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A made-up track on the WGS84 ellipsoid, the same for every journey: curves of 3 km and more near Salisbury."""

import json
import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..plant.journey import Array

BEGINS_M, ENDS_M = -1000.0, 30_000.0
"""Positions along the track of its first and last point: before and beyond every journey."""

STEP_M = 25.0
"""Between two points: the arc of a curve of 3 km is 3 cm beside its chord."""

FIRST = 51.07, -1.80
"""Latitude and longitude of the first point, degrees."""


def places(along_m: Array, left_m: Array) -> tuple[Array, Array]:
    """Return latitude and longitude, degrees, of positions along the track and beside it; shapes (N,)."""
    from pyproj import Geod  # only here: most sets of sensors need no geodesy

    geod, (latitude, longitude, azimuth) = Geod(ellps="WGS84"), _points()
    steps = (along_m - BEGINS_M) / STEP_M
    index: NDArray[np.intp] = np.clip(steps.astype(np.intp), 0, azimuth.size - 1)
    on = geod.fwd(longitude[index], latitude[index], azimuth[index], (steps - index) * STEP_M)
    there = geod.fwd(on[0], on[1], azimuth[index] - 90.0, left_m)
    return there[1], there[0]


def geojson() -> str:
    """Return the line as a GeoJSON LineString."""
    latitude, longitude, _ = _points()
    points = [[round(x, 9), round(y, 9)] for x, y in zip(longitude.tolist(), latitude.tolist(), strict=True)]
    return json.dumps({"type": "LineString", "coordinates": points})


@cache
def _points() -> tuple[Array, Array, Array]:
    """Latitude and longitude, shape (n + 1,), and azimuth towards the next one, (n,), degrees."""
    from pyproj import Geod

    geod, count = Geod(ellps="WGS84"), round((ENDS_M - BEGINS_M) / STEP_M)
    azimuth = 80.0 + 30.0 * np.sin(np.arange(count) * STEP_M / (3000.0 * math.radians(30.0)))
    latitude, longitude = np.empty((2, count + 1))
    latitude[0], longitude[0] = FIRST
    for k in range(count):
        longitude[k + 1], latitude[k + 1], _ = geod.fwd(longitude[k], latitude[k], azimuth[k], STEP_M)
    return latitude, longitude, azimuth
