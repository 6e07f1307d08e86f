# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Logs in Parquet: as a table is kept, its time in a column or in the index, a number, a date or a duration."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import ride

from adhesion_node.tools import import_csv
from adhesion_node.wire.topics import BRAKE_PRESSURE

__all__ = ["importing"]

S = 10**9


def test_parquet_as_well(importing: Import, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pyarrow")
    rows = ride().assign(time=pd.Timestamp("2024-11-21 08:15:03") + pd.to_timedelta(ride().time, unit="s"))
    rows.loc[3, "speed"] = np.nan
    rows.to_parquet(tmp_path / "log.parquet")
    assert import_csv.main([str(tmp_path / "log.parquet"), "--output", str(importing.output)]) == 0
    assert "1 without speed" in capsys.readouterr().out
    assert [sample.position_m for sample in importing.positions()] == rows["position"].tolist()
    assert importing.positions()[1].t_ns == 1_732_176_903 * S + S // 10
    assert BRAKE_PRESSURE.read(importing.messages("brake_pressure")[-1]).pressure_pa == pytest.approx(3e5)
    assert import_csv.main([str(tmp_path / "log.parquet"), "--dry-run", "--decimal", ","]) == 2
    assert capsys.readouterr().err == "import_csv: --decimal ,: a Parquet file is no text: leave it out\n"
    (tmp_path / "none.parquet").write_bytes(b"PAR1")
    assert import_csv.main([str(tmp_path / "none.parquet"), "--dry-run"]) == 2
    assert "is no Parquet file" in capsys.readouterr().err


@pytest.mark.parametrize("written", ["dates", "texts", "a day and texts"])
def test_a_row_without_a_time_is_refused(importing: Import, tmp_path: Path, written: str) -> None:
    pytest.importorskip("pyarrow")
    texts = MOMENTS.dt.strftime("%Y-%m-%d %H:%M:%S.%f")
    day = {"date": texts.str[:10], "time": texts.str[11:]}
    rows = ride().assign(**{"dates": {"time": MOMENTS}, "texts": {"time": texts}, "a day and texts": day}[written])
    rows.loc[3, "time"] = None
    rows.to_parquet(tmp_path / "log.parquet")
    assert import_csv.main([str(tmp_path / "log.parquet"), "--output", str(importing.output)]) == 1
    assert [sample.position_m for sample in importing.positions()] == rows["position"].drop(3).tolist()


@pytest.mark.parametrize("column", ["position", "speed"])
def test_a_text_that_is_missing_is_an_empty_cell(importing: Import, tmp_path: Path, column: str) -> None:
    pytest.importorskip("pyarrow")
    rows = ride().drop(columns="speed" if column == "position" else "position")
    told = rows[column].map("{:.6f}".format)
    rows.assign(**{column: told.where(rows.index != 3, None)}).to_parquet(tmp_path / "log.parquet")
    assert import_csv.main([str(tmp_path / "log.parquet"), "--output", str(importing.output)]) == 0
    assert len(importing.messages(column)) == len(rows) - 1


@pytest.mark.parametrize("column", ["time", "signal", "value", "unit"])
def test_of_a_signal_to_a_row_any_cell_may_be_missing(importing: Import, tmp_path: Path, column: str) -> None:
    pytest.importorskip("pyarrow")
    rows = ride().melt("time", var_name="signal")
    rows = rows.assign(unit=rows.signal.map({"position": "m", "speed": "m/s", "brake_pressure": "Pa"}))
    rows[column] = rows[column].where(rows.index != 3, None)
    rows.to_parquet(tmp_path / "log.parquet")
    assert import_csv.main([str(tmp_path / "log.parquet"), "--output", str(importing.output)]) == (column == "time")
    read = [len(importing.messages(name)) for name in ("position", "speed", "brake_pressure")]
    assert sum(read) == len(rows) - (column != "unit")


MOMENTS = pd.Timestamp("2024-11-21 08:15:03") + pd.to_timedelta(ride().time, unit="s")

TABLES: list[tuple[str, Callable[[pd.DataFrame], pd.DataFrame], int]] = [
    ("dates in the index", lambda rows: rows.assign(time=MOMENTS).set_index("time"), 1_732_176_903 * S),
    (
        "dates in an index without a name",
        lambda rows: rows.drop(columns="time").set_index(pd.DatetimeIndex(MOMENTS.array)),
        1_732_176_903 * S,
    ),
    ("two levels", lambda rows: rows.set_index(["brake_pressure", "time"]), 0),
    ("a level without a name", lambda rows: pd.concat({"A": rows}, names=["unit"]), 0),
    ("durations", lambda rows: rows.assign(time=pd.to_timedelta(rows.time, unit="s")), 0),
    ("durations in the index", lambda rows: rows.set_index(pd.to_timedelta(rows.pop("time"), unit="s")), 0),
    ("an index that is a column, too", lambda rows: rows.set_index(rows.time.to_numpy()).rename_axis("time"), 0),
]


@pytest.mark.parametrize(("table", "first_ns"), [case[1:] for case in TABLES], ids=[case[0] for case in TABLES])
def test_parquet_whose_time_is_the_index_or_a_duration(
    importing: Import, tmp_path: Path, table: Callable[[pd.DataFrame], pd.DataFrame], first_ns: int
) -> None:
    pytest.importorskip("pyarrow")
    log = tmp_path / "log.parquet"
    table(ride()).to_parquet(log)
    assert import_csv.main([str(log), "--output", str(importing.output)]) == 0
    assert [sample.position_m for sample in importing.positions()] == ride().position.tolist()
    assert [sample.t_ns for sample in importing.positions()] == [first_ns + i * S // 10 for i in range(600)]


def test_durations_below_zero_and_none_are_no_times(
    importing: Import, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pyarrow")
    log = tmp_path / "log.parquet"
    times = pd.to_timedelta([-1.0, 0.0, np.nan, 2.0], unit="s")
    pd.DataFrame({"time": times, "speed": 1.0}).to_parquet(log)
    assert import_csv.main([str(log), "--output", str(importing.output), "--json", "-"]) == 1
    assert json.loads(capsys.readouterr().out)["written"] == 2
