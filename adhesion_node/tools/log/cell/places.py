# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Places that are written in parts: chainage as kilometres and metres, angles as degrees, minutes and seconds."""

import re
from typing import Any

import pandas as pd

_NUMBER = "[0-9]+(?:[.,][0-9]+)?"

_CHAINAGE = (
    re.compile(rf"km\s*(?P<sign>-?)(?P<km>{_NUMBER})", re.IGNORECASE),
    *(
        re.compile(rf"(?:[A-Z]{{0,2}}K|km)?\s*(?P<sign>-?)(?P<km>{km})\s*\+\s*(?P<m>{m}(?:[.,][0-9]+)?)", re.IGNORECASE)
        for km, m in (("[0-9]+", "[0-9]{3}"), ("[0-9]+[.,][0-9]", "[0-9]{1,3}"))
    ),
)
"""km 12.345; 12+345.6, DK12+345.6; from a hectometre on 12,3+45.6. Two digits behind a whole number: of a station?"""


def _angles(letters: str, digits: int) -> tuple[re.Pattern[str], ...]:
    """51°28'38.5"N, 51 28 38.5 N, N51:28.64; 5128.641,N as NMEA has it; 51.4774° N."""
    before, behind = rf"(?P<before>[{letters}]?)\s*(?P<sign>[+-]?)", rf"[\s,]*(?P<behind>[{letters}]?)"
    minutes = rf"[°:\s]\s*(?P<m>(?=[0-5]?[0-9]\b){_NUMBER})"
    seconds = rf"(?:(?:['′’:]|\s)\s*(?P<s>(?=[0-5]?[0-9]\b){_NUMBER}))?\s*[\"″”'′’]{{0,2}}"
    return (
        re.compile(rf"{before}(?P<d>[0-9]{{1,3}})\s*{minutes}{seconds}{behind}"),
        re.compile(rf"(?P<d>[0-9]{{{digits}}})(?P<m>[0-5][0-9][.,][0-9]+)[\s,]*(?P<behind>[{letters}])"),
        re.compile(rf"{before}(?P<d>{_NUMBER})\s*°?\s*(?P<behind>[{letters}]?)"),
    )


_FORMS = {"position": _CHAINAGE, "lat": _angles("NS", 2), "lon": _angles("EW", 3)}

PARTS = {
    "position": "; or km and m as 12+345.6",
    "lat": "; or degrees as 51°28'38.5\"N, or 5128.641,N",
    "lon": "; or degrees as 0°07'30.5\"W, or 00007.508,W",
}
"""By column what is understood beside numbers."""


def number_of(cell: str, column: str, unit: str) -> float | None:
    """Return the number in the unit of a column that a cell in parts means; None for any other cell.

    >>> number_of("12+345.6", "position", "m"), number_of("km 12,3+45", "position", "km")
    (12345.6, 12.345)
    >>> number_of("51 30 36 N", "lat", "deg"), number_of("00730.0000,W", "lon", "deg"), number_of("7.5", "lon", "deg")
    (51.51, -7.5, None)
    """
    forms = () if re.fullmatch(rf"[+-]?{_NUMBER}", cell) else _FORMS[column]
    match = next((match for form in forms if (match := form.fullmatch(cell))), None)
    if match is None:
        return None
    parts = match.groupdict("")
    read = {name: float(text.replace(",", ".")) for name, text in parts.items() if text[:1].isdigit()}
    letters = parts.get("before", "") + parts.get("behind", "")
    if len(letters + parts.get("sign", "")) > 1 or (column == "position" and unit not in ("m", "km")):
        return None
    sign = -1.0 if letters in ("S", "W") or parts.get("sign") == "-" else 1.0
    if column == "position":
        return sign * round(1e3 * read["km"] + read.get("m", 0.0), 9) / (1e3 if unit == "km" else 1.0)
    return sign * round(read["d"] + read.get("m", 0.0) / 60.0 + read.get("s", 0.0) / 3600.0, 12)


def with_letters(rows: pd.DataFrame, name: str, column: str) -> "pd.Series[Any]":
    """Return the cells of a latitude or longitude with the N, S, E or W that the column to its right holds alone."""
    right = list(rows).index(name) + 1  # by its place: columns without a name may be several
    letters = rows.iloc[:, right].astype(str) if right < rows.shape[1] else pd.Series("", index=rows.index)
    allowed = {"lat": ("N", "S", ""), "lon": ("E", "W", "")}.get(column, ())
    if not letters.isin(allowed).all() or (letters == "").all():
        return rows[name]
    return rows[name].where(rows[name].isna() | (rows[name] == ""), rows[name].astype(str) + letters)


def in_numbers(cells: "pd.Series[Any]", column: str, unit: str, decimal: str) -> "pd.Series[Any]":
    """Return the cells of a column of places with the numbers that those in parts mean."""
    if pd.api.types.is_numeric_dtype(cells):
        return cells
    read = [number_of(cell, column, unit) for cell in cells.astype(str)]
    return cells.where([each is None for each in read], [str(each).replace(".", decimal) for each in read])
