# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Rows of a log as measurements in SI units, and a reason with a remedy for each row that is none."""

import re
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from .cell.marks import marks
from .cell.numbers import NO_TIME, Flags, grouped, in_flags, numbers, times_ns
from .cell.places import PARTS, in_numbers, with_letters
from .format import LIMITS, PRESSURES, Format
from .opened import Source
from .text import Refusal

EMPTY = "every row needs a time and something measured"

NO_NUMBER = (
    "write a finite number with a decimal point, without its unit, nothing where nothing was measured; "
    "or is the --decimal another?"
)

NO_VALUE = "it stands for no value: leave such cells empty, the rest of the row is read then"

FLAG = "; or true and false, of a full brake, with --pressure-unit full"

_NAMED_ZONE = re.compile(r"(?<=[0-9])\s*\[?[A-Z][A-Za-z/_]{2,}\]?$")

SINCE = "; of seconds since 1904 subtract 2082844800 from all, of those since 1900 2208988800"
MAC_2001, NTP_2038 = 978_307_200 + 2_082_844_800, 2**31 + 2_208_988_800
"""The beginnings of such years in seconds since 1904, and since 1900."""

IN_GROUPS = "is it in groups of thousands? Export it without them; or is the --decimal another?"


class Measured(NamedTuple):
    """What a block holds: by line `t_ns` and all columns in SI, NaN where a cell is empty; and what of it is said."""

    rows: pd.DataFrame
    refused: list[Refusal]
    read_as: dict[str, str]
    """By column how a cell is read that is no plain number: in groups of thousands, or in parts."""


def measured(source: str, log: Source) -> Iterator[Measured]:
    """Yield what was measured, block by block."""
    decimal = log.form.decimal or "."
    for cells, refused in log.blocks:
        read_as = {}
        for name, theirs in log.columns.names.items():
            column = cells[theirs]
            if log.form.thousands and (in_groups := grouped(column, decimal)).any():
                cell = str(column[in_groups].iloc[0])
                read_as[name] = f"{cell!r} is read as {re.sub('[.,]', '', cell)}"
            if name in PARTS:
                column = with_letters(cells, theirs, name)
                cells[theirs] = in_numbers(column, name, log.form.unit(name), decimal)
                if (in_parts := cells[theirs] != column).any():
                    read_as[name] = f"{column[in_parts].iloc[0]!r} is read as {cells[theirs][in_parts].iloc[0]}"
        rows, unusable = _rows(cells, log, source)
        yield Measured(rows, sorted([*refused, *unusable]), read_as)


def _rows(cells: pd.DataFrame, log: Source, source: str) -> tuple[pd.DataFrame, list[Refusal]]:
    """What a block has measured: the first reason against a row counts."""
    form, (names, axles, *_), factors = log.form, log.columns, log.form.factors()
    kinds = {name: name for name in names if name != "time"} | dict.fromkeys(axles, "wheel_speed")
    theirs = {name: cells[names.get(name, name)] for name in ("time", *kinds)}
    decimal = form.decimal or "."
    theirs |= _without_fix(theirs, decimal)
    filled = {name: _filled(column) for name, column in theirs.items()}
    against: dict[int, Refusal] = {}
    good = np.ones(len(cells), dtype=np.bool_)

    def refuse(rows: Flags, reason: str, column: str, remedy: Callable[[int], str]) -> None:
        """Refuse those of the rows that are good so far."""
        for i in np.flatnonzero(rows & good):
            value = "" if column == "row" else str(theirs[column].iloc[i])
            value = (form.delimiter or ",").join(map(str, cells.iloc[i])) if column == "row" else value
            shown = repr(value if len(value) <= 60 else value[:60] + "...")
            line = int(cells.index[i])
            against[line] = Refusal(line, reason, f"{source}:{line}: {column} = {shown}: {remedy(int(i))}")
        good[rows] = False

    refuse(~filled["time"], "empty", "time", lambda _: EMPTY)
    said = [filled[name] for name in kinds if name not in ("height", "variance", "speed_std")]
    refuse(~np.any(said, axis=0), "empty", "row", lambda _: EMPTY)
    if "lat" in kinds and "lon" in kinds:
        both = "a place needs both, latitude and longitude"
        refuse(filled["lat"] != filled["lon"], "empty", "row", lambda _: both)
    t_ns = times_ns(theirs["time"].where(good, ""), form)
    _refuse_times(refuse, t_ns == NO_TIME, theirs["time"], form)
    rows: dict[str, Any] = {"t_ns": t_ns}
    for name, kind in kinds.items():
        cells_read = in_flags(theirs[name]) if form.is_share(kind) else theirs[name]
        read = numbers(cells_read, decimal, form.thousands)
        bad = filled[name] & np.isnan(read)
        if bad.any():
            refuse(bad & grouped(theirs[name], decimal), "not_a_number", name, lambda _: IN_GROUPS)
            refuse(bad, "not_a_number", name, partial(_no_number, name))
        factor, stands_in = factors.get(kind, 1.0), marks(read)
        with np.errstate(over="ignore"):  # 1e300 km are out of range
            read *= factor
            read = read.round(6) if factor >= 10.0 else read  # 4.1 bar are 410000 Pa, not less
        read += form.offset(kind)
        least, most, remedy = LIMITS[kind]
        outside = (read < least) | (read > most)
        refuse(outside & stands_in, "no_value", name, lambda _: NO_VALUE)
        refuse(outside, "out_of_range", name, _out_of_range(read, least, most, remedy))
        rows[name] = read
    return pd.DataFrame(rows, index=cells.index)[good], list(against.values())


def _without_fix(columns: "Mapping[str, pd.Series[Any]]", decimal: str) -> "dict[str, pd.Series[Any]]":
    """Latitude and longitude, empty where both are 0: so a receiver tells that it has no fix."""
    if not {"lat", "lon"} <= columns.keys():
        return {}
    places = {name: columns[name] for name in ("lat", "lon")}
    nowhere = np.all([numbers(cells, decimal) == 0.0 for cells in places.values()], axis=0)
    return {name: cells.mask(nowhere, "") for name, cells in places.items()}


def _refuse_times(refuse: Callable[..., None], bad: Flags, cells: "pd.Series[Any]", form: Format) -> None:
    if form.time_format is not None:
        known = "in a way that is known" if form.time_format == "ISO8601" else f"as {form.time_format!r}"
        how = f"it is not written {known}: say how with --time-format, such as '%d.%m.%Y %H:%M:%S.%f'"
        refuse(bad, "not_a_time", "time", lambda i: how + _zone(str(cells.iloc[i])))
        return
    read = numbers(cells, form.decimal or ".", form.thousands)
    refuse(bad & (read < 0.0), "out_of_range", "time", lambda _: "it is below 0: add the same to all, so that none is")
    outside = bad & np.isfinite(read)
    range_ = "a stamp lies between 1970 (or 0) and 2038: is the --time-unit another? Or --time-format %Y%m%d%H%M%S?"
    refuse(outside, "out_of_range", "time", lambda i: range_ + (SINCE if MAC_2001 <= read[i] < NTP_2038 else ""))
    refuse(bad, "not_a_number", "time", lambda _: f"{NO_NUMBER}; a date is told by --time-format")


def _zone(cell: str) -> str:
    """What to do about a zone by its name behind a date, as CET or [Europe/Berlin], which no parser reads."""
    named = _NAMED_ZONE.search(cell)
    return f"; with {named.group()!r} at its end, and the zone by --time-zone, such as Europe/Berlin" if named else ""


def _out_of_range(read: Any, least: float, most: float, remedy: str) -> Callable[[int], str]:
    return lambda i: f"{read[i]:g} is not from {least:g} to {most:g} {remedy}"


def _no_number(name: str, _: int) -> str:
    return NO_NUMBER + PARTS.get(name, "") + (FLAG if name in PRESSURES else "")


def _filled(cells: "pd.Series[Any]") -> Flags:
    filled: Flags = (cells.notna() & (cells.astype(str) != "")).to_numpy(dtype=np.bool_)
    return filled
