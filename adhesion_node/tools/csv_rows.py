# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Rows of a CSV log as measurements in SI units, and a reason with a remedy for each row that is none."""

import csv
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from decimal import Decimal, InvalidOperation
from typing import NamedTuple, TextIO

from ..core.intake.samples import MAX_POSITION_M, MAX_SPEED_MPS, MAX_VARIANCE_M2, MIN_VARIANCE_M2
from ..wire.codecs import ATMOSPHERE_PA, MAX_ABSOLUTE_PA, MIN_ABSOLUTE_PA, Line

TIME_UNITS = {"s": Decimal(10**9), "ms": Decimal(10**6), "ns": Decimal(1), "iso": Decimal(10**9)}
POSITION_UNITS = {"m": Decimal(1), "km": Decimal(1000)}
PRESSURE_UNITS = {"pa": Decimal(1), "kpa": Decimal(1000), "bar": Decimal(100_000)}
SPEED_UNITS = {"mps": Decimal(1), "kmh": 1 / Decimal("3.6")}

REQUIRED = ("time", "position")
OPTIONAL = ("variance", "brake_pressure", "speed")

LIMITS = {
    "position": (-MAX_POSITION_M, MAX_POSITION_M, "m: is the --position-unit another?"),
    "variance": (MIN_VARIANCE_M2, MAX_VARIANCE_M2, "m^2: leave it empty where unknown"),
    "brake_pressure": (
        MIN_ABSOLUTE_PA,
        MAX_ABSOLUTE_PA,
        "Pa absolute: is the --pressure-unit, --pressure-kind or --ambient-pressure another?",
    ),
    "speed": (-MAX_SPEED_MPS, MAX_SPEED_MPS, "m/s: is the --speed-unit another?"),
}
"""Least and greatest value in SI, and its unit with the remedy, by column."""

END_OF_STAMPS_NS = 2**31 * 10**9
"""A ROS stamp holds whole seconds in 31 bits: until 2038."""

MAX_EXPONENT = 40
"""Decimal powers beyond this would only overflow on the way to being refused."""

_ISO = re.compile(r"(?P<moment>[^.,]+?)([.,](?P<fraction>\d+))?(?P<zone>Z|[+-]\d\d:?\d\d)?")
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class Format:
    """How to read a log. `named` are the columns the user named: these have to be there."""

    named: Mapping[str, str]
    delimiter: str = ","
    time_unit: str = "s"
    position_unit: str = "m"
    position_std_m: float = 0.5
    """Stands in where the log gives no variance."""
    pressure_unit: str = "pa"
    pressure_is_gauge: bool = True
    ambient_pressure_pa: float = ATMOSPHERE_PA
    speed_unit: str = "mps"

    def __post_init__(self) -> None:
        if len(self.delimiter) != 1 or self.delimiter in '"\r\n':
            raise ValueError(f"delimiter = {self.delimiter!r}: give one character, such as ',' or ';'")
        if not MIN_VARIANCE_M2 <= self.position_std_m**2 <= MAX_VARIANCE_M2:
            raise ValueError(f"position-std = {self.position_std_m!r}: give a standard deviation above 0, in m")
        Line(ambient_pressure_pa=self.ambient_pressure_pa)


class Row(NamedTuple):
    """A measurement; None where the cell is empty or the column missing."""

    t_ns: int
    position_m: float
    variance_m2: float | None
    absolute_pa: float | None
    speed_mps: float | None


class Refusal(NamedTuple):
    """A row that cannot be used: why, for counting, and the whole message."""

    reason: str
    message: str


class _Bad(ValueError):
    """A cell that cannot be used."""

    def __init__(self, reason: str, column: str, value: str, remedy: str) -> None:
        shown = repr(value if len(value) <= 60 else value[:60] + "...")
        super().__init__(f"{column} = {shown}: {remedy}")
        self.reason = reason


def read_rows(file: TextIO, source: str, form: Format) -> Iterator[Row | Refusal]:
    """Yield a measurement or a refusal for every line below the header that is not blank.

    A line is a row: an unclosed quote spoils its own line only. Raises ValueError when the file is empty or a
    column is missing.
    """
    try:
        header = _split(next(file, ""), form.delimiter)
    except _Bad as bad:
        raise ValueError(f"{source}:1: {bad}") from None
    columns = _columns([name.strip() for name in header], source, form)
    last_ns = -1
    for line, text in enumerate(file, start=2):
        if not text.strip():
            continue
        try:
            row = _row(text, columns, len(header), form)
            if row.t_ns <= last_ns:
                shown = _split(text, form.delimiter)[columns["time"]]
                remedy = f"time must rise, the last good row has {last_ns} ns: sort the log, drop repeated rows"
                raise _Bad("time_not_rising", "time", shown, remedy)
        except _Bad as bad:
            yield Refusal(bad.reason, f"{source}:{line}: {bad}")
        else:
            last_ns = row.t_ns
            yield row


def option(column: str) -> str:
    """Return the option that names a column."""
    return "--" + column.removeprefix("brake_")


def _columns(header: list[str], source: str, form: Format) -> dict[str, int]:
    """Return the index of every column in use by our name for it."""
    if not any(header):
        raise ValueError(f"{source}: has no header line: begin with the names of the columns")
    columns = {}
    for ours in (*REQUIRED, *OPTIONAL):
        name = form.named.get(ours, ours)
        if header.count(name) > 1:
            raise ValueError(f"{source}: column {name!r} is there {header.count(name)} times: rename one")
        if name in header:
            columns[ours] = header.index(name)
        elif ours in REQUIRED or ours in form.named:
            remedy = f"it has {header}; name one with {option(ours)} COL"
            raise ValueError(f"{source}: column {name!r} is missing: {remedy}")
    return columns


def _row(text: str, columns: Mapping[str, int], width: int, form: Format) -> Row:
    cells = _split(text, form.delimiter)
    if len(cells) != width:
        remedy = f"{len(cells)} cells under {width} columns: quote a cell that holds {form.delimiter!r}"
        raise _Bad("cell_count", "row", text.strip(), remedy)
    cell = {name: cells[index].strip() for name, index in columns.items()}
    for column in REQUIRED:
        if not cell[column]:
            raise _Bad("empty", column, "", "every row needs a time and a position")
    t_ns = _time_ns(cell["time"], form.time_unit)
    units = {
        "position": POSITION_UNITS[form.position_unit],
        "brake_pressure": PRESSURE_UNITS[form.pressure_unit],
        "speed": SPEED_UNITS[form.speed_unit],
    }
    given = (column for column in LIMITS if cell.get(column))
    numbers = {column: _decimal(column, cell[column]) * units.get(column, 1) for column in given}
    if form.pressure_is_gauge and "brake_pressure" in numbers:
        numbers["brake_pressure"] += Decimal(form.ambient_pressure_pa)
    values = {column: float(number) for column, number in numbers.items()}
    for column, value in values.items():
        least, most, remedy = LIMITS[column]
        if not least <= value <= most:
            raise _Bad("out_of_range", column, cell[column], f"{value:g} is not from {least:g} to {most:g} {remedy}")
    return Row(t_ns, values["position"], *map(values.get, OPTIONAL))


def _decimal(column: str, text: str) -> Decimal:
    try:
        value = Decimal(text)
    except InvalidOperation:
        value = Decimal("nan")
    # Python also reads 1_000 as a number; in a log it is a misprint.
    if not value.is_finite() or "_" in text:
        raise _Bad("not_a_number", column, text, "write a finite number with a decimal point, without its unit")
    if value and not -MAX_EXPONENT < value.adjusted() < MAX_EXPONENT:
        raise _Bad("out_of_range", column, text, "no measured quantity has such a size")
    return value


def _time_ns(text: str, unit: str) -> int:
    """Return the time in whole nanoseconds, exactly; digits beyond are rounded."""
    value = _iso_seconds(text) if unit == "iso" else _decimal("time", text)
    t_ns = int((value * TIME_UNITS[unit]).to_integral_value())
    if not 0 <= t_ns < END_OF_STAMPS_NS:
        remedy = "a stamp lies between 1970 (or 0) and 2038: is the --time-unit another?"
        raise _Bad("out_of_range", "time", text, remedy)
    return t_ns


def _iso_seconds(text: str) -> Decimal:
    """Return the seconds since 1970; without a zone the time is taken as UTC.

    The fraction is kept apart: `datetime` would cut it to microseconds.
    """
    parts = _ISO.fullmatch(text)
    try:
        if parts is None:
            raise ValueError
        moment = datetime.fromisoformat(parts["moment"] + (parts["zone"] or "Z"))
    except ValueError:
        remedy = "write 2024-05-31T10:20:30.125Z, or choose another --time-unit"
        raise _Bad("not_a_time", "time", text, remedy) from None
    return (moment - _EPOCH) // timedelta(seconds=1) + Decimal(f"0.{parts['fraction'] or 0}")


def _split(text: str, delimiter: str) -> list[str]:
    """Return the cells of a line."""
    try:
        return next(csv.reader([text], delimiter=delimiter, strict=True), [])
    except csv.Error as error:
        raise _Bad("broken_quotes", "row", text.strip(), f"close the quotes of this row ({error})") from None
