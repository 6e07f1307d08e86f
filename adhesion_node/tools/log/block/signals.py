# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Logs with a signal to a row, as of a vehicle bus or a historian: its name in one column, its value in another."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from ..columns import Columns, require_once
from ..format import Format
from ..text import BLOCK, Block


class Signals(NamedTuple):
    """The columns of name and value, and by the name that a column of its own gets the name of every signal."""

    name: str
    value: str
    columns: dict[str, str]
    rest: tuple[str, ...]
    """Columns of which every row has its own: the time."""


def signals_of(rows: Iterator[Block], names: Sequence[str], form: Format, source: str) -> Signals | None:
    """Return the signals of a log that has one to a row, each with its unit where a column `unit` tells it, else None.

    Raises ValueError where a column is missing that was asked for, or there twice.
    """
    plain = {name.casefold(): name for name in reversed(names)}
    name, value = (
        plain.get((asked or ours).casefold()) for ours, asked in (("signal", form.signal), ("value", form.value))
    )
    if name is None or value is None:
        for option, asked, found in (("signal", form.signal, name), ("value", form.value, value)):
            if asked is not None and found is None:
                raise ValueError(
                    f"{source}: column {asked!r} is missing: it has {list(names)}; --{option} COL names one"
                )
        if form.signal or form.value:
            raise ValueError(
                f"{source}: a signal to a row needs both, its name and its value: --signal COL --value COL"
            )
        return None
    unit = plain.get("unit")
    for each in filter(None, (name, value, unit)):
        require_once(each, names, source)
    units: dict[str, str] = {}
    for block in rows:
        cells = block.cells.drop_duplicates(name)
        of_each = cells[unit].astype(str) if unit else [""] * len(cells)
        units = dict(zip(cells[name].astype(str), of_each, strict=True)) | units
    columns = {f"{signal} [{told}]" if told else signal: signal for signal, told in units.items() if signal}
    return Signals(name, value, columns, tuple(each for each in names if each not in (name, value, unit)))


def spread(rows: Iterator[Block], signals: Signals, columns: Columns) -> Iterator[Block]:
    """Yield rows with a column for each signal that is read; those of one time are one row.

    All of them at once, as a log may go through its signals one by one.
    """
    used = [name for name in (*columns.names.values(), *columns.axles) if name in signals.columns]
    rest = [name for name in (*columns.names.values(),) if name in signals.rest]
    known = {signals.columns[name] for name in used}
    parts, refused = [], []
    for block in rows:
        refused += block.refused
        parts.append(block.cells.loc[block.cells[signals.name].isin(known), [*rest, signals.name, signals.value]])
    cells = pd.concat(parts)
    nth = cells.groupby([*rest, signals.name], dropna=False).cumcount()
    at = cells.groupby([*(cells[name] for name in rest), nth], sort=False, dropna=False).ngroup().to_numpy()
    first = np.unique(at, return_index=True)[1]
    wide = cells.iloc[first][rest].copy()
    values = cells[signals.value].to_numpy(dtype=object, na_value="")
    for name in used:
        is_it = (cells[signals.name] == signals.columns[name]).to_numpy()
        filled = np.full(len(wide), "", dtype=object)
        filled[at[is_it]] = values[is_it]
        wide[name] = filled
    for begin in range(0, max(len(wide), 1), BLOCK):
        yield Block(wide.iloc[begin : begin + BLOCK], refused if begin == 0 else [])
