# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Units, times and options of logs that had the wrong cure, or none: each is said with the right one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import ride, text

__all__ = ["importing"]

ODD: list[tuple[str, Callable[[pd.DataFrame], pd.DataFrame], str, list[str]]] = [
    ("kn", lambda r: r.assign(speed=r.speed / 0.514444), "--speed-unit kn", ["--speed-unit", "kn"]),
    ("mph", lambda r: r.assign(speed=r.speed / 0.44704), "--speed-unit mph", ["--speed-unit", "mph"]),
    ("us", lambda r: r.assign(time=1e6 * r.time), "--time-unit us", ["--time-unit", "us"]),
    ("hours", lambda r: r.assign(time=r.time / 3600.0), "--time-unit h", ["--time-unit", "h"]),
    ("days", lambda r: r.assign(time=25569.0 + r.time / 86400.0), "--time-unit excel", ["--time-unit", "excel"]),
    ("minutes", lambda r: r.assign(time=r.time / 60.0), "another --time-unit", ["--time-unit", "min"]),
    ("mg", lambda r: r.assign(acceleration=1e3 / 9.80665 * r.acceleration), "mg", ["--acceleration-unit", "mg"]),
    (
        "kn beside places",
        lambda r: r.assign(lat=47.0 + r.position / 111_194.9, lon=8.0, speed=r.speed / 0.514444).drop(
            columns="position"
        ),
        "--speed-unit kn",
        ["--speed-unit", "kn"],
    ),
]


def felt(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.assign(acceleration=np.gradient(rows.speed, rows.time))


@pytest.mark.parametrize(("spoil", "said", "cure"), [case[1:] for case in ODD], ids=[case[0] for case in ODD])
def test_what_is_odd_is_said_with_the_unit_that_cures_it(
    importing: Import, spoil: Callable[[pd.DataFrame], pd.DataFrame], said: str, cure: list[str]
) -> None:
    log = text(spoil(felt(ride())))
    assert importing(log) == 1
    assert any(said in odd for odd in importing.summary["odd"]), importing.summary["odd"]
    importing.output = importing.output.with_name("cured")
    assert importing(log, *cure) == 0, importing.summary["odd"]


@pytest.mark.parametrize("axis", [lambda r: 0.0 * r.speed + 9.81, lambda r: np.sin(r.time)])
def test_an_accelerometer_along_another_axis_is_said(importing: Import, axis: Callable[[pd.DataFrame], Any]) -> None:
    rows = ride()
    assert importing(text(rows.assign(acceleration=axis(rows)))) == 1
    assert any("along another axis" in odd for odd in importing.summary["odd"])


def test_a_demand_that_is_a_share_is_said(importing: Import) -> None:
    rows = ride()
    pressed = rows.brake_pressure / 1e5
    log = text(rows.assign(brake_pressure=pressed, brake_demand=(pressed > 0.1) * 1.0))
    assert importing(log, "--pressure-unit", "bar") == 1
    assert any("a share of a full brake is not read" in odd for odd in importing.summary["odd"])


@pytest.mark.parametrize("header", ["speed [kn]", "speed (kts)", "speed_kn"])
def test_knots_are_read(importing: Import, header: str) -> None:
    rows = ride()
    assert importing(text(rows.assign(speed=rows.speed * 3600.0 / 1852.0).rename(columns={"speed": header}))) == 0
    assert importing.messages("speed")[0].twist.twist.linear.x == pytest.approx(rows.speed.iloc[0])


@pytest.mark.parametrize(
    ("written", "options"),
    [
        ("2024-11-21 08:15:0{}+01", ()),
        ("2024-11-21T08:15:0{}+0100", ()),
        ("2024-11-21 08:15:0{}.5+01:00", ()),
        ("21.11.2024 08:15:0{} +0100", ("--time-format", "%d.%m.%Y %H:%M:%S %z")),
    ],
)
def test_a_date_that_names_its_zone_is_in_no_other(importing: Import, written: str, options: tuple[str, ...]) -> None:
    rows = "".join(f"{written.format(second)},{second}\n" for second in range(3))
    assert importing(f"time,position\n{rows}", "--time-zone", "America/New_York", *options) == 0
    begins = pd.Timestamp(importing.positions()[0].t_ns).floor("s")
    assert begins == pd.Timestamp("2024-11-21 07:15:00")


def test_a_date_without_a_zone_is_in_the_one_that_is_told(importing: Import) -> None:
    log = "time,position\n2024-11-21 00:00:00,1\n2024-11-21 00:00:01,2\n"
    assert importing(log, "--time-zone", "Europe/Berlin") == 0
    assert pd.Timestamp(importing.positions()[0].t_ns) == pd.Timestamp("2024-11-20 23:00:00")


@pytest.mark.parametrize(("begins", "utc"), [("02:59:30", "01:59:30"), ("01:59:30", "23:59:30")])
def test_the_hour_that_is_there_twice_joins_the_rows(importing: Import, begins: str, utc: str) -> None:
    """In Berlin summer time ended at 3 on 27 October 2024."""
    times = pd.to_datetime(f"2024-10-27 {begins}") + pd.to_timedelta(np.arange(60), unit="s")
    rows = "".join(f"{time},{30.0 * index}\n" for index, time in enumerate(times.strftime("%Y-%m-%d %H:%M:%S")))
    assert importing(f"time,position\n{rows}", "--time-zone", "Europe/Berlin") == 0
    stamps = [each.t_ns for each in importing.positions()]
    assert np.ptp(np.diff(stamps)) == 0
    assert str(pd.Timestamp(stamps[0]).time()) == utc


@pytest.mark.parametrize("released", ["500000", "0", "-5", "nan", "inf"])
def test_a_pipe_is_released_at_a_pressure_that_pipes_have(importing: Import, released: str) -> None:
    log = "time,position,pipe\n0,0,5.0\n1,30,5.0\n2,60,3.5\n"
    options = "--pipe", "pipe", "--pressure-unit", "bar"
    assert importing(log, *options, "--pipe-released", released) == 2
    assert f"pipe-released = {released} bar: give what the pipe has" in importing.errors[0]
    assert "2 to 12 bar" in importing.errors[0]
    assert importing(log, *options, "--pipe-released", "5.0") == 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--encoding", "base64"), "encoding = 'base64'"),
        (("--encoding", "idna"), "encoding = 'idna'"),
        (("--time-format", "%"), "time-format = '%'"),
        (("--time-format", "%Q%d"), "time-format = '%Q%d'"),
    ],
)
def test_an_option_that_means_nothing_is_named(importing: Import, options: tuple[str, ...], said: str) -> None:
    assert importing("time,position\n0,0\n1,30\n", *options) == 2
    assert said in importing.errors[0]


@pytest.mark.parametrize("mark", [" ", "|"])
def test_a_delimiter_that_nothing_guesses_is_named(importing: Import, mark: str) -> None:
    log = "time,position,speed\n0,0,30\n1,30,30\n".replace(",", mark)
    code = importing(log)
    assert code == 0 or f"is the --delimiter {mark!r}?" in importing.errors[0]
    importing.output = importing.output.with_name("told")
    assert importing(log, "--delimiter", mark) == 0
