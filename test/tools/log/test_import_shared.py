# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Rows that share a time: of different signals they are one row, of the same ones none can tell which counts."""

from __future__ import annotations

import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as, ride, text

__all__ = ["importing"]


def by_signal(rows: pd.DataFrame) -> pd.DataFrame:
    """A row for each signal, as buses are logged."""
    signals = [rows[["time", name]] for name in rows.columns.drop("time")]
    return pd.concat(signals).sort_values("time", kind="stable")[list(rows)]


def test_rows_of_one_time_that_fill_different_cells_are_one(
    importing: Import, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = ride()
    importing(text(rows))
    expected = [list(map(repr, importing.messages(topic))) for topic in importing.summary["messages"]]
    importing.output = importing.output.with_name("by signal")
    assert importing(text(by_signal(rows))) == 0, importing.errors
    assert [list(map(repr, importing.messages(topic))) for topic in importing.summary["messages"]] == expected
    told = "time: 1200 rows share theirs with the one before and fill other cells: taken together"
    assert told in read_as(importing, capsys)


def test_unsorted_rows_of_one_time_are_one_once_they_are_sorted(importing: Import) -> None:
    rows = ride()
    signals = pd.concat([rows[["time", name]] for name in rows.columns.drop("time")])[list(rows)]
    assert importing(text(signals), "--sort") == 0, importing.errors
    assert importing.summary["written"] == 600


def test_rows_of_one_time_that_fill_the_same_cell_are_refused(importing: Import) -> None:
    assert importing("time,position,speed\n1,10,\n1,11,20\n2,30,20\n") == 1
    assert importing.summary["refused"] == {"time_not_rising": 1}
    assert [sample.position_m for sample in importing.positions()] == [10.0, 30.0]


@pytest.mark.parametrize("name", ["speed", "position", "brake_pressure"])
def test_a_column_that_is_empty_is_told_and_the_others_are_read(importing: Import, name: str) -> None:
    assert importing(text(ride().assign(**{name: ""}))) == 1
    (odd,) = importing.summary["odd"]
    assert odd.startswith(f"no row has a {name}: name another column")
