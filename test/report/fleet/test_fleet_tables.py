# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What spreadsheets and data frames make of the tables of brakings: read all the same, or refused by row and column."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from adhesion_node.report.__main__ import main
from adhesion_node.report.fleet.rail import read_fleet, spread
from adhesion_node.report.fleet.tables import read_table
from adhesion_node.run.results.brakings import BRAKING

NS = [1_700_000_000_123_456_789, 1_700_086_400_123_456_789]


def brakings() -> pd.DataFrame:
    """Return two brakings of two trains as `brakings` tells them: adhesion limited the first."""
    frame = pd.DataFrame({name: [0.0, 0.0] for name in BRAKING.names or ()})
    mu = pd.Series([0.05, np.nan])
    frame = frame.assign(
        t_ns=NS, place_m=[1000.0123, 5000.0], place_end_m=[1250.0, 5250.0], from_kmh=100.0, to_kmh=40.0, mu=mu
    ).assign(mu_std=mu / 50, mu_least=0.9 * mu, used=mu.fillna(0.11), mu_lower=[0.04, 0.1], share_brake=[0.0, 1.0])
    frame.insert(0, "time", pd.to_datetime(frame["t_ns"], utc=True))
    frame.insert(0, "recording", ["runs/a", "runs/b"])
    frame.insert(0, "train", ["007", "NA"])
    return frame


def as_saved(path: Path, frame: pd.DataFrame, **how: object) -> Path:
    """Write a table by the ending of its file."""
    if path.suffix == ".csv":
        frame.to_csv(path, **{"index": False} | how)
    else:
        frame.to_parquet(path)
    return path


def test_a_train_keeps_its_name_and_a_stamp_every_digit(tmp_path: Path) -> None:
    for ending in (".csv", ".parquet"):
        table, is_map = read_table(as_saved(tmp_path / f"table{ending}", brakings()))
        assert not is_map
        assert table["train"].tolist() == ["007", "NA"]
        assert table["t_ns"].tolist() == NS


@pytest.mark.parametrize(
    "change",
    [
        pd.DataFrame.convert_dtypes,
        lambda frame: frame.astype(
            dict.fromkeys(frame.columns.drop(["train", "recording", "time", "t_ns"]), "float32")
        ),
        lambda frame: frame.set_index(["train", "recording"]),
        lambda frame: frame.astype(object).where(frame.notna(), None),
        lambda frame: frame.assign(t_ns=frame["time"]),
        lambda frame: frame.round(dict.fromkeys(frame.columns.drop(["train", "recording", "time", "t_ns"]), 4)),
    ],
)
def test_a_copy_counts_once_whatever_types_it_went_through(
    change: Callable[[pd.DataFrame], pd.DataFrame], tmp_path: Path
) -> None:
    copy = as_saved(tmp_path / "copy.parquet", change(brakings()))
    fleet = read_fleet([as_saved(tmp_path / "table.csv", brakings()), copy])
    assert len(fleet.brakings) == 2
    assert len(fleet.remarks) == 2


def test_brakings_that_differ_count_each(tmp_path: Path) -> None:
    """As of two trains with one clock."""
    far = as_saved(tmp_path / "far.csv", brakings().assign(place_m=300e3, place_end_m=300.25e3))
    beside = as_saved(tmp_path / "beside.csv", brakings().assign(place_m=300.25e3, place_end_m=300.5e3))
    assert len(read_fleet([far, beside]).brakings) == 4
    other = as_saved(tmp_path / "other.csv", brakings().assign(place_m=[3000.0, 7000.0], place_end_m=[3250.0, 7250.0]))
    assert len(read_fleet([as_saved(tmp_path / "table.csv", brakings()), other]).brakings) == 4


@pytest.mark.parametrize(
    ("before", "after"), [("\n", ",\n"), (",", ", "), ("train", "﻿train"), ("\n", "\r\n"), ("40.0,", "40.0 ,")]
)
def test_a_spreadsheet_changes_nothing(before: str, after: str, tmp_path: Path) -> None:
    """Commas behind the last cell, blanks behind commas, a mark of the encoding, other ends of lines."""
    table = as_saved(tmp_path / "table.csv", brakings())
    saved = tmp_path / "saved.csv"
    saved.write_text(table.read_text(encoding="utf-8").replace(before, after) + ",,,\n", encoding="utf-8", newline="")
    columns = [*(BRAKING.names or ()), "train", "recording"]
    pd.testing.assert_frame_equal(read_table(saved)[0][columns], read_table(table)[0][columns])


@pytest.mark.parametrize(
    ("column", "cell", "message"),
    [
        ("place_m", "", "column place_m, row 2: it is empty: give a number from -1e+07 to 1e+07"),
        ("place_m", "1000,5", "column place_m, row 2: '1000,5': give a number"),
        ("place_end_m", "inf", "column place_end_m, row 2: 'inf': give a number"),
        ("mu", "n.v.", "column mu, row 2: 'n.v.': give a number from 0 to 1, or leave it empty"),
        ("mu_least", "4.5", "column mu_least, row 2: '4.5': give a number from 0 to 1"),
        ("share_brake", "", "column share_brake, row 2: it is empty"),
        ("t_ns", "t_ns", "column t_ns, row 2: 't_ns': give a number"),
        (
            "t_ns",
            "1.70017E+18",
            "row 2: 1700170000000000000 is 2023-11-16 21:26:40, the time beside it 2023-11-15 22:13",
        ),
    ],
)
def test_a_wrong_cell_is_named(
    column: str, cell: str, message: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    frame = brakings().astype({column: object})
    frame.loc[1, column] = cell
    table = as_saved(tmp_path / "table.csv", frame)
    assert main([str(table), "--output", str(tmp_path / "report")]) == 2
    assert f"table = {table}: {'column t_ns, ' if message.startswith('row') else ''}{message}" in capfd.readouterr().err


def test_another_separator_is_said(tmp_path: Path) -> None:
    table = as_saved(tmp_path / "table.csv", brakings(), sep=";")
    message = "lacks the columns train, recording, t_ns and 18 more; it begins 'train;recording;time"
    with pytest.raises(ValueError, match=rf"table = {table}: {message}.*cells apart by commas"):
        read_table(table)


def test_cells_without_a_name_are_said(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    head, *rows = brakings().to_csv(index=False).splitlines()
    table.write_text("\n".join([head, *(f"{row},a remark" for row in rows)]), encoding="utf-8")
    said = "its rows have more cells than its first line names: name every column, and save decimals with points"
    for text in (table.read_text(encoding="utf-8"), brakings().to_csv(index=False, sep=";", decimal=",")):
        table.write_text(text, encoding="utf-8")
        with pytest.raises(ValueError, match=rf"table = {table}: {said}; .*cells apart by commas"):
            read_table(table)


@pytest.mark.parametrize("day", ["28.11.2023", "2023-1-5"])
def test_a_map_needs_dates_that_sort(day: str, tmp_path: Path) -> None:
    rail = as_saved(tmp_path / "rail.csv", spread(brakings()).assign(date=day))
    with pytest.raises(ValueError, match=re.escape(f"column date, row 1: {day!r}: give YYYY-MM-DD")):
        read_table(rail)


def test_a_row_is_counted_with_the_empty_ones(tmp_path: Path) -> None:
    table = as_saved(tmp_path / "table.csv", brakings().assign(mu=[0.05, 5.0]))
    head, *rows = table.read_text(encoding="utf-8").splitlines()
    table.write_text("\n".join([head, rows[0], "," * head.count(","), rows[1]]), encoding="utf-8")
    with pytest.raises(ValueError, match="column mu, row 3: "):
        read_table(table)


def test_dates_that_the_map_lacks_are_told(tmp_path: Path) -> None:
    table = as_saved(tmp_path / "table.csv", brakings())
    whole, part = spread(brakings()), spread(brakings().iloc[1:])
    assert not read_fleet([table, as_saved(tmp_path / "rail.csv", whole)]).remarks
    (remark,) = read_fleet([table, as_saved(tmp_path / "part.csv", part)]).remarks
    assert remark.startswith("the map has no piece of 2023-11-14, on which 1 of the brakings are")


def test_a_bound_that_is_not_known_is_none_in_json(tmp_path: Path) -> None:
    table, result = as_saved(tmp_path / "table.csv", brakings().assign(mu_lower=np.nan)), tmp_path / "result.json"
    assert main([str(table), "--output", str(tmp_path / "report"), "--json", str(result)]) == 0
    assert '"mu_lower": null' in result.read_text(encoding="utf-8")
