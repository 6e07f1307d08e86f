# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Times that rise: rows whose time does not are refused, and what to do about them is said."""

import numpy as np
import pandas as pd

from ....core.physics.train import Array
from ..cell.numbers import Flags
from ..text import Refusal
from .clock import moment

SET_BACK = "the clock was set back; --time-zone where summer time ended, else cut the log there; or unsorted? --sort"
BEGUN_ANEW = "the clock was set back, or a counter began anew: add to the times behind what they fell by, or cut the "
BEGUN_ANEW += "log there; or unsorted? --sort"
"""Of dates, and of all other times, which are in no zone."""


def rising(rows: pd.DataFrame, source: str, dated: bool) -> tuple[pd.DataFrame, list[Refusal]]:
    """The rows whose time is later than that of all before, and why not the others."""
    ahead = _ahead(rows["t_ns"].to_numpy())
    refused = [
        _out_of_time(
            rows, i, source, f"the row behind it has {moment(rows['t_ns'].iloc[i + 1])}: its stamp is too high"
        )
        for i in np.flatnonzero(ahead).tolist()
    ]
    rows = rows[~ahead]
    t_ns = rows["t_ns"].to_numpy()
    reached = np.maximum.accumulate(t_ns)
    late = np.append(False, t_ns[1:] <= reached[:-1]) if len(t_ns) else np.zeros(0, dtype=bool)
    cure = _cure(rows, late, SET_BACK if dated else BEGUN_ANEW)
    refused += [
        _out_of_time(rows, i, source, f"the last good row has {moment(reached[i - 1])}: {cure}")
        for i in np.flatnonzero(late).tolist()
    ]
    return rows[~late], refused


def _ahead(t_ns: Array) -> Flags:
    """Rows without which all times rise, that make at least the next two late: a stamp is wrong, not the clock."""
    ahead = np.zeros(len(t_ns), dtype=bool)
    if len(t_ns) > 3:
        before = np.append(np.iinfo(np.int64).min, t_ns[:-3])
        this, behind, further = t_ns[:-2], t_ns[1:-1], t_ns[2:]
        ahead[:-2] = (before < behind) & (behind < further) & (further <= this)
    return ahead & bool((np.diff(t_ns[~ahead]) >= 0).all())


def _cure(rows: pd.DataFrame, late: Flags, set_back: str) -> str:
    """What to do about rows whose time does not rise."""
    falls = int(np.count_nonzero(np.diff(rows["t_ns"]) < 0))
    if falls < 3 and late.sum() > 10 * max(falls, 1):
        if falls:
            return set_back
        if rows["t_ns"][late].nunique() == 1 and not late[1]:
            return "the clock stands still from there on: cut the log there"
        repeated = bool(rows.duplicated()[late].all())
        return (
            "rows are there twice: drop them"
            if repeated
            else "rows share a time: log it with the fraction of the second"
        )
    return "drop repeated rows, or sort the log: --sort"


def _out_of_time(rows: pd.DataFrame, index: int, source: str, why: str) -> Refusal:
    line = int(rows.index[index])
    told = f"{source}:{line}: time = {moment(rows['t_ns'].iloc[index])}: time must rise, {why}"
    return Refusal(line, "time_not_rising", told)
