# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The table of all brakings: in order, each once, summed up and written."""

import sys
from pathlib import Path
from typing import Any

import pandas as pd

from ...command.written import naming, whole


def table_of(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per braking, in the order of time."""
    table = rows.sort_values("t_ns", ignore_index=True)
    table.insert(0, "time", pd.to_datetime(table["t_ns"], utc=True))
    return table[["train", "recording", *table.columns.drop(["train", "recording"])]]


def say_undated(table: pd.DataFrame) -> None:
    """A date of 1970 is that of a clock which began at 0."""
    undated = table["recording"][table["time"].dt.year == 1970].unique()
    if undated.size:
        what = "stamps of 1970, as of a clock that began at 0, tell no date, and the map no age"
        print(f"brakings: {', '.join(undated)}: {what}: stamp them in UTC, or import logs with dates", file=sys.stderr)


def summary(table: pd.DataFrame) -> dict[str, Any]:
    """What a person looks at first: how many brakings showed the adhesion, and the lowest of all."""
    limited = table[table["mu"].notna()]
    if limited.empty:
        return {"limited": 0, "lowest_mu": None}
    lowest = limited.loc[limited["mu_least"].idxmin()]
    return {
        "limited": len(limited),
        "lowest_mu": float(lowest["mu_least"]),
        "lowest_at": f"{lowest['place_m']:.0f} to {lowest['place_end_m']:.0f} m, {lowest['time']:%Y-%m-%d %H:%M}",
    }


def write(frame: pd.DataFrame, path: str) -> None:
    """Write a table as CSV or Parquet, by the ending of its file."""
    with naming(path), whole(path) as part:
        if Path(path).suffix == ".csv":
            frame.to_csv(part, index=False)
            return
        try:
            frame.to_parquet(part, index=False)
        except ImportError as error:
            raise ValueError(f"output = {path}: needs pyarrow, pip install '.[parquet]', or write a .csv") from error
