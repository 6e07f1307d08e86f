# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The rows of a log that an option chooses: those of one train, of one kind of message."""

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from ..columns import Columns, require_once
from ..text import Block

SHOWN = 5
"""Values that are listed of a column which has none of those that are asked for."""

SHARED = 0.2
"""Of the rows share their time with another where several trains are in one log."""


def chosen(rows: Iterator[Block], names: Sequence[str], where: Sequence[str], source: str) -> Iterator[Block]:
    """Yield the rows that have one of the values asked for in each column that is asked for, COLUMN=VALUE.

    Raises ValueError where there is no such column, or two, or no such row.
    """
    asked: dict[str, set[str]] = {}
    for each in where:
        name, is_, value = each.partition("=")
        found = [theirs for theirs in names if theirs.casefold() == name.strip().casefold()]
        if not is_ or not found:
            raise ValueError(f"where = {each!r}: write COLUMN=VALUE, with a column of {source}: {list(names)}")
        require_once(found[0], names, source)
        asked.setdefault(found[0], set()).add(value.strip())
    seen: dict[str, dict[str, None]] = {name: {} for name in asked}
    count = 0
    for block in rows:
        for name in seen:
            seen[name] |= dict.fromkeys(block.cells[name].astype(str).unique()[:SHOWN])
        is_one = [block.cells[name].astype(str).isin(values) for name, values in asked.items()]
        kept = block.cells[pd.concat(is_one, axis=1).all(axis=1)] if is_one else block.cells
        count += len(kept)
        yield block._replace(cells=kept)
    if asked and not count:
        has = "; ".join(f"{name} is {', '.join(map(repr, list(values)[:SHOWN]))} ..." for name, values in seen.items())
        raise ValueError(f"{source}: no row has {' and '.join(where)}: {has}")


def with_rows(blocks: Iterator[Block]) -> Iterator[Block]:
    """Yield the blocks that have rows, with what was refused before; the last one in any case."""
    refused, last = [], None
    for last in blocks:
        refused += last.refused
        if len(last.cells):
            yield last._replace(refused=refused)
            refused = []
    if last is not None and refused:
        yield last._replace(refused=refused)


def several(cells: pd.DataFrame, columns: Columns) -> Iterator[str]:
    """Say which column that is not read tells rows of one time apart, as that of the train does."""
    time = columns.names["time"]
    if cells.duplicated(time).mean() <= SHARED:
        return
    for name in (each for each in columns.unread if columns.unread.count(each) == 1):  # --where means one of a name
        values = cells[name].astype(str)
        kinds = values.unique()
        if 1 < len(kinds) <= len(cells) ** 0.5 and not pd.concat([cells[time], values], axis=1).duplicated().any():
            part = "; or is it a part of the time? Write the two in one column" if _rises(cells[time], values) else ""
            yield (
                f"rows of one time differ by {name!r}: are they of several trains? --where {name}={kinds[0]} takes "
                f"those of one{part}"
            )
            return


def _rises(time: "pd.Series[Any]", values: "pd.Series[str]") -> bool:
    """Whether values are numbers up to 999 that rise from row to row of a time, as milliseconds and minutes do."""
    read = pd.to_numeric(values, errors="coerce")
    steps = read.diff()[time.eq(time.shift())]
    return bool(read.between(0, 999).all() and (steps > 0).all())
