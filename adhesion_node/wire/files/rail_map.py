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
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ...core.belief.rail_map import Piece, RailMap

COLUMNS = ("place_m", "length_m", "t_ns", "seen", "mu", "mu_std", "used", "mu_lower", "speed_mps")

UNKNOWN_STD = 0.02
"""Of the adhesion where only what was used is known."""


def read_rail_map(path: str) -> RailMap:
    """Read a map. Raises ValueError with what to mend."""
    source = f"rail_map = {path}"
    try:
        return map_of_rows(_parquet(path) if Path(path).suffix.lower() == ".parquet" else _csv(path))
    except (OSError, UnicodeDecodeError, ImportError) as error:
        raise ValueError(f"{source}: not readable ({error}): `brakings --map` writes one") from error
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error


def map_of_rows(rows: Iterable[Mapping[str, Any]]) -> RailMap:
    """The map of rows of `COLUMNS`. Raises ValueError naming a row."""
    pieces = [_piece(number, row) for number, row in enumerate(rows, 1)]
    return RailMap(tuple(sorted(pieces, key=lambda piece: (piece.place_m, piece.t_ns))))


def _csv(path: str) -> Iterator[Mapping[str, Any]]:
    with Path(path).open(encoding="utf-8", newline="") as file:
        yield from csv.DictReader(file)


def _parquet(path: str) -> Iterator[Mapping[str, Any]]:
    from pyarrow import parquet

    yield from parquet.read_table(path).to_pylist()


def _piece(number: int, row: Mapping[str, Any]) -> Piece:
    missing = [name for name in COLUMNS if name not in row]
    if missing:
        raise ValueError(f"lacks the columns {', '.join(missing)}: `brakings --map` writes them")
    try:
        numbers = {
            name: math.nan if row[name] in (None, "") else float(row[name]) for name in COLUMNS if name != "t_ns"
        }
        stamp, seen = int(row["t_ns"]), int(float(row["seen"]))
    except (TypeError, ValueError) as error:
        raise ValueError(f"row {number}: {error}: give numbers") from error
    limited = not math.isnan(numbers["mu"])
    mu, std = (numbers["mu"], numbers["mu_std"]) if limited else (numbers["used"], UNKNOWN_STD)
    lower = min(max(numbers["mu_lower"], 0.0), mu)
    return Piece(numbers["place_m"], numbers["length_m"], stamp, seen, mu, std, lower, numbers["speed_mps"], limited)
