# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A log as a whole: its times in order and in their zone, the chainage as the train runs, the demand in the pipe."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from ...core.physics.train import Array
from .cell.clock import has_dates, in_digits, in_zone, over_midnight
from .cell.numbers import Flags
from .columns import Columns
from .format import PRESSURE_UNITS, Format
from .held import without_held
from .opened import open_log
from .rows import measured
from .shared import together
from .steps import DEGREE_M, stds_of
from .text import Refusal
from .wraps import unwrapped

FULL_DROP_PA = 1.5e5
"""The pipe's pressure falls by so much for a full brake (UIC 540)."""

RELEASED_PA = 2e5, 1.2e6
"""What a pipe may have while the brake is released; mostly it is 5 bar."""

MOVES_MPS, OVER_S = 2.0, 5.0
"""A train that is faster moves; slower positions, over so long, are noise."""

SET_BACK = "the clock was set back; --time-zone where summer time ended, else cut the log there; or unsorted? --sort"
BEGUN_ANEW = "the clock was set back, or a counter began anew: add to the times behind what they fell by, or cut the "
BEGUN_ANEW += "log there; or unsorted? --sort"
"""Of dates, and of all other times, which are in no zone."""


class Log(NamedTuple):
    """What a log has measured."""

    form: Format
    """With nothing left open."""
    columns: Columns
    rows: pd.DataFrame
    """By line of the log: `t_ns`, which rises, and every column in SI, NaN where a cell is empty."""
    notes: tuple[str, ...]
    """What was done with it."""
    stds: Mapping[str, float]
    """By topic, where the log tells none; 0: the estimator's setting."""


def read_log(path: Path, form: Format, tell: Callable[[Refusal], None]) -> Log:
    """Read a log and `tell` of every row that is refused.

    Raises ValueError when the file is empty or a column is missing.
    """
    source = open_log(path, form)
    parts, read_as = [], dict[str, str]()
    for rows, refused, said in measured(str(path), source):
        parts.append(rows)
        read_as |= said
        for each in refused:
            tell(each)
    rows, timed, digits = in_digits(pd.concat(parts), source.form, form)
    rows, notes = in_zone(over_midnight(rows, timed), timed)
    rows, shared = together(rows.sort_values("t_ns", kind="stable") if form.sort else rows)
    rows, refused = _rising(rows, str(path), has_dates(timed))
    for each in refused:
        tell(each)
    rows, held = without_held(rows)
    rows, wrapped = unwrapped(rows, form)
    notes += source.notes + digits + shared + held + wrapped
    notes += [f"{name}: {said}" for name, said in read_as.items()]
    if form.direction == "down" and "position" in rows:
        rows["position"] = -rows["position"]
        notes.append(
            "direction: positions are minus the chainage, so are those of track; else: replay --set direction=down"
        )
    form = timed
    if "brake_pipe" in rows:
        rows, form, note = _demanded(rows, form)
        notes.append(note)
    stds, coarse = stds_of(rows, form)
    return Log(form, source.columns, rows, (*notes, *coarse), stds)


def _rising(rows: pd.DataFrame, source: str, dated: bool) -> tuple[pd.DataFrame, list[Refusal]]:
    """The rows whose time is later than that of all before, and why not the others."""
    ahead = _ahead(rows["t_ns"].to_numpy())
    refused = [
        _out_of_time(
            rows, i, source, f"the row behind it has {moment(rows['t_ns'].iloc[i + 1])}: its stamp is too high"
        )
        for i in np.flatnonzero(ahead).tolist()
    ]
    rows = rows[~ahead]
    t_ns = rows["t_ns"].to_numpy()
    reached = np.maximum.accumulate(t_ns)
    late = np.append(False, t_ns[1:] <= reached[:-1]) if len(t_ns) else np.zeros(0, dtype=bool)
    cure = _cure(rows, late, SET_BACK if dated else BEGUN_ANEW)
    refused += [
        _out_of_time(rows, i, source, f"the last good row has {moment(reached[i - 1])}: {cure}")
        for i in np.flatnonzero(late).tolist()
    ]
    return rows[~late], refused


def _ahead(t_ns: Array) -> Flags:
    """Rows without which all times rise, that make at least the next two late: a stamp is wrong, not the clock."""
    ahead = np.zeros(len(t_ns), dtype=bool)
    if len(t_ns) > 3:
        before = np.append(np.iinfo(np.int64).min, t_ns[:-3])
        this, behind, further = t_ns[:-2], t_ns[1:-1], t_ns[2:]
        ahead[:-2] = (before < behind) & (behind < further) & (further <= this)
    return ahead & bool((np.diff(t_ns[~ahead]) >= 0).all())


def _cure(rows: pd.DataFrame, late: Flags, set_back: str) -> str:
    """What to do about rows whose time does not rise."""
    falls = int(np.count_nonzero(np.diff(rows["t_ns"]) < 0))
    if falls < 3 and late.sum() > 10 * max(falls, 1):
        if falls:
            return set_back
        if rows["t_ns"][late].nunique() == 1 and not late[1]:
            return "the clock stands still from there on: cut the log there"
        repeated = bool(rows.duplicated()[late].all())
        return (
            "rows are there twice: drop them"
            if repeated
            else "rows share a time: log it with the fraction of the second"
        )
    return "drop repeated rows, or sort the log: --sort"


def _out_of_time(rows: pd.DataFrame, index: int, source: str, why: str) -> Refusal:
    line = int(rows.index[index])
    told = f"{source}:{line}: time = {moment(rows['t_ns'].iloc[index])}: time must rise, {why}"
    return Refusal(line, "time_not_rising", told)


def _demanded(rows: pd.DataFrame, form: Format) -> tuple[pd.DataFrame, Format, str]:
    """The rows with the demand that the pressure of the brake pipe is, and from where on it is released."""
    pipe, unit = rows["brake_pipe"] - form.ambient_pressure_pa, form.unit("brake_pipe")
    scale = PRESSURE_UNITS[unit]
    released = pipe[_moves(rows)].quantile(0.9) if form.pipe_released is None else form.pipe_released * scale
    if form.pipe_released is not None and not RELEASED_PA[0] <= released <= RELEASED_PA[1]:
        least, most = (pa / scale for pa in RELEASED_PA)
        range_ = f"give what the pipe has while the brake is released, {least:g} to {most:g} {unit}"
        raise ValueError(f"pipe-released = {form.pipe_released:g} {unit}: {range_}; mostly it is {5e5 / scale:g}")
    share = ((released - pipe) / FULL_DROP_PA).clip(0.0, 1.0)
    rows = rows.drop(columns="brake_pipe").assign(brake_demand=form.ambient_pressure_pa + share * form.full_pressure_pa)
    note = (
        f"brake pipe: released at {released / scale:g} {unit}, --pipe-released; a full brake {FULL_DROP_PA / scale:g} "
        f"{unit} below; as the demand of {form.full_pressure_pa:g} Pa in the cylinders, --full-pressure"
    )
    return rows, replace(form, pipe_released=float(released / scale)), note


def _moves(rows: pd.DataFrame) -> Flags:
    """Rows of a train that moves, as parked its pipe may be empty for longer than it runs; all, where it never does."""
    speed = rows["speed"].abs().ffill().to_numpy() if "speed" in rows else _way_m(rows) / OVER_S
    moves: Flags = speed > MOVES_MPS
    return moves | (not moves.any())


def _way_m(rows: pd.DataFrame) -> Array:
    """Way over the `OVER_S` about every row, by positions or else by fixes; shape (n,)."""
    t_s, squares = rows["t_ns"].to_numpy() / 1e9, np.zeros(len(rows))
    by_fix = {"lat": DEGREE_M, "lon": DEGREE_M * np.cos(np.radians(rows["lat"].median()))} if "lat" in rows else {}
    for name, metres in ({"position": 1.0} if "position" in rows else by_fix).items():
        known = rows[name].notna().to_numpy()
        if known.any():
            at = [np.interp(t_s + by, t_s[known], rows[name][known]) for by in (-OVER_S / 2, OVER_S / 2)]
            squares += np.square(metres * (at[1] - at[0]))
    return np.sqrt(squares)


def moment(t_ns: int) -> str:
    """Write a time: seconds, or a date where it is one.

    >>> moment(1_500_000_000), moment(1_700_000_000_000_000_000)
    ('1.5 s', '2023-11-14T22:13:20')
    """
    return f"{t_ns / 1e9:.9g} s" if t_ns < 10**17 else pd.Timestamp(t_ns).isoformat()
