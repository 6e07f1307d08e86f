# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Tables of brakings and maps of the rail as `brakings` writes them, whatever a spreadsheet made of them."""

import warnings
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ...run.results.brakings import BRAKING

WRITTEN_BY = "give what `brakings` writes, cells apart by commas; `import_csv` makes a recording of a log"

FARTHEST_M, LONGEST_M = 1e7, 1e5
"""No line is longer, and no braking or piece of track."""

APART = pd.Timedelta(minutes=1)
"""By no more a stamp differs from the time beside it, which a spreadsheet shows without seconds."""


class Column(NamedTuple):
    """A column of numbers."""

    name: str
    least: float = -inf
    most: float = inf
    needed: bool = False
    """Whether no cell may be empty."""


PLACE, ADHESIONS = Column("place_m", -FARTHEST_M, FARTHEST_M, needed=True), ("mu", "used", "mu_lower")

MAP = (
    *(PLACE, Column("length_m", 1e-3, LONGEST_M, needed=True)),
    *(Column("seen", 1, needed=True), Column("limited", 0, needed=True)),
    *(Column(name, 0.0, 1.0) for name in (*ADHESIONS, "mu_lowest")),
)

KNOWN = (
    *(PLACE, PLACE._replace(name="place_end_m"), Column("t_ns", 0, 2.0**63 - 1024.0, needed=True)),
    *(Column(name, 0.0, 1.0) for name in (*ADHESIONS, "mu_std", "mu_least")),
    *(Column(name, 0.0, 1.0, needed=True) for name in ("share_adhesion", "share_brake", "share_unclaimed")),
    *(Column(name, -1e3, 1e3, needed=True) for name in ("from_kmh", "to_kmh", "deceleration_mps2")),
)

BRAKINGS = tuple({each.name: each for each in (*map(Column, BRAKING.names or ()), *KNOWN)}.values())

TEXTS = ("train", "recording", "date")
"""Columns that are text, even where they look like numbers."""


def read_table(path: Path) -> tuple[pd.DataFrame, bool]:
    """Read a table, and tell whether it is a map. Raises ValueError naming file, column, row and value."""
    try:
        frame = _read(path).dropna(how="all")
        is_map = "length_m" in frame
        columns, texts = (MAP, TEXTS[2:]) if is_map else (BRAKINGS, TEXTS[:2])
        if lacking := [name for name in (*texts, *(each.name for each in columns)) if name not in frame]:
            begins = ", ".join(map(str, frame.columns[:3]))[:20]
            which = ", ".join(lacking[:3]) + (f" and {len(lacking) - 3} more" if len(lacking) > 3 else "")
            raise ValueError(f"lacks the columns {which}; it begins {begins!r}: {WRITTEN_BY}")
        frame = frame.assign(**{name: frame[name].astype(object).fillna("").astype(str) for name in texts})
        frame = frame.assign(**{each.name: _numbers(frame[each.name], each) for each in columns})
        (_check_dates if is_map else _check_stamps)(frame)
    except ValueError as error:
        raise ValueError(f"table = {path}: {error}") from error
    return frame.reset_index(drop=True), is_map


def _read(path: Path) -> pd.DataFrame:
    """Every cell of a CSV file as text, missing where it is empty."""
    if not path.exists():
        raise ValueError("is not there")
    try:
        if path.suffix.lower() == ".parquet":
            frame = pd.read_parquet(path)
            return frame.reset_index() if any(frame.index.names) else frame
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)
            texts = {"dtype": str, "keep_default_na": False, "na_values": [""]}
            return pd.read_csv(path, index_col=False, skipinitialspace=True, **texts)
    except pd.errors.ParserWarning as error:
        more = "its rows have more cells than its first line names"
        raise ValueError(f"{more}: name every column, and save decimals with points; {WRITTEN_BY}") from error
    except ImportError as error:
        raise ValueError("needs pyarrow, pip install '.[parquet]', or give a .csv") from error
    except (OSError, ValueError) as error:
        raise ValueError(f"not readable ({error}): {WRITTEN_BY}") from error


def _numbers(given: pd.Series, column: Column) -> NDArray[Any]:
    """The cells as numbers, NaN where empty; stamps are integers."""
    if pd.api.types.is_datetime64_any_dtype(given):
        given = given.astype("int64") if str(given.dtype).startswith("datetime64[ns") else given.astype(str)
    cells = given.astype(object).where(given.notna() & ~given.isin(["nan", "NaN"]), None)
    numbers = pd.to_numeric(cells, errors="coerce")
    values: NDArray[np.float64] = numbers.to_numpy(np.float64, na_value=np.nan)
    is_empty = cells.isna().to_numpy()
    outside = ~((column.least <= values) & (values <= column.most)) | np.isinf(values)
    wrong = np.flatnonzero(np.where(is_empty, column.needed, outside))
    if wrong.size:
        said = "it is empty" if is_empty[wrong[0]] else repr(given.iloc[wrong[0]])
        ends = f" from {column.least:g} to {column.most:g}" if column.least > -inf else ""
        remedy = f"give a number{ends}" + ("" if column.needed else ", or leave it empty")
        raise ValueError(f"column {column.name}, row {given.index[wrong[0]] + 1}: {said}: {remedy}")
    return numbers.to_numpy(np.int64) if column.name == "t_ns" else values


def _check_dates(rail: pd.DataFrame) -> None:
    known = pd.to_datetime(rail["date"], format="%Y-%m-%d", errors="coerce").dt.strftime("%Y-%m-%d")
    wrong = (known != rail["date"]).to_numpy()  # they are sorted as texts
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ValueError(f"column date, row {rail.index[row] + 1}: {rail['date'].iloc[row]!r}: give YYYY-MM-DD")


def _check_stamps(brakings: pd.DataFrame) -> None:
    """A spreadsheet rounds integers of 19 digits: the time beside them, if it is legible, says so."""
    if "time" not in brakings:
        return
    stamped = pd.to_datetime(brakings["t_ns"], utc=True)
    told = pd.to_datetime(brakings["time"], utc=True, errors="coerce", format="ISO8601")
    wrong = ((stamped - told).abs() > APART).to_numpy()
    if wrong.any():
        row = int(np.argmax(wrong))
        which = f"{brakings['t_ns'].iloc[row]} is {stamped.iloc[row]:%Y-%m-%d %H:%M:%S}"
        other = f"the time beside it {told.iloc[row]:%Y-%m-%d %H:%M:%S}"
        raise ValueError(
            f"column t_ns, row {brakings.index[row] + 1}: {which}, {other}: give every digit, as `brakings` wrote it"
        )
