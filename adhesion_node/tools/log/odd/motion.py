# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A log by the second: what its columns say of the train's motion, for checks of one against the other."""

import math
from typing import NamedTuple

import numpy as np
import pandas as pd

from ....core.physics.train import Array
from ..cell.numbers import Flags
from ..whole.read import Log

LEAST_S, LEAST_M = 10.0, 100.0
"""Of less time or less way nothing is said."""

BRAKES_MPS2, RUNS_MPS2 = -0.3, -0.1
"""A train that slows down more than by the first brakes; by less than the second, it runs or coasts."""

OVER_S = 5
"""Seconds over which it is seen whether a train brakes, however noisy its positions."""

EARTH_M = 6.371e6
"""Radius of a sphere like it."""

SLOWEST_S, GAP = 10.0, 2.5
"""A column whose values come more seldom than every second counts as linear in between: where they come that often,
and over so many usual steps."""

SAME = math.log(1.25)
"""By so much positions and speed may differ, as where a wheel slides."""


class Motion(NamedTuple):
    """Means over the n seconds of a log; NaN where nothing was measured."""

    place_m: Array
    speed_mps: Array
    pressure_pa: Array
    """Of brake_pressure, gauge."""
    felt_mps2: Array
    """Of the accelerometer."""
    rolls_radps: Array
    """Of the middle axle, without sign."""
    by_fixes: bool = False
    """Whether the places are the way along the fixes, which rises whatever the train does."""

    @property
    def course_mps(self) -> Array:
        """By the positions, from the second before; shape (n,)."""
        return np.diff(self.place_m, prepend=math.nan)

    @property
    def pace_mps(self) -> Array:
        """The measured speed between a second and the one before; shape (n,)."""
        before = np.append(math.nan, self.speed_mps[:-1])
        return np.abs(before + self.speed_mps) / 2.0

    @property
    def both(self) -> Flags:
        """Where positions and speed tell of the same seconds."""
        return np.isfinite(self.course_mps + self.pace_mps)

    @property
    def is_compared(self) -> bool:
        """Whether there is enough of both."""
        return bool(self.both.sum() > LEAST_S and self.pace_mps[self.both].sum() > LEAST_M)

    @property
    def fastest_mps(self) -> Array:
        """Speed, by the positions where none was measured."""
        return np.abs(self.speed_mps if np.isfinite(self.speed_mps).any() else self.course_mps)

    @property
    def slows_mps2(self) -> Array:
        """Change of the speed over the last `OVER_S` s, per second, shape (n,)."""
        speed = self.fastest_mps
        return np.append(np.full(min(OVER_S, speed.size), math.nan), speed[OVER_S:] - speed[:-OVER_S]) / OVER_S


def motion_of(log: Log, t_s: Array) -> Motion:
    """Means of the rows by the whole seconds of their times; of what comes more seldom, what it is half-way of them."""
    rows, second = log.rows, np.floor(t_s).astype(np.int64)
    means = rows.groupby(second).mean().reindex(range(int(second[-1]) + 1)) if second[-1] < 10**6 else rows

    def column(name: str, offset: float = 0.0) -> Array:
        values = means[name] if name in means else pd.Series(math.nan, index=means.index)
        read: Array = values.to_numpy(dtype=np.float64) - offset
        known = rows[name].notna().to_numpy() if name in rows and means is not rows else np.zeros(0, dtype=bool)
        is_slow = known.sum() > 2 and 1.0 < np.median(np.diff(t_s[known])) <= SLOWEST_S
        return _between(t_s[known], rows[name].to_numpy()[known] - offset, len(read)) if is_slow else read

    axles = [name for name in log.columns.axles if name in means]
    turns = pd.DataFrame({name: column(name) for name in axles}).abs().median(axis=1)
    rolls = turns.to_numpy(dtype=np.float64) if axles else column("")
    pressure, others = column("brake_pressure", log.form.ambient_pressure_pa), (column("acceleration"), rolls)
    if {"lat", "lon", "speed"} <= set(means) and "position" not in means:
        return Motion(_way_along(column("lat"), column("lon")), column("speed"), pressure, *others, by_fixes=True)
    return Motion(column("position"), column("speed"), pressure, *others)


def _between(t_s: Array, values: Array, seconds: int) -> Array:
    """Values half-way of the seconds, linear between two; NaN in gaps, and outside."""
    at = np.arange(seconds) + 0.5
    behind = np.clip(np.searchsorted(t_s, at), 1, len(t_s) - 1)
    gaps, inside = np.diff(t_s), (at >= t_s[0]) & (at <= t_s[-1])
    is_known = inside & (gaps[behind - 1] <= GAP * np.median(gaps))
    return np.where(is_known, np.interp(at, t_s, values), math.nan)


def _way_along(lat: Array, lon: Array) -> Array:
    """Way along places, m, good to a part in 200; what is not known is NaN, and the way goes on behind it."""
    north = np.radians(np.diff(lat, prepend=math.nan)) * EARTH_M
    east = np.radians(np.diff(lon, prepend=math.nan)) * EARTH_M * np.cos(np.radians(lat))
    steps = np.hypot(north, east)
    return np.where(np.isfinite(steps), np.nancumsum(steps), math.nan)
