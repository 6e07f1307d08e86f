# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Reads the rail by place and date that `brakings --map` writes, as CSV or Parquet."""

import csv
import math
import re
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import date
from decimal import Decimal
from pathlib import Path
from typing import Any, TypeVar

from ...core.belief.rail_map import Piece, RailMap

COLUMNS = ("place_m", "length_m", "t_ns", "seen", "mu", "mu_std", "used", "mu_lower", "speed_mps")

Number = TypeVar("Number", int, float)

DAY_NS, EPOCH = 86_400_000_000_000, date(1970, 1, 1).toordinal()

YEAR_NS = 365 * DAY_NS + DAY_NS // 4

ISO = re.compile("[0-9]{4}-(0[1-9]|1[0-2])-(0[1-9]|[12][0-9]|3[01])")
"""A date as `brakings` writes it: a spreadsheet that rounds stamps leaves it."""

UNKNOWN_STD = 0.02
"""Of the adhesion where only what was used is known."""


def read_rail_map(path: str) -> RailMap:
    """Read a map. Raises ValueError with what to mend."""
    source = f"rail_map = {path}"
    try:
        return map_of_rows(_parquet(path) if Path(path).suffix.lower() == ".parquet" else _csv(path))
    except (OSError, UnicodeDecodeError, ImportError, csv.Error) as error:
        raise ValueError(f"{source}: not readable ({error}): `brakings --map` writes one") from error
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error


def odd_stamps(path: str, pieces: Iterable[Piece]) -> Iterator[str]:
    """Say of a map's newest stamp that it is in another unit or to come: it would be of no effect, without a word."""
    newest = max((piece.t_ns for piece in pieces), default=YEAR_NS)
    told = f"rail_map = {path}: t_ns = {newest} is of {1970 + newest // YEAR_NS}"
    if newest < YEAR_NS:
        yield f"{told}, too old for a train of today: is it in s or ms? Give ns; a clock that began at 0 tells no age"
    elif newest > time.time_ns() + DAY_NS:
        yield f"{told}, to come, and makes no train less careful until then: is that clock right, or this one?"


def map_of_rows(rows: Iterable[Mapping[str, Any]]) -> RailMap:
    """The map of rows of `COLUMNS`. Raises ValueError naming a row."""
    pieces = [_piece(number, row) for number, row in enumerate(rows, 1)]
    first = dict[tuple[float, float, int], int]()
    for number, piece in enumerate(pieces, 1):
        before = first.setdefault(piece[:3], number)
        if before != number:  # else what one braking showed would count as if two had
            raise ValueError(f"rows {before} and {number}: one piece at {piece.place_m:g} m, one stamp: give it once")
    return RailMap(tuple(sorted(pieces, key=lambda piece: (piece.place_m, piece.t_ns))))


def _csv(path: str) -> Iterator[Mapping[str, Any]]:
    with Path(path).open(encoding="utf-8-sig", newline="") as file:  # spreadsheets write a mark in front
        rows = csv.DictReader(file)
        if not rows.fieldnames:
            raise ValueError("is empty: `brakings --map` writes one")
        yield from rows


def _parquet(path: str) -> Iterator[Mapping[str, Any]]:
    from pyarrow import parquet

    yield from parquet.read_table(path).to_pylist()


def _whole(given: object) -> int:
    """A float holds no stamp; a spreadsheet writes one as 1.7E+18."""
    return int(Decimal(str(given)))


def _number(number: int, row: Mapping[str, Any], name: str, kind: Callable[[Any], Number]) -> Number:
    given = math.nan if row[name] in (None, "") else row[name]
    try:
        return kind(given)
    except (TypeError, ValueError, ArithmeticError) as error:
        raise ValueError(f"row {number}: {name} = {row[name]!r}: give a number") from error


def _piece(number: int, row: Mapping[str, Any]) -> Piece:
    missing = [name for name in COLUMNS if name not in row]
    if missing:
        raise ValueError(f"lacks the columns {', '.join(missing)}: `brakings --map` writes them, cells apart by commas")
    numbers = {name: _number(number, row, name, float) for name in COLUMNS}
    stamp, seen = (_number(number, row, name, _whole) for name in ("t_ns", "seen"))
    days, told = stamp // DAY_NS, str(row.get("date"))[:10]
    if ISO.fullmatch(told) and date.fromisoformat(told).toordinal() - EPOCH != days:
        raise ValueError(f"row {number}: t_ns = {row['t_ns']} is of another day than {told}: give every digit")
    limited = not math.isnan(numbers["mu"])
    mu, std = (numbers["mu"], numbers["mu_std"]) if limited else (numbers["used"], UNKNOWN_STD)
    lower = min(max(numbers["mu_lower"], 0.0), mu)
    return Piece(numbers["place_m"], numbers["length_m"], stamp, seen, mu, std, lower, numbers["speed_mps"], limited)
