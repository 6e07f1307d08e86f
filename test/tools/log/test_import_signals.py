# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Logs with a signal to a row, and logs of several trains: the rows that are meant are read, the rest is left."""

from __future__ import annotations

import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import ride, text

from adhesion_node.tools import import_csv
from adhesion_node.wire.topics import BRAKE_PRESSURE, SPEED

__all__ = ["importing"]

NAMED = ["--speed", "v_ist", "--position", "s", "--pressure", "p_C"]


def signals() -> pd.DataFrame:
    """The ride as of a bus: the pressure in every second row, a door beside it."""
    rows = (
        ride()
        .rename(columns={"position": "s", "brake_pressure": "p_C"})
        .assign(door=1, p_C=ride().brake_pressure / 1e5)
    )
    rows = rows.assign(v_ist=rows.pop("speed") * 3.6).melt("time", var_name="signal")
    rows["unit"] = rows.signal.map({"v_ist": "km/h", "s": "m", "p_C": "bar", "door": ""})
    return rows[(rows.signal != "p_C") | (rows.index % 2 == 0)]


@pytest.mark.parametrize("by", [["signal"], ["time"]], ids=["one by one", "time by time"])
def test_a_signal_to_a_row_is_read_with_its_unit(importing: Import, by: list[str]) -> None:
    assert importing(text(signals().sort_values(by, kind="stable")), *NAMED) == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == ride()["position"].tolist()
    speeds = [SPEED.read(message).speed_mps for message in importing.messages("speed")]
    assert speeds == pytest.approx(ride()["speed"].tolist())
    assert BRAKE_PRESSURE.read(importing.messages("brake_pressure")[-1]).pressure_pa == pytest.approx(3e5)
    assert len(importing.messages("brake_pressure")) == 300


def test_places_by_satellite_are_joined(importing: Import) -> None:
    rows = ride().assign(lat=47.0 + ride().position / 111.2e3, lon=8.0).drop(columns="position").melt("time")
    assert importing(text(rows), "--signal", "Variable") == 0, importing.errors
    assert [message.latitude for message in importing.messages("fix")] == rows[rows.variable == "lat"].value.tolist()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ([], "a signal to a row? --signal COL --value COL; else name one with"),
        (
            ["--signal", "sgnal"],
            "column 'sgnal' is missing: it has ['time', 'variable', 'value']; --signal COL names one",
        ),
        (["--value", "value"], "a signal to a row needs both, its name and its value: --signal COL --value COL"),
    ],
)
def test_a_signal_to_a_row_is_told_as_such(importing: Import, options: list[str], said: str) -> None:
    assert importing(text(ride().melt("time")), *options) == 2
    assert said in importing.errors[0]


def trains() -> pd.DataFrame:
    other = ride().assign(position=lambda ours: ours.position + 7e3, train=12)
    return pd.concat([ride().assign(train=11), other]).sort_values(["time", "train"])


def test_the_rows_of_one_train_are_chosen(importing: Import) -> None:
    assert importing(text(trains()), "--where", "Train=12") == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == (ride()["position"] + 7e3).tolist()
    assert import_csv.main(["--where", "train=12", "--dry-run", str(importing.log)]) == 0


def test_a_train_that_comes_late_in_the_log_is_read_as_it_is_written(importing: Import) -> None:
    *others, late = (ride().assign(train=train).astype(str) for train in (8, 9, 10, 11, 12))
    late["time"] = "08:" + pd.to_datetime(late.time.astype(float), unit="s").dt.strftime("%M:%S.%f")
    assert importing(text(pd.concat([*others, late])), "--where", "train=12") == 0, importing.errors
    assert importing.positions()[0].t_ns == 8 * 3600 * 10**9


def test_several_trains_are_told_with_the_option(importing: Import) -> None:
    assert importing(text(trains())) == 1
    assert any("differ by 'train': are they of several trains? --where train=11" in line for line in importing.errors)


def test_a_part_of_the_time_in_a_column_of_its_own_is_told(importing: Import) -> None:
    """One row in ten was left where the advice to choose a train was followed."""
    rows = ride()
    split = rows.assign(time=rows.time.astype(int), ms=(1000 * (rows.time % 1)).round().astype(int))
    assert importing(text(split)) == 1
    cure = "--where ms=0 takes those of one; or is it a part of the time? Write the two in one column"
    assert any(line.endswith(cure) for line in importing.errors), importing.errors


def test_namesakes_that_are_not_read_may_tell_rows_of_one_time_apart(importing: Import) -> None:
    log = text(trains().assign(state=lambda rows: rows.train)).replace("train", "state", 1)
    assert importing(log) == 1
    assert importing.summary["refused"] == {"time_not_rising": len(ride())}


@pytest.mark.parametrize(
    ("where", "said"),
    [
        ("train=13", "no row has train=13: train is '11', '12' ..."),
        ("tran=12", "where = 'tran=12': write COLUMN=VALUE, with a column of"),
        ("train", "where = 'train': write COLUMN=VALUE, with a column of"),
    ],
)
def test_rows_that_are_not_there_are_told(importing: Import, where: str, said: str) -> None:
    assert importing(text(trains()), "--where", where) == 2
    assert said in importing.errors[0]
