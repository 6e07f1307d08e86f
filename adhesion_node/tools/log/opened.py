# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A log that is opened: how it is written, with nothing left open, which columns it has, and its rows as cells."""

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ...command.checks import refuse
from .block.chosen import chosen, several, with_rows
from .block.dated import date_of, with_dates, without_date
from .block.signals import signals_of, spread
from .cell.numbers import FORMATS, NO_TIME, is_clock, time_formats, time_unit, times_ns
from .cell.suffixed import unit_in, without_units
from .cell.units import kind_of, known
from .columns import Columns, columns_of, in_doubt, units_told
from .encoded import is_parquet
from .format import Format
from .idle import require_meaning
from .text import SAMPLE, Block, blocks, names_of, understood

ZONED = re.compile(r"(Z|UTC|GMT|[T ]\d\d.*[+-]\d\d(:?\d\d)?)$")
"""How a date ends that names its zone, behind the time of the day."""


class Source(NamedTuple):
    """A log that can be read: its format with nothing left open, its columns, and its rows block by block."""

    form: Format
    columns: Columns
    blocks: Iterator[Block]
    notes: list[str]
    """How a date is read that may be read otherwise."""
    trains: list[str]
    """What rows of one time differ by, where some are left out."""


def open_log(path: Path, form: Format) -> Source:
    """Look how a log is written. Raises ValueError when it is empty or a column is missing."""
    if is_parquet(path):
        refuse(form, ["encoding", "delimiter", "decimal", "skip_rows"], "a Parquet file is no text: leave it out")
        table = _parquet(path)
        names, form = list(table), replace(form, decimal=".")
        blocks_of = partial(iter, [Block(table.set_axis(table.index + 1), [])])
    else:
        form = understood(path, form)
        names = names_of(path, form)
        blocks_of = partial(blocks, path, form, names)
    rows = chosen(blocks_of(), names, form.where, str(path))
    if signals := signals_of(blocks_of(), names, form, str(path)):
        names = [*signals.rest, *signals.columns]
    columns = columns_of(names, str(path), form)
    rows = with_rows(spread(rows, signals, columns) if signals else rows)
    first = next(rows, Block(pd.DataFrame(columns=names, dtype=object), []))
    trains = [] if signals else [*several(first.cells, columns)]
    date, named = date_of(first.cells, columns, form), columns
    first, rows = with_dates(first, date, named), (with_dates(block, date, named) for block in rows)
    columns = without_date(columns, is_used=date is not None)
    told = units_told(columns, names, form)
    behind = dict(_behind_numbers(first.cells, columns, told))
    first, rows = _bare(first, behind), (_bare(block, behind) for block in rows)
    absolute = frozenset(ours for ours, text in told.items() if kind_of(text, ours) == "absolute")
    units = {ours: unit for ours, text in told.items() if (unit := known(text, ours))}
    form = replace(form, told=units, absolute=absolute)
    timed = _timed(form, first.cells[columns.names["time"]])
    if timed.time_format is not None:
        told.pop("time", None)  # [UTC] or [hh:mm:ss]: dates are in no unit
    require_meaning(timed, columns)
    columns = columns._replace(doubts=tuple(in_doubt(told, form)))
    timed = replace(timed, sort=timed.sort or (signals is not None and not is_clock(timed.time_format)))
    notes = [] if form.time_format else list(_read_otherwise(first.cells[columns.names["time"]], timed))
    return Source(timed, columns, _again(first, rows), notes, trains)


def _behind_numbers(cells: pd.DataFrame, columns: Columns, told: dict[str, str]) -> Iterator[tuple[str, str]]:
    """Yield columns whose cells all have one unit, as they write it, and note it; not where the header has another."""
    theirs = {ours: (name,) for ours, name in columns.names.items()} | {"wheel_speed": columns.axles}
    for ours, names in theirs.items():
        units = {unit_in(cells[name], ours) for name in names}
        unit = units.pop() if len(units) == 1 else None
        if unit and known(told.setdefault(ours, unit), ours) == known(unit, ours):
            yield from ((name, unit) for name in names)


def _bare(block: Block, units: dict[str, str]) -> Block:
    return block._replace(cells=without_units(block.cells, units)) if units else block


def _timed(form: Format, cells: "pd.Series[Any]") -> Format:
    """The format with that of the times."""
    if pd.api.types.is_timedelta64_dtype(cells):
        return replace(form, time_format=None, time_unit="ns")
    if form.time_format is not None:
        return replace(form, time_zone="UTC") if "%z" in form.time_format else form
    if form.time_unit is not None and form.time_unit != "iso":
        return form
    sample = [str(cell) for cell in cells.head(SAMPLE)]
    written = "ISO8601" if form.time_unit == "iso" else next(iter(time_formats(sample)), None)
    unit = None if written else form.time_unit or form.told.get("time") or time_unit(sample, form.decimal or ".")
    zone = "UTC" if written and any(map(ZONED.search, sample)) else form.time_zone
    return replace(form, time_format=written, time_unit=unit, time_zone=zone)


def _read_otherwise(cells: "pd.Series[Any]", form: Format) -> Iterator[str]:
    """Say how a date was read where another format makes another date of it: 03/04/2024."""
    sample = cells.head(SAMPLE).astype(str)
    for other in time_formats(sample) if form.time_format in FORMATS else []:
        here, there = (times_ns(sample, replace(form, time_format=written)) for written in (form.time_format, other))
        for i in np.flatnonzero((here != there) & (here != NO_TIME) & (there != NO_TIME))[:1]:
            read = f"time: {sample.iloc[i]!r} is read as {pd.Timestamp(here[i]).date()}"
            yield f"{read}, may be {pd.Timestamp(there[i]).date()}: --time-format {other!r}"


def _parquet(path: Path) -> pd.DataFrame:
    """The table, its index as columns where it is named or a time; a text that is missing is an empty cell."""
    try:
        table = pd.read_parquet(path)
    except ImportError:
        raise ValueError(f"{path}: Parquet needs pyarrow: pip install '.[parquet]'") from None
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: is no Parquet file ({error})") from None
    if isinstance(table.index, pd.DatetimeIndex | pd.TimedeltaIndex):
        table.index.name = table.index.name or "time"
    levels = [name for name in table.index.names if name is not None and name not in table]
    table = table.reset_index(level=levels).reset_index(drop=True) if levels else table.reset_index(drop=True)
    table = table.set_axis(list(map(str, table)), axis=1)
    return table.apply(lambda cells: cells if _is_measured(cells) else cells.astype(object).where(cells.notna(), ""))


def _is_measured(cells: "pd.Series[Any]") -> bool:
    """Whether a column of Parquet holds numbers or times, not texts."""
    kinds = pd.api.types
    return any(
        is_kind(cells)
        for is_kind in (kinds.is_numeric_dtype, kinds.is_datetime64_any_dtype, kinds.is_timedelta64_dtype)
    )


def _again(first: Block, rest: Iterator[Block]) -> Iterator[Block]:
    yield first
    yield from rest
