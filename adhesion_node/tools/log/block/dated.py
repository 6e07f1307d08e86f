# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Dates in a column of their own, beside the time of the day: the two together are the time."""

from dataclasses import replace

import pandas as pd

from ..cell.numbers import NO_TIME, is_clock, time_formats, times_ns
from ..columns import Columns
from ..format import Format
from ..text import SAMPLE, Block


def date_of(cells: pd.DataFrame, columns: Columns, form: Format) -> str | None:
    """Return the column whose dates belong to the times: that of --date, else `date`, where the times have none."""
    date = columns.names.get("date")
    if date is None or "date" in form.named:
        return date
    sample = cells.head(SAMPLE)
    alone, dated = (sample[columns.names["time"]].astype(str), joined(sample, date, columns)[columns.names["time"]])
    if form.time_format is not None or not is_clock(next(iter(time_formats(alone)), None)):
        return None
    written = time_formats(dated)[0]
    is_date = not is_clock(written) and bool((times_ns(dated, replace(form, time_format=written)) != NO_TIME).any())
    return date if is_date else None


def joined(cells: pd.DataFrame, date: str, columns: Columns) -> pd.DataFrame:
    """Return the cells with the dates before the times."""
    time = columns.names["time"]
    dates, times = (cells[name].astype(str) for name in (date, time))
    return cells.assign(**{time: times.where(times == "", dates + " " + times)})


def with_dates(block: Block, date: str | None, columns: Columns) -> Block:
    """Return a block with the dates before the times, where there are any."""
    return block if date is None else block._replace(cells=joined(block.cells, date, columns))


def without_date(columns: Columns, is_used: bool) -> Columns:
    """Return the columns without that of the dates, which means nothing where it is not used."""
    names = dict(columns.names)
    date = names.pop("date", None)
    unread = columns.unread if date is None or is_used else (date, *columns.unread)
    return columns._replace(names=names, unread=unread)
