# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The track's centre line: where on it a geographic position lies, and how steep it is.

The line is cut into pieces of at most `PIECE_M`, straight in earth-centred coordinates (ECEF, WGS84), so that no map
projection distorts a length: a chord of 100 m is shorter than its arc by 1 nm. Chainage is the length in space where
the line has heights, else that on the ellipsoid.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from pyproj import Geod, Transformer
from scipy.spatial import cKDTree

from ..core.physics.track import STEEPEST, Grade
from ..core.physics.train import Array
from .messages.refused import Reason, Rejected

PIECE_M = 100.0
"""Length of the longest piece."""

LIKELY_SIGMA = 3.0
"""Places that are further than the nearest one by less than so many standard deviations may be the true one."""

SECTIONS_PER_TRAIN, AVERAGED = 2, 9
"""Sections of the profile of grades on the length of a train, and heights over such a section of which each end has the
mean, as heights are rough."""


class Place(NamedTuple):
    """A place on the line and the direction there in which the chainage rises: its share to the east and north."""

    along_m: float
    cross_m: float
    """How far the position that was projected lies beside the line."""
    east: float
    north: float


@dataclass(frozen=True, eq=False)
class TrackLine:
    """A line of n pieces; `line_of` builds it."""

    source: str
    along_m: Array
    """Chainage of the pieces' ends, shape (n + 1,)."""
    ground: Array
    """The same in ECEF on the ellipsoid, m, shape (n + 1, 3)."""
    height_m: Array | None
    """Their heights, shape (n + 1,), where known."""
    tree: cKDTree
    """Of the pieces' middles."""

    def place(self, latitude: float, longitude: float, std_m: float, most_m: float) -> Place:
        """Project a position, degrees, on the line.

        Raises Rejected where it lies beside the line by more than `most_m` or beyond an end, or where the line comes
        by twice and both places are likely. Two places within r of a point are at most pi r apart along a line that
        does not turn back between them.
        """
        point, spread = ecef(longitude, latitude, 0.0), LIKELY_SIGMA * std_m
        reach = PIECE_M / 2 + most_m + spread
        pieces = np.asarray(self.tree.query_ball_point(point, reach) or [self.tree.query(point)[1]])
        start, way = self.ground[pieces], self.ground[pieces + 1] - self.ground[pieces]
        share = ((point - start) * way).sum(axis=1) / (way * way).sum(axis=1)
        inside = share.clip(0.0, 1.0)
        cross = np.linalg.norm(point - start - inside[:, None] * way, axis=1)
        along = self.along_m[pieces] + inside * (self.along_m[pieces + 1] - self.along_m[pieces])
        best = int(cross.argmin())
        what = f"latitude, longitude = {latitude:.7f}, {longitude:.7f}: {{}} {self.source}"
        if cross[best] > most_m:
            raise Rejected(Reason.OFF_TRACK, what.format(f"{cross[best]:.0f} m beside"))
        if (pieces[best] == 0 and share[best] < 0) or (pieces[best] == self.tree.n - 1 and share[best] > 1):
            raise Rejected(Reason.OFF_TRACK, what.format("beyond an end of"))
        radius = cross[best] + spread
        apart = np.abs(along[cross <= radius] - along[best]).max()
        if apart > math.pi * radius:
            raise Rejected(Reason.AMBIGUOUS, what.format(f"on two places {apart:.0f} m apart of"))
        return Place(float(along[best]), float(cross[best]), *_direction(way[best], latitude, longitude))

    def grades(self, train_length_m: float) -> tuple[Grade, ...]:
        """The grades along the line, each half as long as a train at most; none without heights.

        Raises ValueError naming the place of a grade that no railway has.
        """
        if self.height_m is None:
            return ()
        first, last = self.along_m[[0, -1]]
        ends = np.linspace(first, last, math.ceil(SECTIONS_PER_TRAIN * (last - first) / train_length_m) + 1)
        aside = np.minimum(train_length_m / 4, np.minimum(ends - first, last - ends))
        near = ends[:, np.newaxis] + aside[:, np.newaxis] * np.linspace(-1.0, 1.0, AVERAGED)
        rises = np.diff(np.interp(near, self.along_m, self.height_m).mean(axis=1))
        slope = rises / np.diff(ends)
        worst = int(np.abs(slope).argmax())
        if abs(slope[worst]) > STEEPEST:
            raise ValueError(
                f"{self.source}: rises {slope[worst]:.3f} m per m at {ends[worst : worst + 2].mean():.0f} m: "
                f"no railway is steeper than {STEEPEST:g}: give heights in m, or none"
            )
        return tuple(Grade(*map(float, step)) for step in zip(ends[:-1], ends[1:], rises, strict=True))


def line_of(source: str, latitude: Array, longitude: Array, height_m: Array | None, start_m: float) -> TrackLine:
    """Build the line through points, degrees, that begins at a chainage; between two points it is a geodesic.

    Raises ValueError where all points are the same.
    """
    azimuth, _, length = _ellipsoid().inv(longitude[:-1], latitude[:-1], longitude[1:], latitude[1:])
    count = np.ceil(length / PIECE_M).astype(int)  # 0 between two equal points, which drops one of them
    if not count.any():
        raise ValueError(f"{source}: all points are the same: give the centre line of a track")
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    part = number / np.repeat(count, count)
    azimuth, way = np.repeat(azimuth, count), part * np.repeat(length, count)
    before = np.repeat(longitude[:-1], count), np.repeat(latitude[:-1], count)
    piece_longitude, piece_latitude, _ = _ellipsoid().fwd(before[0], before[1], azimuth, way)
    lon, lat = np.append(piece_longitude, longitude[-1]), np.append(piece_latitude, latitude[-1])
    ground = ecef(lon, lat, np.zeros_like(lon))
    space, heights = ground, None
    if height_m is not None:
        heights = np.append(np.repeat(height_m[:-1], count) + part * np.repeat(np.diff(height_m), count), height_m[-1])
        space = ecef(lon, lat, heights)
    along = start_m + np.append(0.0, np.cumsum(np.linalg.norm(np.diff(space, axis=0), axis=1)))
    return TrackLine(source, along, ground, heights, cKDTree((ground[:-1] + ground[1:]) / 2))


def ecef(longitude: float | Array, latitude: float | Array, height_m: float | Array) -> Array:
    """Earth-centred coordinates, m, shape (..., 3), of positions in degrees."""
    return np.stack(_cartesian().transform(longitude, latitude, height_m), axis=-1)


def _direction(way: Array, latitude: float, longitude: float) -> tuple[float, float]:
    """The shares of a way's direction to the east and to the north."""
    phi, lam = math.radians(latitude), math.radians(longitude)
    north = (-math.sin(phi) * math.cos(lam), -math.sin(phi) * math.sin(lam), math.cos(phi))
    east, length = (-math.sin(lam), math.cos(lam), 0.0), np.linalg.norm(way)
    return float(way @ east / length), float(way @ north / length)


@cache
def _ellipsoid() -> Geod:
    return Geod(ellps="WGS84")


@cache
def _cartesian() -> Transformer:
    """Degrees and m to ECEF; without the database of coordinate systems."""
    return Transformer.from_pipeline(
        "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=cart +ellps=WGS84"
    )
