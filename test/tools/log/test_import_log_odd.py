# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is odd of a log is said, with the option that cures it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as, ride, text

__all__ = ["importing"]


def kilometre(rows: pd.DataFrame) -> pd.Series[Any]:
    return 120_000.0 - rows["position"]


ODD: list[tuple[str, Callable[[pd.DataFrame], pd.DataFrame], str, list[str]]] = [
    ("falling", lambda r: r.assign(position=kilometre(r)), "the positions fall", ["--direction", "down"]),
    (
        "falling alone",
        lambda r: r.assign(position=kilometre(r)).drop(columns="speed"),
        "the positions fall",
        ["--direction", "down"],
    ),
    ("bar", lambda r: r.assign(brake_pressure=r.brake_pressure / 1e5), "in bar", ["--pressure-unit", "bar"]),
    ("kPa", lambda r: r.assign(brake_pressure=r.brake_pressure / 1e3), "in kpa", ["--pressure-unit", "kpa"]),
    (
        "absolute",
        lambda r: r.assign(brake_pressure=r.brake_pressure + 1e5),
        "never falls below 1 bar",
        ["--pressure-kind", "absolute"],
    ),
    ("km/h", lambda r: r.assign(speed=3.6 * r.speed), "0.278 times the speed", ["--speed-unit", "kmh"]),
    ("km", lambda r: r.assign(position=r.position / 1e3), "0.001 times the speed", ["--position-unit", "km"]),
    (
        "km alone",
        lambda r: r.assign(position=r.position / 1e3).drop(columns="speed"),
        "creeps at 0.05 m/s",
        ["--position-unit", "km"],
    ),
    (
        "km/h alone",
        lambda r: r.assign(speed=3.6 * r.speed).drop(columns="position"),
        "648 km/h",
        ["--speed-unit", "kmh"],
    ),
    (
        "wheels in km/h",
        lambda r: r.assign(wheel_speed_1=3.6 * r.speed),
        "their radius were 0.28 m",
        ["--wheel-unit", "kmh"],
    ),
    ("ms", lambda r: r.assign(time=1e3 * r.time), "a row every 100 s", ["--time-unit", "ms"]),
    (
        "degrees",
        lambda r: r.assign(position=47.0 + r.position / 111_181.0),
        "are they degrees",
        ["--lat", "position", "--lon", "lon"],
    ),
    (
        "degrees alone",
        lambda r: r.assign(position=47.0 + r.position / 111_181.0).drop(columns="speed"),
        "are the positions degrees",
        ["--lat", "position", "--lon", "lon"],
    ),
    (
        "pipe in bar",
        lambda r: r.rename(columns={"brake_pressure": "brake_pipe"}).assign(brake_pipe=5.0 - r.brake_pressure / 2e5),
        "brake_pipe is 5 pa at most",
        ["--pressure-unit", "bar"],
    ),
    (
        "an hour in spring",
        lambda r: r.assign(
            time=pd.Series(
                pd.to_datetime("2024-03-31 01:59:30")
                + pd.to_timedelta(r.time, unit="s")
                + pd.to_timedelta(3600 * (r.time >= 30.0), unit="s")
            ).dt.strftime("%Y-%m-%d %H:%M:%S.%f")
        ),
        "the clock goes on by 3600 s",
        ["--time-zone", "Europe/Berlin"],
    ),
    (
        "pipe",
        lambda r: r.assign(brake_pressure=5e5 - r.brake_pressure / 2),
        "5.0 bar while the train runs",
        ["--pipe", "brake_pressure"],
    ),
    ("kn", lambda r: r.assign(speed=r.speed / 0.514444), "--speed-unit kn", ["--speed-unit", "kn"]),
    ("mph", lambda r: r.assign(speed=r.speed / 0.44704), "--speed-unit mph", ["--speed-unit", "mph"]),
    ("us", lambda r: r.assign(time=1e6 * r.time), "--time-unit us", ["--time-unit", "us"]),
    ("hours", lambda r: r.assign(time=r.time / 3600.0), "--time-unit h", ["--time-unit", "h"]),
    ("days", lambda r: r.assign(time=25569.0 + r.time / 86400.0), "--time-unit excel", ["--time-unit", "excel"]),
    ("minutes", lambda r: r.assign(time=r.time / 60.0), "another --time-unit", ["--time-unit", "min"]),
    (
        "mg",
        lambda r: r.assign(acceleration=1e3 / 9.80665 * np.gradient(r.speed, r.time)),
        "--acceleration-unit mg",
        ["--acceleration-unit", "mg"],
    ),
    (
        "kn beside places",
        lambda r: r.assign(lat=47.0 + r.position / 111_194.9, lon=8.0, speed=r.speed / 0.514444).drop(
            columns="position"
        ),
        "--speed-unit kn",
        ["--speed-unit", "kn"],
    ),
]


@pytest.mark.parametrize(("spoil", "said", "cure"), [case[1:] for case in ODD], ids=[case[0] for case in ODD])
def test_what_is_odd_is_said_with_the_option_that_cures_it(
    importing: Import, tmp_path: Path, spoil: Callable[[pd.DataFrame], pd.DataFrame], said: str, cure: list[str]
) -> None:
    log = text(spoil(ride().assign(lon=8.0)))
    assert importing(log) == 1
    (odd,) = [line for line in importing.errors if "odd: " in line and said in line]
    assert importing.summary["odd"] == [odd.removeprefix("import_csv: odd: ")]
    for option in cure[::2]:
        assert option in odd
    importing.output = tmp_path / "cured"
    assert importing(log, *cure) == 0, importing.errors


@pytest.mark.parametrize(("unit", "factor"), [("mps", 1.0), ("kmh", 3.6)])
def test_a_speed_that_falls_at_once_is_not_cured_by_the_unit_that_it_is_read_in(
    importing: Import, unit: str, factor: float
) -> None:
    """-1 for no value, in a log of km/h that is read as one."""
    rows = ride().drop(columns="position")
    gaps = (rows.time > 30.0) & (rows.time < 33.0)
    importing(text(rows.assign(speed=(factor * rows.speed).mask(gaps, -1.0))), "--speed-unit", unit)
    (odd,) = importing.summary["odd"]
    assert ("--speed-unit kmh" in odd) == (unit == "mps")
    assert "is it of a wheel that locked, or do numbers stand for no value? Leave those cells empty" in odd


def test_a_metro_in_km_h_is_told_by_its_brake(importing: Import) -> None:
    """72 km/h read as 72 m/s that fall by 1.8 m/s^2."""
    rows = ride().assign(speed=(72.0 - 1.8 * (ride().time - 20.0).clip(0.0)).clip(0.0)).drop(columns="position")
    assert importing(text(rows)) == 1
    assert importing.summary["odd"][0].endswith("Leave those cells empty")
    assert "km/h read as m/s, --speed-unit kmh? Or" in importing.summary["odd"][0]
    importing.output = importing.output.with_name("cured")
    assert importing(text(rows), "--speed-unit", "kmh") == 0


@pytest.mark.parametrize("drop", [[], ["speed"]], ids=str)
def test_radians_are_told(importing: Import, drop: list[str]) -> None:
    rows = ride().assign(lat=np.radians(47.0 + ride().position / 111_181.0), lon=np.radians(8.0))
    assert importing(text(rows.drop(columns=["position", *drop]))) == 1
    assert importing.summary["odd"] == ["lat and lon are 0.8208 and 0.1396 at most: are they radians? Write degrees"]


def test_small_wheels_are_not_odd(importing: Import) -> None:
    assert importing(text(ride().assign(wheel_speed_1=ride().speed / 0.31))) == 0, importing.errors


def test_a_column_without_any_value_is_said(importing: Import) -> None:
    assert importing(text(ride().assign(brake_pressure="", position=np.nan))) == 1
    assert importing.errors == [
        "import_csv: odd: no row has a position: name another column with --position COL",
        "import_csv: odd: no row has a brake_pressure: name another column with --pressure COL",
    ]


def test_what_is_not_read_is_said_and_that_a_pressure_is_missing(
    importing: Import, capsys: pytest.CaptureFixture[str]
) -> None:
    assert importing(text(ride().rename(columns={"brake_pressure": "BCP"}).assign(note="dry"))) == 0
    lines = read_as(importing, capsys)
    assert "not read: BCP, note" in lines
    assert "no brake pressure: without one mu is not told; --pressure COL, --demand COL or --pipe COL names it" in lines


def test_the_step_of_the_rows_is_the_usual_one(importing: Import, capsys: pytest.CaptureFixture[str]) -> None:
    importing(text(pd.concat([ride(), ride().assign(time=ride().time + 86_400.0, position=ride().position + 5e3)])))
    (line,) = [line for line in read_as(importing, capsys) if line.startswith("time  ")]
    assert line.endswith("a row every 0.1 s")


def test_a_last_row_of_totals_is_told(importing: Import) -> None:
    rows = ride()
    importing(text(pd.concat([rows, rows.sum().to_frame().T.assign(speed=40.0, brake_pressure=2e5)])))
    (odd,) = importing.summary["odd"]
    assert odd.startswith("the last row is 1.791e+04 s later than the one before: are its numbers totals? Leave it out")
