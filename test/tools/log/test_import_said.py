# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a log may mean otherwise than it was read: dates, degrees and letters, said with the option that decides."""

from __future__ import annotations

import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as

from adhesion_node.wire.topics import SPEED

__all__ = ["importing"]


@pytest.mark.parametrize(
    ("cells", "day", "other", "option"),
    [
        (("03/04/2024 08:00:00.0", "03/04/2024 08:00:00.1"), "2024-04-03", "2024-03-04", "%m/%d/%Y %H:%M:%S.%f"),
        (("03/04/2024 08:00:00", "03/04/2024 08:00:01"), "2024-04-03", "2024-03-04", "%m/%d/%Y %H:%M:%S.%f"),
        (("03-04-24 08:00:00", "03-04-24 08:00:01"), "2024-04-03", "2003-04-24", "%y-%m-%d %H:%M:%S.%f"),
        (("3/4/2024 8:00:00 PM", "3/4/2024 8:00:01 PM"), "2024-03-04", "2024-04-03", "%d/%m/%Y %I:%M:%S.%f %p"),
    ],
)
def test_a_date_that_may_be_another_is_said_with_the_format(
    importing: Import,
    capsys: pytest.CaptureFixture[str],
    cells: tuple[str, str],
    day: str,
    other: str,
    option: str,
) -> None:
    log = f"time,speed\n{cells[0]},1\n{cells[1]},1\n"
    assert importing(log) == 0
    first = SPEED.read(importing.messages("speed")[0]).t_ns
    said = f"time: {cells[0]!r} is read as {day}, may be {other}: --time-format {option!r}"
    assert said in read_as(importing, capsys)
    importing.output = importing.output.with_name("other")
    assert importing(log, "--time-format", option) == 0
    days = (pd.Timestamp(other) - pd.Timestamp(day)).days
    assert SPEED.read(importing.messages("speed")[0]).t_ns - first == days * 86_400 * 10**9


@pytest.mark.parametrize(
    "cell", ["21/11/2024 08:00:00", "03.04.2024 08:00:00", "2024-04-03 08:00:00", "04/04/2024 08:00:00"]
)
def test_a_date_that_is_no_other_is_not_said(importing: Import, capsys: pytest.CaptureFixture[str], cell: str) -> None:
    assert importing(f"time,speed\n{cell},1\n") == 0
    assert "may be" not in str(read_as(importing, capsys))


def test_a_row_that_is_no_date_is_not_said_to_be_another(importing: Import, capsys: pytest.CaptureFixture[str]) -> None:
    importing("time,speed\n2024-11-21 08:15:03,1\n21.11.2024 08:15:04,1\n")
    assert "may be" not in str(read_as(importing, capsys))


@pytest.mark.parametrize(("lat", "lon", "name"), [("4700.53969", "8.0", "lat"), ("47.0", "00800.539", "lon")])
def test_degrees_and_minutes_of_nmea_are_named(importing: Import, lat: str, lon: str, name: str) -> None:
    assert importing(f"time,lat,lon\n1,{lat},{lon}\n") == 2
    assert importing.errors[0].startswith(f"import_csv: FILE:2: {name} = ")
    assert "ddmm.mmmm, as NMEA has it: write N, S, E or W behind it, in its cell" in importing.errors[0]


@pytest.mark.parametrize(
    ("data", "options", "wrong"),
    [
        ("时间,速度\n1,2\n".encode("gb18030"), [], True),
        ("Zeit,Geschwindigkeit,T\xfcr\n1,2,3\n".encode("latin-1"), ["--encoding", "utf-8"], True),
        ("时间,速度\n1,2\n".encode(), [], False),
        (b"t,v\n1,2\n", [], False),
    ],
)
def test_letters_that_may_be_wrong_are_said_with_the_encoding(
    importing: Import, data: bytes, options: list[str], wrong: bool
) -> None:
    assert importing(data, *options) == 2
    assert ("are its letters wrong? --encoding" in importing.errors[0]) == wrong


@pytest.mark.parametrize(("options", "kind"), [((), " absolute"), (("--pressure-kind", "gauge"), "")])
def test_what_an_option_says_of_pressures_is_not_told_otherwise(
    importing: Import, capsys: pytest.CaptureFixture[str], options: tuple[str, ...], kind: str
) -> None:
    importing("time,speed,brake_pressure [bara]\n1,20,1.5\n2,20,1.5\n")
    assert f"brake_pressure in bar{kind};" in str(read_as(importing, capsys, *options))


def test_columns_are_found_despite_their_case(importing: Import) -> None:
    assert importing("Time,SPEED,Brake_Pressure,Wheel_Speed_1\n1,20,0,40\n2,20,0,40\n") == 0
    topics = {"/speed": 2, "/brake_pressure": 2, "/wheel_speed": 2}
    assert importing.summary["messages"] == topics
