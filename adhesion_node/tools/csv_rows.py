# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Rows of a CSV log as measurements in SI units, and a reason with a remedy for each row that is none."""

import math
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import NamedTuple, TextIO

from .csv_cells import Bad, decimal, split, time_ns
from .csv_format import LIMITS, PRESSURES, Format

PLACES = (("position",), ("lat", "lon"), ("speed",))
"""Columns of which a log has one group at least, beside the time."""

OPTIONAL = (
    *("position", "lat", "lon", "height", "variance"),
    *("brake_pressure", "brake_demand", "speed", "speed_std", "acceleration"),
)
"""All columns but the time and the axles."""

AXLE = re.compile(r"wheel_speed_\d+")
"""What the columns of the axles are called where none is named."""

EMPTY = "every row needs a time and something measured"


class Row(NamedTuple):
    """What was measured at a time, in SI."""

    t_ns: int
    values: Mapping[str, float]
    """By column; without those that are empty."""
    axles_radps: tuple[float, ...]
    """NaN where a cell is empty; none where all are."""
    empty: tuple[str, ...]
    """Columns of the log that are empty here."""


class Refusal(NamedTuple):
    """A row that cannot be used: why, for counting, and the whole message."""

    reason: str
    message: str


class _Columns(NamedTuple):
    """Where the columns in use are: by our name for it, and those of the axles."""

    indices: Mapping[str, int]
    axles: Mapping[str, int]
    width: int


def read_rows(file: TextIO, source: str, form: Format) -> Iterator[Row | Refusal]:
    """Yield a measurement or a refusal for every line below the header that is not blank.

    A line is a row: an unclosed quote spoils its own line only. Raises ValueError when the file is empty or a
    column is missing.
    """
    try:
        header = split(next(file, ""), form.delimiter)
    except Bad as bad:
        raise ValueError(f"{source}:1: {bad}") from None
    columns = _columns([name.strip() for name in header], source, form)
    factors, last_ns = form.factors(), -1
    for line, text in enumerate(file, start=2):
        if not text.strip():
            continue
        try:
            row = _row(text, columns, form, factors)
            if row.t_ns <= last_ns:
                shown = split(text, form.delimiter)[columns.indices["time"]]
                remedy = f"time must rise, the last good row has {last_ns} ns: sort the log, drop repeated rows"
                raise Bad("time_not_rising", "time", shown, remedy)
        except Bad as bad:
            yield Refusal(bad.reason, f"{source}:{line}: {bad}")
        else:
            last_ns = row.t_ns
            yield row


def option(column: str) -> str:
    """Return the option that names a column.

    >>> option("brake_pressure"), option("speed_std")
    ('--pressure', '--speed-std')
    """
    return "--" + column.removeprefix("brake_").replace("_", "-")


def _columns(header: list[str], source: str, form: Format) -> _Columns:
    """Return where the columns in use are; ValueError names the first that is missing or there twice."""
    if not any(header):
        raise ValueError(f"{source}: has no header line: begin with the names of the columns")
    names = {ours: form.named.get(ours, ours) for ours in ("time", *OPTIONAL)}
    axles = list(form.axles) or [name for name in header if AXLE.fullmatch(name)]
    for name in (*names.values(), *axles):
        if header.count(name) > 1:
            raise ValueError(f"{source}: column {name!r} is there {header.count(name)} times: rename one")
    needed = {name: option(ours) for ours, name in names.items() if ours in form.named or ours == "time"}
    for name, how in (needed | dict.fromkeys(form.axles, "--wheel-speeds")).items():
        if name not in header:
            raise ValueError(f"{source}: column {name!r} is missing: it has {header}; name one with {how} COL")
    indices = {ours: header.index(name) for ours, name in names.items() if name in header}
    if not any(set(group) <= set(indices) for group in PLACES):
        remedy = "name one with --position COL, or --lat COL and --lon COL, or --speed COL"
        raise ValueError(f"{source}: columns {header}: has neither position, lat and lon, nor speed: {remedy}")
    return _Columns(indices, {name: header.index(name) for name in axles}, len(header))


def _row(text: str, columns: _Columns, form: Format, factors: Mapping[str, Decimal]) -> Row:
    cells = [cell.strip() for cell in split(text, form.delimiter)]
    if len(cells) != columns.width:
        remedy = f"{len(cells)} cells under {columns.width} columns: quote a cell that holds {form.delimiter!r}"
        raise Bad("cell_count", "row", text.strip(), remedy)
    cell = {name: cells[index] for name, index in (*columns.indices.items(), *columns.axles.items())}
    others = [name for name in columns.indices if name != "time"]
    empty = tuple(name for name in (*others, *columns.axles) if not cell[name])
    measured = set(cell) - set(empty) - {"time", "height", "variance", "speed_std"}
    if not cell["time"]:
        raise Bad("empty", "time", "", EMPTY)
    if not measured:
        raise Bad("empty", "row", text.strip(), EMPTY)
    if len(measured & {"lat", "lon"}) == 1:
        raise Bad("empty", "row", text.strip(), "a place needs both, latitude and longitude")
    t_ns = time_ns(cell["time"], form.time_unit)

    def number(name: str, kind: str) -> float:
        exact = decimal(name, cell[name]) * factors.get(kind, 1)
        if form.pressure_is_gauge and kind in PRESSURES:
            exact += Decimal(form.ambient_pressure_pa)
        value = float(exact)
        least, most, remedy = LIMITS[kind]
        if not least <= value <= most:
            raise Bad("out_of_range", name, cell[name], f"{value:g} is not from {least:g} to {most:g} {remedy}")
        return value

    values = {name: number(name, name) for name in others if cell[name]}
    axles = tuple(number(name, "wheel_speed") if cell[name] else math.nan for name in columns.axles)
    return Row(t_ns, values, () if all(map(math.isnan, axles)) else axles, empty)
