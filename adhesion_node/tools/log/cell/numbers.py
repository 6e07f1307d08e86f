# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Columns of a log as numbers and times: what a cell cannot be is NaN, or no time."""

import re
from collections.abc import Iterable
from decimal import Decimal
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ....core.physics.train import Array
from ..format import EXCEL_1970, TIME_UNITS, Format
from .decimals import NO_DECIMAL

Flags = NDArray[np.bool_]
Rows = NDArray[np.intp]

NO_TIME = -1
"""Stands for a cell that is no time, and for one before 1970."""

END_OF_STAMPS_NS = 2**31 * 10**9
"""A ROS stamp holds whole seconds in 31 bits: until 2038."""

CLOCK, OF_HOUR = "%H:%M:%S.%f", "%M:%S.%f"
"""The time of the day alone, and that of the hour, which has a fraction: as a spreadsheet shows times."""

_DAYS = (
    *("%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%m/%d/%Y", "%d-%m-%Y", "%Y/%m/%d", "%Y%m%d"),
    *("%d/%m/%y", "%m/%d/%y", "%d-%m-%y", "%y-%m-%d", "%y/%m/%d", "%y.%m.%d", "%m-%d-%Y"),
    *("%d-%b-%Y", "%d-%b-%y", "%d %b %Y", "%d %b %y", "%d/%b/%Y", "%b %d %Y"),
)

FORMATS = (
    "ISO8601",
    *(f"{day} {CLOCK}" for day in _DAYS),
    CLOCK,
    OF_HOUR,
    *(f"{day} %I:%M:%S.%f %p" for day in ("%m/%d/%Y", "%d/%m/%Y", "%m/%d/%y", "%d/%m/%y", "%d-%b-%y", "%Y-%m-%d")),
    *("%b %d %Y %I:%M:%S.%f %p", "%I:%M:%S.%f %p"),
)
"""Formats of dates that are tried, in this order; a fraction of the second may be missing, its sign be a comma."""

_LIKE = (
    (r"\s*(?:UTC|GMT)$", ""),
    (r"(?<=[0-9])t(?=[0-9])", "T"),
    (r"(?<=[0-9])z$", "Z"),
    (r",\s+", " "),
    (",", "."),
    (r"(:[0-9]{2}:[0-9]{2}):(?=[0-9]{3}(?![0-9]))", r"\g<1>."),
)
"""What a date may have otherwise: UTC, small letters, a comma before the next part or the fraction, a colon before
milliseconds."""

_OF_DAYS = r"^([0-9]{1,5}) days? (?=[0-9])"
"""How a duration begins that pandas or Python has written, 1 days 00:00:03.500000: the days, then a clock's time."""

_DURATION = re.compile(r"\s*P[0-9T]")
"""How a duration of ISO 8601 begins, PT1M3.5S; it is a clock's time, as that above is."""

_BASIC = re.compile(r"\s*[0-9]{4}(-?)[0-9]{2}\1[0-9]{2}[Tt][0-9]{4}")
"""How a date without colons begins, 20241121T081503 or 2024-11-21T081503."""

_EPOCHS = ((1e17, "ns"), (1e14, "us"), (1e11, "ms"))
"""Times from this number on are counted in such units since 1970."""

_EPOCH, _END = (pd.Timestamp(seconds, unit="s", tz="UTC") for seconds in (0, 2**31))

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"


def numbers(cells: "pd.Series[Any]", decimal: str, thousands: bool = False) -> Array:
    """Return the numbers of cells, shape (n,), exactly as Python reads them; NaN for what is no finite number.

    Separators of thousands are understood where the decimal sign stands behind them, 12.345,6; with `thousands` in
    whole numbers, too; and wherever they are no decimal sign, 12'345.

    >>> cells = pd.Series(["12,5", "1.234,5", "1.234", "nan", "1_0"])
    >>> numbers(cells, ",").tolist(), numbers(cells, ",", thousands=True).tolist()
    ([12.5, 1234.5, nan, nan, nan], [12.5, 1234.5, 1234.0, nan, nan])
    >>> numbers(pd.Series(["12'345.6", "12\u202f345", "\u22120.5", "1'2"]), ".").tolist()
    [12345.6, 12345.0, -0.5, nan]
    """
    if pd.api.types.is_numeric_dtype(cells):
        read = cells.to_numpy(dtype=np.float64, na_value=np.nan)
    else:
        text = _ungrouped(cells.astype(str), decimal, thousands)
        if decimal == ",":
            text = text.str.replace(".", "no number", regex=False).str.replace(",", ".", regex=False)
        read = text.where(text.str.fullmatch(_NUMBER), "nan").to_numpy(dtype=object).astype(np.float64)
    return np.where(np.isfinite(read), read, np.nan)


def _ungrouped(text: "pd.Series[str]", decimal: str, thousands: bool) -> "pd.Series[str]":
    """Cells without separators of thousands; the decimal sign stays as it is."""
    text = text.str.replace("\u2212", "-", regex=False).str.replace(NO_DECIMAL, "", regex=True)
    separator = "." if decimal == "," else ","
    in_groups = text.str.fullmatch(rf"[+-]?[0-9]{{1,3}}(?:[{separator}][0-9]{{3}})+[{decimal}][0-9]+")
    in_groups |= grouped(text, decimal) & thousands
    return text.mask(in_groups, text.str.replace(separator, "", regex=False))


def in_flags(cells: "pd.Series[Any]") -> "pd.Series[Any]":
    """Return cells with the number of what is true or false.

    >>> in_flags(pd.Series(["TRUE", "off", "", "0.5"])).tolist()
    ['1', '0', '', '0.5']
    """
    if pd.api.types.is_numeric_dtype(cells) and not pd.api.types.is_bool_dtype(cells):
        return cells
    flags = {**dict.fromkeys(("true", "on", "yes"), "1"), **dict.fromkeys(("false", "off", "no"), "0")}
    return cells.map(lambda cell: flags.get(str(cell).casefold(), cell))


def grouped(cells: "pd.Series[Any]", decimal: str) -> Flags:
    """Return which cells look like whole numbers in groups of thousands.

    >>> grouped(pd.Series(["20.000", "1.234.567", "0.250", "999", "20.5"]), ",").tolist()
    [True, True, False, False, False]
    """
    if pd.api.types.is_numeric_dtype(cells):
        return np.zeros(len(cells), dtype=np.bool_)
    groups = rf"[+-]?[1-9][0-9]{{0,2}}(?:[{'.' if decimal == ',' else ','}][0-9]{{3}})+"
    found: Flags = cells.astype(str).str.fullmatch(groups).to_numpy(dtype=np.bool_)
    return found


def times_ns(cells: "pd.Series[Any]", form: Format) -> "np.ndarray[Any, np.dtype[np.int64]]":
    """Return the times of cells in whole nanoseconds, shape (n,), exactly; `NO_TIME` for what is none.

    A date without zone is taken as it stands: the zone is that of the log as a whole (clock.py).
    """
    if pd.api.types.is_datetime64_any_dtype(cells):
        return _stamps(cells)
    if pd.api.types.is_timedelta64_dtype(cells):
        since = pd.TimedeltaIndex(cells).as_unit("ns").asi8
        return np.where((since >= 0) & (since < END_OF_STAMPS_NS), since, NO_TIME)
    if form.time_format is None:
        unit, sign, text = form.time_unit or "s", form.decimal or ".", cells.astype(str)
        if not pd.api.types.is_numeric_dtype(cells):
            text = _ungrouped(text, sign, form.thousands).str.replace(sign, ".", regex=False)
        return np.array([_count(each, unit) for each in text], dtype=np.int64)
    return _stamps(_parsed(cells.astype(str), form.time_format))


def time_formats(cells: Iterable[str]) -> list[str]:
    """Return those of `FORMATS` that most cells have, in their order; none where all look like numbers.

    >>> time_formats(["21.11.2024 08:15:03", "21.11.2024 08:15:03,5"]), time_formats(["0.1", "0.2"])
    (['%d.%m.%Y %H:%M:%S.%f'], [])
    """
    texts = map(str, cells)  # of Parquet a time may be missing
    text = pd.Series(
        [cell for cell in texts if ":" in cell or _BASIC.match(cell) or _DURATION.match(cell)], dtype=object
    ).astype(str)
    counts = {form: int(_parsed(text, form).notna().sum()) for form in FORMATS if len(text)}
    return [form for form, count in counts.items() if count == max(counts.values())]


def time_unit(cells: Iterable[str], decimal: str) -> str:
    """Return the unit of times that are numbers: by their size, else seconds.

    >>> time_unit(["1700000000123"], "."), time_unit(["1700000000.5"], "."), time_unit(["17"], ".")
    ('ms', 's', 's')
    """
    read = numbers(pd.Series(list(cells), dtype=object), decimal)
    median = float(np.nanmedian(read)) if np.isfinite(read).any() else 0.0
    return next((unit for least, unit in _EPOCHS if median >= least), "s")


def is_clock(form: str | None) -> bool:
    """Whether a format of times has no date.

    >>> is_clock(CLOCK), is_clock("ISO8601"), is_clock(None)
    (True, False, False)
    """
    return form is not None and form != "ISO8601" and not re.search("%[djxcs]", form)


def has_dates(form: Format) -> bool:
    """Whether the times are dates, which are in a zone; a clock's and numbers are in none."""
    return form.time_format is not None and not is_clock(form.time_format)


def _parsed(text: "pd.Series[str]", form: str) -> "pd.Series[Any]":
    """The dates of a format; a clock's are those of the day on which the epoch begins."""
    lasting = text.where(text.str.match(_DURATION)) if form == CLOCK else None
    if form in FORMATS:
        for written, meant in _LIKE:
            text = text.str.replace(written, meant, regex=True)
    if form in FORMATS[1:] and form != OF_HOUR:
        text = text.str.replace(r"^(.*:[0-9]+)(?=$| *[AaPp][Mm]$)", r"\g<1>.0", regex=True)
    days = text.str.extract(_OF_DAYS, expand=False) if form == CLOCK else None
    if is_clock(form):
        form, text = f"%Y-%m-%d {form}", "1970-01-01 " + text.str.replace(_OF_DAYS, "", regex=True)
    read = pd.to_datetime(text, format=form, errors="coerce", utc=True)
    if days is None:
        return read
    read += pd.to_timedelta(days.fillna("0").astype(int), unit="D")
    return read.fillna(_EPOCH + pd.to_timedelta(lasting, errors="coerce"))


def _stamps(read: "pd.Series[Any]") -> "np.ndarray[Any, np.dtype[np.int64]]":
    """Nanoseconds since 1970; those that are not until 2038 are no times."""
    index = pd.DatetimeIndex(read)
    index = index.tz_localize("UTC") if index.tz is None else index.tz_convert("UTC")
    inside = (index >= _EPOCH) & (index < _END)  # what is no date is not
    return np.where(inside, index.where(inside, _EPOCH).as_unit("ns").asi8, NO_TIME)


def _count(text: str, unit: str) -> int:
    """A number of units, exactly; digits beyond the nanosecond are rounded."""
    try:
        value = Decimal(text)
        value -= EXCEL_1970 if unit == "excel" and value >= EXCEL_1970 else 0  # less is the time of a day alone
        value *= TIME_UNITS[unit]
    except ArithmeticError:
        return NO_TIME
    # Python also reads 1_000 as a number; in a log it is a misprint.
    if "_" in text or not value.is_finite() or not 0 <= value < END_OF_STAMPS_NS:
        return NO_TIME
    return int(value.to_integral_value())
