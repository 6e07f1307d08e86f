# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The text of a CSV log: how it is written, guessed from its beginning, and its cells as blocks of columns."""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice, takewhile
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from .cell.decimals import decimal_sign
from .cell.suffixed import number_in
from .cell.units import meant
from .encoded import encoding_of
from .encoded import lines as file_lines
from .format import PLACES, Format
from .headers import how_many_units, is_head, is_header, require_same

DELIMITERS = (",", ";", "\t", "|")

MISSING = frozenset(
    (*("nan", "null", "n/a", "na", "none", "n.a.", "#n/a", "#nv", "<null>", "(null)", "\\n"), *("-", "--", "---"))
)
"""What stands in a cell without a value, however it is written."""

SAMPLE = 300
"""Lines from which it is guessed how a log is written."""

BLOCK = 2_000
"""Lines that are read together."""

NO_HEADER = "has no header line: begin with the names of the columns, their quotes closed; or is --skip-rows another?"

BROKEN = "quotes are not closed in this line: close them, or take the line break out of a name of the header"

AS_TABLE = "no table: save it as CSV, a header and one row per time, as"

NO_TABLE = (
    (r'\s*(\{\s*"|\[\s*[\[{])', f"is JSON, {AS_TABLE} pandas.read_json(FILE).to_csv(OTHER) does of records"),
    (
        r"(?i)\s*<([?!]|gpx|kml|html)",
        f"is XML, as GPX and KML are, or HTML, {AS_TABLE} gpsbabel -o unicsv does of a track",
    ),
    (r"\s*[$!][A-Z]{5},", f"is NMEA 0183, {AS_TABLE} gpsbabel -i nmea -o unicsv does"),
)
"""How a text begins that is none of rows below a header, and what to do with it."""

_COMMENT = re.compile(r"\s*#(?![0-9])")


class Refusal(NamedTuple):
    """A row that cannot be used: its line, why, for counting, and the whole message."""

    line: int
    reason: str
    message: str


class Block(NamedTuple):
    """Rows of a log: the cells by the names of the header, stripped, by line; and what no cells could be made of."""

    cells: pd.DataFrame
    refused: list[Refusal]


def understood(path: Path, form: Format) -> Format:
    """Return the format with encoding, delimiter, decimal sign and header line guessed where they are not given."""
    form = replace(form, encoding=form.encoding or encoding_of(path))
    lines = list(islice(file_lines(path, form.encoding), SAMPLE))
    if not any(map(str.strip, lines)):
        raise ValueError(f"{path}: {NO_HEADER}")
    delimiter, header = _header(path, lines, form)
    rows = {n: cells for n, text in enumerate(lines[header + 1 :], 1) if (cells := _cells(text, delimiter))}
    heads = dict(takewhile(lambda row: is_head(row[1]), islice(rows.items(), max(len(rows) - 1, 0))))
    units = max(heads, key=lambda n: how_many_units(heads[n]), default=0)
    decimal, is_sure = decimal_sign(number_in(cell) for cells in rows.values() for cell in cells)
    return replace(
        form,
        delimiter=delimiter,
        skip_rows=header,
        units=heads.get(units),
        units_at=units,
        below=max(heads, default=0),
        decimal=form.decimal or decimal,
        thousands=is_sure and form.decimal in (None, decimal),
    )


def names_of(path: Path, form: Format) -> list[str]:
    """Return the names in the header of a log whose format is understood."""
    names = _cells(next(islice(file_lines(path, form.encoding), form.skip_rows or 0, None), ""), form.delimiter or ",")
    if not any(re.search(r"[^\W\d]", re.sub("[0-9][eE][+-]?[0-9]", "", name)) for name in names):
        broken = next(
            (n for n, text in enumerate(islice(file_lines(path, form.encoding), SAMPLE), 1) if text.count('"') % 2),
            None,
        )
        raise ValueError(f"{path}: {NO_HEADER}" if broken is None else f"{path}:{broken}: {BROKEN}")
    return names


def blocks(path: Path, form: Format, names: Sequence[str]) -> Iterator[Block]:
    """Yield the rows below the header. A line is a row: an unclosed quote spoils its own line only."""
    first = (form.skip_rows or 0) + 1 + form.below
    numbered = islice(enumerate(file_lines(path, form.encoding), start=1), first, None)
    while lines := list(islice(numbered, BLOCK)):
        yield _block(path, form, names, lines)


def _block(path: Path, form: Format, names: Sequence[str], lines: Iterable[tuple[int, str]]) -> Block:
    delimiter, at, rows, refused = form.delimiter or ",", [], [], []
    for line, text in lines:
        if _COMMENT.match(text):
            continue
        try:
            cells = split(text, delimiter)
        except csv.Error as error:
            why = f"close the quotes of this row ({error})"
            refused.append(Refusal(line, "broken_quotes", f"{path}:{line}: row = {_shown(text)}: {why}"))
            continue
        if not any(cells[len(names) :]):  # a delimiter at the end of the line, none in the header
            cells = cells[: len(names)]
        if is_header(cells, names):
            require_same(cells, names, f"{path}:{line}")
            why = "the header once more: it is left out"
            refused.append(Refusal(line, "header", f"{path}:{line}: row = {_shown(text)}: {why}"))
        elif len(cells) == len(names):
            at.append(line)
            rows.append(["" if cell.lower() in MISSING else cell for cell in cells])
        elif text.strip():
            too = ", or is it the decimal sign, too? Then export with ';'" if delimiter == "," else ""
            cure = f"quote a cell that holds {delimiter!r}{too}" if len(cells) > len(names) else "is the row cut off?"
            why = f"{len(cells)} cells under {len(names)} columns: {cure}"
            refused.append(Refusal(line, "cell_count", f"{path}:{line}: row = {_shown(text)}: {why}"))
    return Block(pd.DataFrame(rows, index=at, columns=list(names), dtype=object), refused)


def split(text: str, delimiter: str) -> list[str]:
    """Return the cells of a line, stripped; raises csv.Error.

    The standard library's reader: of a bad row pandas tells neither the line nor, where cells are missing, that it is.
    """
    cells = next(csv.reader([text], delimiter=delimiter, strict=True, skipinitialspace=True), [])
    return [cell.strip() for cell in cells]


def _cells(text: str, delimiter: str) -> list[str]:
    """The cells of a line; none of one that is blank or broken. Python writes a header behind the mark of a comment."""
    text = re.sub(r"^\s*[#%]\s*", "", text)
    try:
        return split(text, delimiter) if text.strip() else []
    except csv.Error:
        return []


def _header(path: Path, lines: Sequence[str], form: Format) -> tuple[str, int]:
    """Delimiter and header line: where all names stand that must be there, else as most lines have it.

    Raises ValueError for another kind of text.
    """
    delimiters = DELIMITERS if form.delimiter is None else (form.delimiter,)
    if form.skip_rows is not None:
        below = lines[form.skip_rows : form.skip_rows + 1] or [""]
        return max(delimiters, key=below[0].count), form.skip_rows
    wanted = [*({"time": "time"} | dict(form.named)).items(), *(("wheel_speed", name) for name in form.axles)]
    places = [[(ours, form.named.get(ours, ours)) for ours in group] for group in PLACES]
    split_up = {delimiter: [_cells(text, delimiter) for text in lines] for delimiter in delimiters}
    for number in range(len(lines)):
        for delimiter in delimiters:
            cells = split_up[delimiter][number]
            if any(all(meant(name, ours, cells) for ours, name in (*wanted, *place)) for place in places):
                return delimiter, number
    for begins, why in NO_TABLE:
        if re.match(begins, "".join(lines)):
            raise ValueError(f"{path}: {why}")
    widths = {delimiter: Counter(map(len, split_up[delimiter])) for delimiter in delimiters}

    def usual(delimiter: str) -> tuple[int, int]:
        """How many lines have the commonest number of cells, and that number; one cell is none."""
        return max(((count, width) for width, count in widths[delimiter].items() if width > 1), default=(0, 0))

    delimiter = max(delimiters, key=usual)
    width = usual(delimiter)[1] or 1
    named = (number for number, cells in enumerate(split_up[delimiter]) if sum(map(bool, cells)) >= width)
    return delimiter, next(named, next((i for i, cells in enumerate(split_up[delimiter]) if len(cells) >= width), 0))


def _shown(text: str) -> str:
    text = text.strip()
    return repr(text if len(text) <= 60 else text[:60] + "...")
