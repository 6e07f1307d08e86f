# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Sensors that froze: one value to the bit while the other columns tell that the train runs, or slows down."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from ....core.physics.train import Array
from ....run.results.steps import step_of
from ..cell.numbers import Flags, Rows
from ..whole.clock import moment
from ..whole.held import changes
from ..whole.moving import MOVES_MPS
from ..whole.read import Log
from ..whole.steps import metres
from .motion import OVER_S

LEAST_S, LEAST_WAY_M, UNUSUAL = 3.0, 20.0, 5.0
"""One value froze over more than this time and way, and so many times what is usual for one."""

STOPS_MPS = 8.0
"""Mean over `OVER_S` from which no train stands at once, at 3 m/s^2."""

CHANGES_MPS, NOISE_M = 2.0, 2.0
"""A speed that froze misses such a change, more than a step of 5 km/h, by positions as noisy as this."""

BRAKED_PA = 5e4


def frozen(log: Log, t_s: Array) -> Iterator[str]:
    """Say which columns froze, and when."""
    rows, names, span = log.rows, list[str](), None
    place = next((columns for columns in (["position"], ["lat", "lon"]) if set(columns) <= set(rows)), [])
    known = rows[place].notna().all(axis=1).to_numpy() & bool(place)
    at_m = np.column_stack([np.interp(t_s, t_s[known], x[known]) for x in metres(rows, place)]) if known.any() else None
    has_speed = "speed" in rows and rows["speed"].notna().any()
    speed = rows["speed"].abs().ffill().fillna(0.0).to_numpy() if has_speed else None
    if at_m is not None:
        names, span = place, _place_froze(_runs(rows[place]), at_m, speed, t_s)
    if span and speed is not None and np.ptp(speed[slice(*span)]) == 0.0:
        names = [*place, "speed"]
    elif span is None and speed is not None:
        names, span = ["speed"], _speed_froze(log, at_m, speed, t_s)
    if span:
        first, last = span
        ends = "the end" if rows[names[0]][last + 1 :].isna().all() else moment(rows["t_ns"].iloc[last])
        begins = moment(rows["t_ns"].iloc[first])
        yield (
            f"{' and '.join(names)}: one value from {begins} to {ends}, while the train runs: "
            "a sensor that froze: leave those cells empty, or cut the log there"
        )


def _runs(columns: pd.DataFrame) -> tuple[Rows, Rows]:
    """First and last row of each value, as often as it comes anew."""
    known = np.flatnonzero(columns.notna().all(axis=1))
    begins = changes(columns.to_numpy()[known])
    return known[begins], known[np.append(begins[1:] - 1, len(known) - 1)]


def _place_froze(runs: tuple[Rows, Rows], at_m: Array, speed: Array | None, t_s: Array) -> tuple[int, int] | None:
    """The rows of a place that lacks the most of the way by the speed, or by how the train ran before."""
    first, last = runs
    long_s = t_s[last] - t_s[first]
    if speed is not None:
        way = np.append(0.0, np.cumsum(np.minimum(np.diff(t_s), LEAST_S) * (speed[1:] + speed[:-1]) / 2.0))
        lacks = way[last] - way[first]
        froze = (lacks > max(LEAST_WAY_M, UNUSUAL * np.median(lacks))) & (lacks > MOVES_MPS * long_s)
    else:
        before = np.searchsorted(t_s, t_s[first] - OVER_S)
        usual = float(np.median(np.linalg.norm(np.diff(at_m[first], axis=0), axis=1))) if len(first) > 1 else 0.0
        ran_mps = (np.linalg.norm(at_m[first] - at_m[before], axis=1) - 2.0 * usual) / OVER_S
        lacks = ran_mps * long_s
        froze = (ran_mps > STOPS_MPS) & (lacks > UNUSUAL * usual)
    return _worst(runs, lacks, froze & (long_s > LEAST_S))


def _speed_froze(log: Log, at_m: Array | None, speed: Array, t_s: Array) -> tuple[int, int] | None:
    """The rows of a speed that stays, though by the positions or the brake the train slows down."""
    first, last = _runs(log.rows[["speed"]])
    long_s = np.where(speed[first] > MOVES_MPS, t_s[last] - t_s[first], 0.0)
    i, usual_s = int(np.argmax(long_s)), float(np.partition(long_s, -2)[-2]) if len(long_s) > 1 else np.inf
    third_s, slows = long_s[i] / 3.0, False
    if long_s[i] <= LEAST_S:
        return None
    if at_m is not None:
        thirds_s = t_s[first[i]] + third_s * np.arange(4)
        way = np.diff(np.column_stack([np.interp(thirds_s, t_s, axis) for axis in at_m.T]), axis=0)
        before, _, behind = np.linalg.norm(way, axis=1) / third_s
        step_m = max(step_of(axis, NOISE_M) for axis in at_m.T)
        slows = abs(behind - before) > CHANGES_MPS + 2.0 * max(NOISE_M, step_m) / third_s
    if "brake_pressure" in log.rows and long_s[i] > UNUSUAL * usual_s:
        pressure = log.rows["brake_pressure"].ffill().to_numpy() - log.form.ambient_pressure_pa
        was_released = bool(np.nanmin(pressure[speed > MOVES_MPS], initial=BRAKED_PA) < BRAKED_PA)
        slows = slows or (was_released and np.nanmean(pressure[first[i] : last[i] + 1]) > BRAKED_PA)
    return (int(first[i]), int(last[i])) if slows else None


def _worst(runs: tuple[Rows, Rows], lacks: Array, froze: Flags) -> tuple[int, int] | None:
    """The rows of that run which lacks most."""
    i = int(np.argmax(np.where(froze, lacks, 0.0)))
    return (int(runs[0][i]), int(runs[1][i])) if froze.any() else None
