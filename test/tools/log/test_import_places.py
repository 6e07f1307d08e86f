# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Places in parts, as kilometres and metres or degrees, minutes and seconds, are read as they are meant."""

from __future__ import annotations

import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import read_as, ride, text

__all__ = ["importing"]


@pytest.mark.parametrize("header", ["position", "position [km]"])
@pytest.mark.parametrize(
    "form", ["{km}+{m:07.3f}", "km {all:.6f}", "km {km}+{m:07.3f}", "DK{km} + {m:07.3f}", "{hm:.1f}+{rest:06.3f}"]
)
def test_chainage_as_kilometres_and_metres(
    importing: Import, capsys: pytest.CaptureFixture[str], form: str, header: str
) -> None:
    rows = ride()
    at_m = rows.position + 12_000.0
    cells = [form.format(km=int(x // 1e3), m=x % 1e3, hm=(x // 100) / 10, all=x / 1e3, rest=x % 100) for x in at_m]
    assert importing(text(rows.assign(position=cells).rename(columns={"position": header}))) == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == pytest.approx(at_m.tolist(), abs=1e-6)
    assert any(f"position: {cells[0]!r} is read as 13" in line for line in read_as(importing, capsys))


def test_chainage_with_a_decimal_comma_and_below_0(importing: Import) -> None:
    assert importing("time;position;speed\n1;-0+001,5;2,5\n2;0+001,0;2,5\n") == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == [-1.5, 1.0]


@pytest.mark.parametrize(("cell", "options"), [("12+34.5", []), ("12+345", ["--position-unit", "ft"])])
def test_stations_are_refused(importing: Import, cell: str, options: list[str]) -> None:
    assert importing(f"time,position\n1,{cell}\n2,{cell}\n", *options) == 2
    assert f"position = '{cell}': write a finite number" in importing.errors[0]
    assert importing.errors[0].endswith("; or km and m as 12+345.6")


@pytest.mark.parametrize(
    "form",
    [
        *(
            "{d}°{m:02d}'{s:08.5f}\"{h}",
            "{d} {m:02d} {s:08.5f} {h}",
            "{h}{d}°{m:02d}′{s:08.5f}″",
            "{sign}{d}:{m}:{s:.5f}",
        ),
        *("{d:0{w}}{mm:010.7f},{h}", "{d:0{w}}{mm:010.7f}{h}", "{d}° {mm:.7f}' {h}", "{dd:.9f}° {h}", "{h} {dd:.9f}"),
    ],
)
@pytest.mark.parametrize("decimal", [".", ","])
def test_degrees_in_parts(importing: Import, form: str, decimal: str) -> None:
    def cell(x: float, letters: str, width: int) -> str:
        dd, minus = abs(x), x < 0.0
        d, mm = int(dd), dd % 1.0 * 60.0
        of = {"d": d, "w": width, "mm": mm, "m": int(mm), "s": mm % 1.0 * 60.0, "dd": dd, "h": letters[minus]}
        return form.format(**of, sign="-" if minus else "").replace(".", decimal)

    rows = ride().drop(columns="position")
    lat, lon = 51.0 + ride().position / 111_181.0, ride().position / 111_181.0 * 0.01 - 1.0
    places = {"lat": [cell(x, "NS", 2) for x in lat], "lon": [cell(x, "EW", 3) for x in lon]}
    log = text(pd.DataFrame({"time": rows.time, **places, "speed": rows.speed}), ";", decimal)
    assert importing(log) == 0, importing.errors
    fixes = importing.messages("fix")
    assert [fix.latitude for fix in fixes] == pytest.approx(lat.tolist(), abs=1e-8)
    assert [fix.longitude for fix in fixes] == pytest.approx(lon.tolist(), abs=1e-8)


@pytest.mark.parametrize("form", ["{d:0{w}}{mm:010.7f}", "{dd:.9f}"])
def test_a_letter_in_the_next_column_counts(importing: Import, form: str) -> None:
    cells = [form.format(d=d, w=w, mm=30.0, dd=d + 0.5) for d, w in ((33, 2), (7, 3))]
    log = f"time,lat,ns,lon,ew,speed\n1,{cells[0]},S,{cells[1]},W,2\n2,,S,,,2\n3,{cells[0]},S,{cells[1]},E,2\n"
    assert importing(log) == 0, importing.errors
    assert [(fix.latitude, fix.longitude) for fix in importing.messages("fix")] == [(-33.5, -7.5), (-33.5, 7.5)]
    importing.output = importing.output.with_name("other")
    assert importing("time,lat,next,lon\n1,33.5,N,7.5\n2,33.5,X,7.5\n") == 0
    assert importing.messages("fix")[0].latitude == 33.5


@pytest.mark.parametrize("cell", ["51°28'N", "51°61'E", "-1°30'W", "129.18,E", "1°28'75\"E", "1°30'O", "E1°30'E"])
def test_what_is_no_longitude_is_refused(importing: Import, cell: str) -> None:
    assert importing(f"time;lat;lon\n1;51.5;{cell}\n2;51.5;{cell}\n") == 2
    assert "lon = " in importing.errors[0]
    assert importing.errors[0].endswith("; or degrees as 0°07'30.5\"W, or 00007.508,W")
