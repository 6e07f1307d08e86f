# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Units that a log itself names, in its header or in a line below: they count, and what does not fit is said."""

from __future__ import annotations

import pandas as pd
import pytest
from test_import_csv import Import, importing
from test_import_log import ride, text

from adhesion_node.core.physics.train import KMH
from adhesion_node.tools import import_csv
from adhesion_node.wire.topics import BRAKE_PRESSURE, SPEED, WHEEL_SPEED

__all__ = ["importing"]

PER_SI = {"time": 1e3, "position": 1 / 0.3048, "speed": 3.6, "brake_pressure": 1e-5}
"""What a log in ms, ft, km/h and bar is to one in SI."""

OURS = "time,position,speed,brake_pressure\n"

TOLD: list[tuple[str, str]] = [
    ("brackets", "time [ms],position [ft],speed [km/h],brake_pressure [bar]\n"),
    ("parentheses", "Time (ms),Position (feet),Speed (kph),Brake Pressure (barg)\n"),
    ("suffixes", "time_ms,position_ft,speed_kmh,brake_pressure_Bar\n"),
    ("strokes", "time/ms,position / ft,speed/(km/h),brake_pressure/bar\n"),
    ("words", "time in ms,position in ft,speed in km/h,brake_pressure in bar\n"),
    ("commas", '"time, ms","position, ft","speed, km/h","brake_pressure, bar"\n'),
    ("Cyrillic letters", "time (мс),position (ft),speed (км/ч),brake_pressure (бар)\n"),
    ("blanks", "time ms,position ft,Speed KMH,brake_pressure bar\n"),
    ("full stops", "time.ms,position.ft,speed.km/h,brake_pressure.bar\n"),
    ("wide brackets", "time（ms）,position【ft】,speed（km/h）,brake_pressure［bar］\n"),
    ("a line below", OURS + "ms,ft,km/h,bar\n"),
    ("brackets below a preamble", "Recorder X,,,\n" + OURS + "[ms],[ft],[km h⁻¹],[bar]\n"),
]


def in_other_units() -> str:
    return text(ride().assign(**{name: factor * ride()[name] for name, factor in PER_SI.items()}).round(9))


@pytest.mark.parametrize("head", [case[1] for case in TOLD], ids=[case[0] for case in TOLD])
def test_units_that_the_log_names_count_and_are_said(
    importing: Import, capsys: pytest.CaptureFixture[str], head: str
) -> None:
    assert importing(in_other_units().replace(OURS, head)) == 0, importing.errors
    assert [sample.t_ns for sample in importing.positions()][:3] == [0, 10**8, 2 * 10**8]
    assert [sample.position_m for sample in importing.positions()] == pytest.approx(ride().position.tolist())
    speeds = [SPEED.read(message).speed_mps for message in importing.messages("speed")]
    assert speeds == pytest.approx(ride().speed.tolist())
    assert BRAKE_PRESSURE.read(importing.messages("brake_pressure")[-1]).pressure_pa == pytest.approx(3e5)
    import_csv.main([str(importing.log), "--dry-run"])
    said = "units that the log names: time in ms, position in ft, brake_pressure in bar, speed in kmh; otherwise: "
    assert said + "--time-unit, --position-unit, --pressure-unit, --speed-unit" in capsys.readouterr().out


@pytest.mark.parametrize(("unit", "metres"), [("cm", 0.01), ("mm", 0.001), ("mi", 1609.344), ("ft", 0.3048)])
def test_units_of_places_are_read_and_told(importing: Import, unit: str, metres: float) -> None:
    rows = ride().assign(position=ride().position / metres)
    assert importing(text(rows.rename(columns={"position": f"position [{unit}]"}))) == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == pytest.approx(ride().position.tolist())
    importing.output = importing.output.with_name("without")
    importing(text(rows))
    assert any(f"--position-unit {unit}" in odd for odd in importing.summary["odd"])


def test_an_option_takes_a_unit_as_headers_have_it(importing: Import) -> None:
    assert (
        importing("time,speed,brake_pressure\n1,36,0\n2,36,0\n", "--speed-unit", "km/h", "--pressure-unit", "Bar") == 0
    )
    assert SPEED.read(importing.messages("speed")[0]).speed_mps == pytest.approx(10.0)


def test_a_column_is_named_with_its_unit_or_without(importing: Import) -> None:
    assert importing("t;v km/h\n1;36\n2;36\n", "--time", "t", "--speed", "v km/h") == 0
    assert SPEED.read(importing.messages("speed")[0]).speed_mps == 10.0
    for name in ("v [km/h]", "v", "V"):
        importing.output = importing.output.with_name(f"of {name[-1]}")
        assert importing("t;v [km/h]\n1;36\n2;36\n", "--time", "t", "--speed", name) == 0
        assert SPEED.read(importing.messages("speed")[0]).speed_mps == 10.0


def test_a_column_may_be_named_by_its_unit_alone(importing: Import) -> None:
    """It was read in m/s."""
    assert importing("s,km/h\n1,36\n2,36\n", "--time", "s", "--speed", "km/h") == 0
    assert SPEED.read(importing.messages("speed")[0]).speed_mps == 10.0


def test_an_option_counts_more_than_the_log_and_that_is_said(importing: Import) -> None:
    assert importing("time,speed [km/h]\n1,36\n2,36\n", "--speed-unit", "mps") == 1
    assert SPEED.read(importing.messages("speed")[0]).speed_mps == 36.0
    assert importing.summary["odd"] == ["speed is said to be in 'km/h', and by --speed-unit in mps: which is right?"]
    importing.output = importing.output.with_name("same")
    assert importing("time,speed [km/h]\n1,36\n2,36\n", "--speed-unit", "kmh") == 0


@pytest.mark.parametrize(
    ("name", "cell", "cure", "said"),
    [
        (
            "speed [furlongs]",
            "9",
            ["--speed-unit", "mps"],
            "speed is said to be in 'furlongs', an unknown unit, and read in mps: ",
        ),
        ("brake_pressure (V)", "5", ["--pressure-unit", "bar"], "say which with --pressure-unit pa, kpa, bar, mbar, "),
        ("height [ft]", "100", [], "height is said to be in 'ft', an unknown unit, and read in m: convert it"),
    ],
)
def test_an_unknown_unit_is_said_with_the_option(
    importing: Import, name: str, cell: str, cure: list[str], said: str
) -> None:
    log = f"time,position,{name}\n1,2,{cell}\n2,3,{cell}\n"
    assert importing(log) == 1
    assert any(said in odd for odd in importing.summary["odd"])
    importing.output = importing.output.with_name("cured")
    importing(log, *cure)
    assert not cure or not any("unknown unit" in odd for odd in importing.summary["odd"])


@pytest.mark.parametrize(
    ("unit", "pa", "is_absolute"),
    [
        *(("bara", 1e5, True), ("bar(a)", 1e5, True), ("bar abs.", 1e5, True), ("psia", 6894.757, True)),
        *(("barg", 1e5, False), ("bar(g)", 1e5, False), ("barü", 1e5, False), ("kPa gauge", 1e3, False)),
        *(("kgf/cm2", 98066.5, False), ("kp/cm²", 98066.5, False), ("N/mm²", 1e6, False), ("kN/m^2", 1e3, False)),
        *(("hPa", 1e2, False), ("MPa", 1e6, False), ("MPa abs", 1e6, True), ("psig", 6894.757, False)),
    ],
)
def test_units_of_pressures_are_read_with_what_they_are_above(
    importing: Import, unit: str, pa: float, is_absolute: bool
) -> None:
    rows = ride().assign(**{f"brake_pressure [{unit}]": (ride().brake_pressure + 101_325.0 * is_absolute) / pa})
    assert importing(text(rows.drop(columns="brake_pressure"))) == 0, importing.errors
    pressures = [BRAKE_PRESSURE.read(message).pressure_pa for message in importing.messages("brake_pressure")]
    assert pressures == pytest.approx(ride().brake_pressure.tolist(), abs=1.0)


@pytest.mark.parametrize(
    ("unit", "kind", "other", "released_pa"),
    [("barg", "gauge", "absolute", 1e5), ("bara", "absolute", "gauge", 1e5 + 101_325.0)],
)
def test_a_kind_of_pressures_that_is_said_twice_is_doubted(
    importing: Import, unit: str, kind: str, other: str, released_pa: float
) -> None:
    """What the option says counts."""
    log = text(ride().assign(brake_pressure=ride().brake_pressure / 1e5 + 1.0))
    log = log.replace("brake_pressure", f"p_{unit}")
    assert importing(log, "--pressure", "p", "--pressure-kind", other) == 1
    said = f"brake_pressure is said to be in {unit!r}, {kind}, and by --pressure-kind {other}: which is right?"
    assert said in importing.summary["odd"]
    pressures = [message.fluid_pressure for message in importing.messages("brake_pressure")]
    assert min(pressures) == pytest.approx(released_pa, abs=1.0)


def test_dates_are_in_no_unit(importing: Import) -> None:
    assert importing("time [UTC],speed [m/s]\n2024-11-21 08:15:03,1\n2024-11-21 08:15:04,1\n") == 0


def test_a_header_that_is_there_twice_names_no_units(importing: Import) -> None:
    assert importing("time,speed\ntime,speed\n1,20\n2,20\n") == 0


def test_two_columns_of_one_name_are_not_guessed(importing: Import) -> None:
    assert importing("time,speed [km/h],speed [mph]\n1,36,20\n") == 2
    assert "column 'speed' may be ['speed [km/h]', 'speed [mph]']: name one with --speed COL" in importing.errors[0]
    assert importing("time,speed [km/h],speed [mph]\n1,36,20\n", "--speed", "speed [km/h]") == 0


def test_the_axles_and_a_deviation_are_in_the_unit_of_their_like(importing: Import) -> None:
    names = "time,speed [km/h],speed_std,wheel_speed_1 [1/min],wheel_speed_2"
    assert importing(f"{names}\n1,36,3.6,300,150\n2,36,3.6,300,150\n") == 0, importing.errors
    assert SPEED.read(importing.messages("speed")[0])[1:] == pytest.approx((10.0, 1.0))
    wheels = WHEEL_SPEED.read(importing.messages("wheel_speed")[0])
    assert wheels.speeds_radps == pytest.approx((31.4159265, 15.7079633))
    importing.output = importing.output.with_name("other")
    assert importing("time,speed,wheel_speed_1 [km/h],wheel_speed_2 [rpm]\n1,10,36,300\n2,10,36,300\n") == 1
    assert "wheel_speed is said to be in 'km/h and rpm', an unknown unit" in importing.summary["odd"][0]


def test_parquet_names_units_as_well(importing: Import) -> None:
    pytest.importorskip("pyarrow")
    log = importing.log.with_name("log.parquet")
    pd.DataFrame({"time [s]": [1.0, 2.0], "speed [km/h]": [36.0, 36.0]}).to_parquet(log)
    assert import_csv.main([str(log), "--output", str(importing.output)]) == 0
    assert SPEED.read(importing.messages("speed")[0]).speed_mps == 10.0


@pytest.mark.parametrize("header", ["speed [kn]", "speed (kts)", "speed_kn"])
def test_knots_are_read(importing: Import, header: str) -> None:
    rows = ride()
    assert importing(text(rows.assign(speed=rows.speed * 3600.0 / 1852.0).rename(columns={"speed": header}))) == 0
    assert importing.messages("speed")[0].twist.twist.linear.x == pytest.approx(rows.speed.iloc[0])


IN_CELLS: list[tuple[str, str, float]] = [
    ("speed", "{:.3f} m/s", 1.0),
    ("speed", "{:.3f}km/h", 1.0 / KMH),
    ("brake_pressure", "{:.2f} bar", 1e-5),
    ("brake_pressure", "{:.2f} bar(g)", 1e-5),
    ("position", "{:.6f} km", 1e-3),
    ("time", "{:.1f} s", 1.0),
]


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize(("column", "written", "scale"), IN_CELLS)
def test_a_unit_behind_every_number_of_a_column_is_read(
    importing: Import, column: str, written: str, scale: float, decimal: str
) -> None:
    rows = ride().astype(str)
    rows[column] = [written.format(scale * each) for each in ride()[column]]
    for name in rows:
        rows[name] = rows[name].str.replace(".", decimal, regex=False)
    assert importing(text(rows, ";")) == 0, importing.errors
    assert [sample.position_m for sample in importing.positions()] == ride().position.tolist()
    pressures = [BRAKE_PRESSURE.read(each).pressure_pa for each in importing.messages("brake_pressure")]
    assert pressures == pytest.approx(ride().brake_pressure)
    speeds = [SPEED.read(each).speed_mps for each in importing.messages("speed")]
    assert speeds == pytest.approx(ride().speed, abs=1e-3)


def test_cells_of_several_units_or_another_than_the_header_says_are_refused(importing: Import) -> None:
    cells = [f"{each / KMH:.3f} km/h" for each in ride().speed]
    rows = ride().assign(speed=[*cells[:-1], "30 m/s"])
    assert importing(text(rows)) == 2
    assert "'180.000 km/h': write a finite number with a decimal point, without its unit" in importing.errors[0]
    assert importing(text(ride().assign(speed=cells).rename(columns={"speed": "speed [m/s]"}))) == 2


def test_cells_of_another_unit_than_the_option_says_are_odd(importing: Import) -> None:
    rows = ride().assign(speed=[f"{each / KMH:.3f} km/h" for each in ride().speed])
    assert importing(text(rows), "--speed-unit", "mph") == 1
    assert importing.summary["odd"][0].startswith("speed is said to be in 'km/h', and by --speed-unit in mph")
