# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Logs as recorders write them: each is read as it is meant, or said to be odd with the option that cures it."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from test_import_csv import Import, importing

from adhesion_node.tools import import_csv
from adhesion_node.tools.log.text import SAMPLE
from adhesion_node.wire.topics import BRAKE_DEMAND, SPEED

__all__ = ["importing"]

S, AIR_PA = 10**9, 101_325.0


def ride(seconds: int = 60) -> pd.DataFrame:
    """A train at 180 km/h that brakes with 0.8 m/s^2 from 20 s on; ten rows a second, in SI."""
    t_s = np.arange(10 * seconds) / 10.0
    braked_s = (t_s - 20.0).clip(0.0)
    speed = 50.0 - 0.8 * braked_s
    place = 50.0 * t_s - 0.4 * braked_s**2 + 1000.0
    braking = t_s >= 20.0
    columns = {"time": t_s, "position": place, "speed": speed, "brake_pressure": 3e5 * braking}
    return pd.DataFrame(columns).round(3)


def text(rows: pd.DataFrame, delimiter: str = ",", decimal: str = ".", head: str = "") -> str:
    return head + str(rows.to_csv(index=False, sep=delimiter, decimal=decimal))


def read_as(importing: Import, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """What a dry run of the newest log says."""
    import_csv.main([str(importing.log), "--dry-run"])
    return capsys.readouterr().out.splitlines()


WRITTEN: list[tuple[str, Callable[[pd.DataFrame], str | bytes], str]] = [
    ("semicolons", lambda rows: text(rows, ";"), "delimiter ';'"),
    ("tabs", lambda rows: text(rows, "\t"), "delimiter '\\t'"),
    ("bars", lambda rows: text(rows, "|"), "delimiter '|'"),
    ("decimal comma", lambda rows: text(rows, ";", ","), "delimiter ';', decimal ','"),
    ("quoted comma", lambda rows: rows.to_csv(index=False, decimal=",", quoting=csv.QUOTE_ALL), "decimal ','"),
    (
        "blanks before quotes",
        lambda rows: rows.to_csv(index=False, quoting=csv.QUOTE_ALL).replace(',"', ', "'),
        "delimiter ','",
    ),
    ("latin-1", lambda rows: text(rows, head="Zug: Tür geöffnet\n").encode("latin-1"), "cp1252"),
    ("utf-16", lambda rows: text(rows, ";").encode("utf-16"), "utf-16"),
    ("a mark", lambda rows: text(rows).encode("utf-8-sig"), "utf-8-sig"),
    ("a preamble", lambda rows: text(rows, head="sep=,\nTrain 4711, car 3\n\ntime,2024-11-21\n"), "header in line 5"),
    ("units", lambda rows: text(rows).replace("\n", "\ns,m,m/s,Pa\n", 1), "line 2 left out as units"),
    (
        "units with digits",
        lambda rows: text(rows).replace("\n", "\ns,m,m/s^1,Pa\n", 1),
        "line 2 left out as units",
    ),
    ("utf-16 without a mark", lambda rows: text(rows, ";").encode("utf-16-le"), "utf-16-le"),
    ("delimiters at the ends", lambda rows: text(rows).replace("\n", ",\n").replace(",\n", "\n", 1), "delimiter ','"),
]


@pytest.mark.parametrize(("write", "said"), [case[1:] for case in WRITTEN], ids=[case[0] for case in WRITTEN])
def test_however_it_is_written_a_log_is_read_and_how_is_said(
    importing: Import, capsys: pytest.CaptureFixture[str], write: Callable[[pd.DataFrame], str | bytes], said: str
) -> None:
    rows = ride()
    assert importing(write(rows)) == 0, importing.errors
    assert importing.summary["written"] == len(rows)
    assert [sample.position_m for sample in importing.positions()] == rows["position"].tolist()
    (line,) = [line for line in read_as(importing, capsys) if line.startswith("read as")]
    assert said in line
    assert all(option in line for option in ("--encoding", "--delimiter", "--decimal", "--skip-rows", "--time-format"))


def test_the_header_is_found_below_a_preamble_of_empty_cells_whatever_its_names(importing: Import) -> None:
    rows = ride().rename(columns={"time": "Laufzeit", "position": "Weg"})
    assert importing(text(rows, ";", head="Recorder X;;;;;;\nTrain 4711;;;;;;\n")) == 2
    assert "it has ['Laufzeit', 'Weg', 'speed', 'brake_pressure']" in importing.errors[0]


@pytest.mark.parametrize(
    ("written", "options", "first_ns"),
    [
        ("%H:%M:%S,%f", [], 29_703 * S),
        ("%d.%m.%Y %H:%M:%S", [], 1_732_176_903 * S),
        ("%d.%m.%Y %H:%M:%S,%f", ["--time-zone", "Europe/Berlin"], (1_732_176_903 - 3600) * S),
        ("%d.%m.%y %H:%M:%S.%f", [], 1_732_176_903 * S),
        ("%m/%d/%Y %H:%M:%S", [], 1_732_176_903 * S),
        ("%Y-%m-%dT%H:%M:%S.%fZ", ["--time-zone", "Europe/Berlin"], 1_732_176_903 * S),
        ("%Y-%m-%d %H:%M:%S", [], 1_732_176_903 * S),
        ("%m/%d/%Y %I:%M:%S %p", [], 1_732_176_903 * S),
        ("%m/%d/%Y %I:%M:%S.%f %p", [], 1_732_176_903 * S),
        ("%Hh%Mm%S %d-%b-%Y", ["--time-format", "%Hh%Mm%S %d-%b-%Y"], 1_732_176_903 * S),
    ],
)
def test_times_as_recorders_write_them(importing: Import, written: str, options: list[str], first_ns: int) -> None:
    moments = pd.Timestamp("2024-11-21 08:15:03") + pd.to_timedelta(range(30), unit="s")
    rows = ride()[: 10 * len(moments) : 10].assign(time=moments.strftime(written))
    assert importing(text(rows, ";"), *options) == 0, importing.errors
    assert [sample.t_ns for sample in importing.positions()] == [first_ns + i * S for i in range(30)]


@pytest.mark.parametrize(("unit", "per_s"), [("s", 1), ("ms", 10**3), ("us", 10**6), ("ns", 10**9)])
def test_times_since_1970_tell_their_unit(importing: Import, unit: str, per_s: int) -> None:
    begin = 1_732_176_903
    assert importing(f"time,speed\n{begin * per_s},1\n{(begin + 1) * per_s},1\n") == 0
    assert [SPEED.read(message).t_ns for message in importing.messages("speed")] == [begin * S, (begin + 1) * S]


def test_a_time_that_is_written_in_no_known_way_is_told_with_the_option(importing: Import) -> None:
    log = "time,speed\n8:15:03 o'clock,1\n8:15:04 o'clock,1\n"
    assert importing(log) == 2
    assert "say how with --time-format" in importing.errors[0]
    assert importing(log, "--time-format", "%H:%M:%S o'clock") == 0


def test_the_days_of_a_spreadsheet(importing: Import) -> None:
    rows = ride()
    log = text(rows.assign(time=45617.34378472 + rows.time / 86400.0))
    assert importing(log) == 1
    assert "are the times in days? --time-unit excel" in importing.errors[0]
    importing.output = importing.output.with_name("cured")
    assert importing(log, "--time-unit", "excel") == 0
    first, *_, last = (sample.t_ns for sample in importing.positions())
    assert first == pytest.approx(1_732_176_903 * S, abs=S / 100)
    assert last - first == pytest.approx(59.9 * S, abs=S / 100)


def test_a_clock_of_whole_seconds_is_told(importing: Import) -> None:
    rows = ride()
    assert importing(text(rows.assign(time=rows.time.astype(int)))) == 1
    assert importing.errors[0].endswith("rows share a time: log it with the fraction of the second")
    assert importing.summary["written"] == 60


def test_a_decimal_comma_that_is_the_delimiter_too_is_told(importing: Import) -> None:
    assert importing("time,speed\n1,5,20,5\n") == 2
    assert "or is it the decimal sign, too? Then export with ';'" in importing.errors[0]


@pytest.mark.parametrize(
    ("begins", "what"),
    [
        (b"PK\x03\x04\x14", "a zip file or a workbook"),
        (b"\x1f\x8b\x08", "compressed"),
        (b"\xd0\xcf\x11\xe0", "a workbook"),
    ],
)
def test_what_is_no_text_is_told(importing: Import, begins: bytes, what: str) -> None:
    assert importing(begins + text(ride()).encode()) == 2
    assert importing.errors == [f"import_csv: FILE: is {what}, no text: unpack it, or save it as CSV"]


@pytest.mark.parametrize("missing", ["NaN", "null", "n/a", "NA", "-"])
def test_what_stands_for_no_value_is_none(importing: Import, missing: str) -> None:
    """The rest of such a row is kept, as of a receiver that is slower than the rows."""
    assert importing(text(ride().astype({"position": object}).assign(position=[1000.0, *[missing] * 9] * 60))) == 1
    assert (importing.summary["written"], importing.summary["empty"]) == (600, {"position": 540})
    assert len(importing.messages("brake_pressure")) == 600


@pytest.mark.parametrize(
    ("factor", "told"),
    [
        (1e-5, "is 3 pa at most: is it in bar? --pressure-unit bar: 3 bar"),
        (1e-6, "is it in mpa? --pressure-unit mpa: 3 bar"),
        (1e-2, "is it in mbar? --pressure-unit mbar: 3 bar"),
        (
            1.0 / 6894.757,
            "is it in psi? --pressure-unit psi: 3 bar; per cent of a full brake are not read: give its pressure",
        ),
        (
            100.3 / 3e5,
            "is it in kpa or psi? --pressure-unit kpa: 1 bar; --pressure-unit psi: 6.9 bar; per cent of a full",
        ),
    ],
)
def test_pressures_in_another_unit_are_told(importing: Import, factor: float, told: str) -> None:
    rows = ride()
    assert importing(text(rows.assign(brake_pressure=(factor * rows.brake_pressure).round(6)))) == 1
    assert [said for said in importing.summary["odd"] if told in said]


def test_a_pressure_in_another_unit_than_the_option_says_is_told(importing: Import) -> None:
    rows = ride()
    assert importing(text(rows.assign(brake_pressure=rows.brake_pressure / 1e5)), "--pressure-unit", "kpa") == 1
    assert "brake_pressure is 3 kpa at most: is it in bar? --pressure-unit bar: 3 bar" in importing.summary["odd"]


@pytest.mark.parametrize("factor", [1.0, 1.0 / 9.80665, -1.0])
def test_an_accelerometer_that_tells_of_another_motion_is_told(importing: Import, factor: float) -> None:
    """0.8 m/s^2 under the brake, with a bias of 0.05 m/s^2."""
    rows = ride().assign(acceleration=lambda rows: factor * (-0.8 * (rows.time >= 20.0) - 0.05))
    importing(text(rows))
    told = [said for said in importing.summary["odd"] if said.startswith("the acceleration is")]
    cure = {1.0: None, -1.0: "change its sign"}.get(factor, "another unit? --acceleration-unit g")
    assert len(told) == (cure is not None)
    assert cure is None or cure in told[0]


@pytest.mark.parametrize(
    ("per_mps", "read_as", "unit"),
    [
        (1 / 0.46, "radps", None),
        (1 / 0.35, "radps", None),
        (1.0, "radps", "mps"),
        (8.0, "radps", ""),
        (0.2, "radps", ""),
        (1 / 0.46, "rpm", "radps"),
    ],
)
def test_wheels_that_turn_otherwise_than_the_train_runs_are_told(
    importing: Import, per_mps: float, read_as: str, unit: str | None
) -> None:
    """Of a wheel of 0.46 m, and of a smaller one; the last are of no unit. What slides tells nothing."""
    rows = ride().assign(wheel_speed_1=lambda rows: per_mps * rows.speed * np.where(rows.time > 30.0, 0.5, 1.0))
    importing(text(rows), "--wheel-radius", "0.46", "--wheel-unit", read_as)
    told = [said for said in importing.summary["odd"] if said.startswith("the wheels turn")]
    assert len(told) == (unit is not None)
    assert not unit or told[0].endswith(f"another unit? --wheel-unit {unit}")


def test_all_that_is_odd_is_told_at_once(importing: Import) -> None:
    rows = ride()
    wrong = rows.assign(brake_pressure=rows.brake_pressure / 1e5, position=(120_000.0 - rows.position) / 1e3)
    assert importing(text(wrong.assign(speed=3.6 * rows.speed))) == 1
    told = " ".join(importing.summary["odd"])
    assert all(cure in told for cure in ("--pressure-unit bar", "--direction down", "--position-unit km"))
    assert "--speed-unit kmh" in told


def test_the_clock_goes_on_after_midnight(importing: Import) -> None:
    assert importing("time,speed\n23:59:59.9,1\n00:00:00.0,1\n00:00:00.1,1\n") == 0
    times = [SPEED.read(message).t_ns for message in importing.messages("speed")]
    assert np.diff(times).tolist() == [S // 10, S // 10]


def test_the_end_of_summer_time_is_no_step_of_the_clock(importing: Import) -> None:
    """At 3 o'clock it is 2 o'clock again."""
    log = "time,speed\n27.10.2024 02:59:58,1\n27.10.2024 02:59:59,1\n27.10.2024 02:00:00,1\n27.10.2024 02:00:01,1\n"
    assert importing(log, "--time-zone", "Europe/Berlin") == 0
    assert np.diff([SPEED.read(message).t_ns for message in importing.messages("speed")]).tolist() == [S] * 3


@pytest.mark.parametrize("written", ["%H%M%S.%f", "%H%M%S"])
@pytest.mark.parametrize("begin", ["08:15:33", "12:59:30", "23:59:30"])
def test_digits_of_a_clock_are_no_seconds(importing: Import, begin: str, written: str) -> None:
    """As of NMEA: 081559 is followed by 081600."""
    moments = pd.Timestamp(f"2024-11-21 {begin}") + pd.to_timedelta(range(150), unit="s")
    rows = pd.DataFrame({"time": moments.strftime(written), "position": 40.0 * np.arange(150) + 1000.0})
    assert importing(text(rows)) == 0, importing.errors
    of_day_s = (pd.Timestamp(f"1970-01-01 {begin}") - pd.Timestamp(0)).total_seconds()
    assert [sample.t_ns / S for sample in importing.positions()] == [of_day_s + i for i in range(150)]
    importing.output = importing.output.with_name("seconds")
    importing(text(rows), "--time-unit", "s")
    told = "--time-format %H%M%S where the times are hhmmss, %H%M%S.%f with a fraction" in str(importing.errors)
    assert told == (begin == "12:59:30"), "a step of 40 s is none among rows of a second"
    importing.output = importing.output.with_name("format")
    assert importing(text(rows), "--time-format", written) == 0


@pytest.mark.parametrize(
    "times", [range(200), range(1000, 1060), [*range(1000, 1060), *range(1100, 1130)], range(81530, 81730)], ids=str
)
def test_seconds_are_no_digits_of_a_clock(importing: Import, times: list[int]) -> None:
    importing("time,speed\n" + "".join(f"{time},20\n" for time in times))
    expected = list(times)
    if expected[-1] == 1129:  # 16:59 is followed by 11:00
        expected = [*range(600, 690)]
    assert [SPEED.read(message).t_ns // S for message in importing.messages("speed")] == expected


def test_unsorted_rows_are_sorted_on_demand_and_the_option_is_named(importing: Import, tmp_path: Path) -> None:
    rows = ride()
    mixed = text(rows.sample(frac=1.0, random_state=1))
    assert importing(mixed) == 1
    assert importing.errors[0].endswith("drop repeated rows, or sort the log: --sort")
    assert len(importing.errors) < 12, "five lines and a count, not one for each of the rows"
    importing.output = tmp_path / "sorted"
    assert importing(mixed, "--sort") == 0
    assert [sample.position_m for sample in importing.positions()] == rows["position"].tolist()


def test_a_log_of_speed_and_pressure_alone_is_enough(importing: Import) -> None:
    assert importing(text(ride().drop(columns="position"))) == 0
    assert set(importing.summary["messages"]) == {"/speed", "/brake_pressure"}


def test_the_chainage_is_turned_and_that_is_said(importing: Import, capsys: pytest.CaptureFixture[str]) -> None:
    assert importing("time,position\n0,5000\n1,4990\n", "--direction", "down") == 0
    assert [sample.position_m for sample in importing.positions()] == [-5000.0, -4990.0]
    import_csv.main([str(importing.log), "--dry-run", "--direction", "down"])
    assert "positions are minus the chainage" in capsys.readouterr().out


def test_the_brake_pipe_becomes_the_demand(importing: Import, capsys: pytest.CaptureFixture[str]) -> None:
    """UIC 540: 5 bar are released, 1.5 bar less the full brake."""
    pipe = "time,speed,HL\n" + "".join(f"{i},20,{p}\n" for i, p in enumerate([5.0] * 20 + [4.25, 3.5, 0.0]))
    assert importing(pipe, "--pipe", "HL", "--pressure-unit", "bar") == 0
    demanded = [BRAKE_DEMAND.read(message).pressure_pa for message in importing.messages("brake_demand")]
    assert demanded[-4:] == pytest.approx([0.0, 205e3, 410e3, 410e3])
    import_csv.main([str(importing.log), "--dry-run", "--pipe", "HL", "--pressure-unit", "bar"])
    assert "brake pipe: released at 5 bar, --pipe-released; a full brake 1.5 bar below" in capsys.readouterr().out
    importing.output = importing.output.with_name("full")
    options = ["--pipe-released", "4.8", "--full-pressure", "300000"]
    assert importing(pipe, "--pipe", "HL", "--pressure-unit", "bar", *options) == 0
    demanded = [BRAKE_DEMAND.read(message).pressure_pa for message in importing.messages("brake_demand")]
    assert demanded[-3] == pytest.approx(300e3 * 0.55 / 1.5)


def test_a_dry_run_shows_rows_and_writes_nothing(importing: Import, capsys: pytest.CaptureFixture[str]) -> None:
    importing(text(ride(), ";", ","))
    options = ["--dry-run", "--output", str(importing.output.with_name("never"))]
    assert import_csv.main([str(importing.log), *options]) == 0
    out = capsys.readouterr().out
    assert re.search(r"^2 +0 +1000\.0 +101325\.0 +50\.0$", out, re.MULTILINE)
    assert re.search(r"^speed +65\.\d+ to 180 km/h$", out, re.MULTILINE)
    assert re.search(r"^brake_pressure +0 to 3 bar above the air$", out, re.MULTILINE)
    assert not importing.output.with_name("never").exists()
    assert import_csv.main([str(importing.log), *options, "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["written"] == 0
    assert import_csv.main([str(importing.log)]) == 2
    assert "name the recording with --output DIR, or look first with --dry-run" in capsys.readouterr().err


def test_guesses_give_way_to_options(importing: Import) -> None:
    log = "note\ntime;speed\n1,000;1,500\n2,000;2,500\n"
    options = ["--delimiter", ";", "--skip-rows", "1", "--decimal", ",", "--encoding", "ascii", "--time-unit", "s"]
    assert importing(log, *options) == 0
    assert [SPEED.read(message)[:2] for message in importing.messages("speed")] == [(S, 1.5), (2 * S, 2.5)]
    importing.output = importing.output.with_name("point")
    assert importing(log, "--decimal", ".") == 2, "then they are no numbers"
    assert "--decimal" in importing.errors[0]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--encoding", "klingon"], "encoding = 'klingon': there is none of this name"),
        (["--time-zone", "Berlin/Europe"], "time-zone = 'Berlin/Europe': there is none of this name"),
        (["--skip-rows", "-1"], "skip-rows = -1: give the number of lines above the header"),
        (["--full-pressure", "4.1"], "full-pressure = 4.1: give 100000 to 1000000 Pa, gauge"),
    ],
)
def test_options_that_cannot_be_are_refused(importing: Import, options: list[str], message: str) -> None:
    assert importing("time,speed\n1,2\n", *options) == 2
    assert importing.errors[-1].startswith(f"import_csv: {message}")


def test_a_guess_from_the_beginning_does_not_spoil_the_rest(importing: Import) -> None:
    """Whole numbers first, then commas: said with the option that helps, and cured by it."""
    log = "time;speed\n" + "".join(f"{i};20\n" for i in range(SAMPLE)) + f"{SAMPLE};20,5\n"
    assert importing(log) == 1
    assert "'20,5'" in importing.errors[0]
    assert "--decimal" in importing.errors[0]
    importing.output = importing.output.with_name("cured")
    assert importing(log, "--decimal", ",") == 0
