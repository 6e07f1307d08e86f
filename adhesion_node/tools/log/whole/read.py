# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A log is read whole: each step of its understanding in turn, and notes of what was done."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from ..cell.numbers import has_dates
from ..columns import Columns
from ..format import PRESSURES, Format
from ..opened import open_log
from ..rows import measured
from ..text import Refusal
from .changes import between_changes
from .clock import going_on, in_digits, in_zone
from .held import without_held
from .pipe import demanded
from .rising import rising
from .shared import together
from .steps import stds_of
from .wraps import unwrapped


class Log(NamedTuple):
    """What a log has measured."""

    form: Format
    """With nothing left open."""
    columns: Columns
    rows: pd.DataFrame
    """By line of the log: `t_ns`, which rises, and every column in SI, NaN where a cell is empty."""
    notes: tuple[str, ...]
    """What was done with it."""
    stds: Mapping[str, float]
    """By topic, where the log tells none; 0: the estimator's setting."""


def read_log(path: Path, form: Format, tell: Callable[[Refusal], None]) -> Log:
    """Read a log and `tell` of every row that is refused.

    Raises ValueError when the file is empty or a column is missing.
    """
    source = open_log(path, form)
    parts, read_as = [], dict[str, str]()
    for rows, refused, said in measured(str(path), source):
        parts.append(rows)
        read_as |= said
        for each in refused:
            tell(each)
    rows, timed, digits = in_digits(pd.concat(parts), source.form, form)
    rows, counted = going_on(rows, timed)
    rows, notes, no_such = in_zone(rows, timed)
    rows, shared = together(rows.sort_values("t_ns", kind="stable") if timed.sort else rows)
    rows, refused = rising(rows, str(path), has_dates(timed))
    for each in refused:
        tell(each)
    doubts = (*source.columns.doubts, *no_such, *(source.trains if refused else []))
    rows, on_change = between_changes(rows) if form.hold else (rows, [])
    rows, held = without_held(rows)
    rows, wrapped = unwrapped(rows, form)
    notes += source.notes + digits + counted + shared + on_change + held + wrapped
    notes += [f"{name}: {said}" for name, said in read_as.items()]
    if form.direction == "down" and "position" in rows:
        rows["position"] = -rows["position"]
        notes.append(
            "direction: positions are minus the chainage, so are those of track; else: replay --set direction=down"
        )
    form = timed
    if "brake_pipe" in rows:
        rows, form, note = demanded(rows, form)
        notes.append(note)
    notes += [
        f"{name}: a full brake is {form.full_pressure_pa:g} Pa in the cylinders, --full-pressure"
        for name in PRESSURES
        if name in source.columns.names and form.is_share(name)
    ]
    stds, coarse = stds_of(rows, form)
    return Log(form, source.columns._replace(doubts=doubts), rows, (*notes, *coarse), stds)
