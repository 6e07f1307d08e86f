# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How logs are written, and the options that say so: each is read as it is meant, or the option is said."""

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


def read_as(importing: Import, capsys: pytest.CaptureFixture[str], *options: str) -> list[str]:
    """What a dry run of the newest log says."""
    import_csv.main([str(importing.log), "--dry-run", *options])
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
    ("utf-32", lambda rows: text(rows, ";").encode("utf-32"), "utf-32"),
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


def test_a_decimal_comma_that_is_the_delimiter_too_is_told(importing: Import) -> None:
    assert importing("time,speed\n1,5,20,5\n") == 2
    assert "or is it the decimal sign, too? Then export with ';'" in importing.errors[0]


@pytest.mark.parametrize("missing", ["NaN", "null", "n/a", "NA", "-"])
def test_what_stands_for_no_value_is_none(importing: Import, missing: str) -> None:
    """The rest of such a row is kept, as of a receiver that is slower than the rows."""
    assert importing(text(ride().astype({"position": object}).assign(position=[1000.0, *[missing] * 9] * 60))) == 1
    assert (importing.summary["written"], importing.summary["empty"]) == (600, {"position": 540})
    assert len(importing.messages("brake_pressure")) == 600


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


@pytest.mark.parametrize("drop", [["position"], ["speed"], ["position", "speed"]])
def test_a_pipe_is_released_as_the_train_runs_however_long_it_is_parked(importing: Import, drop: list[str]) -> None:
    """Empty in more than nine of ten rows: by all it were released at nothing, and no brake was demanded ever."""
    rows = ride(82)
    rows = rows.assign(pipe=5.0 - rows.brake_pressure / 2e5)
    parked = pd.DataFrame({"time": 82.0 + np.arange(6_000) / 10.0, "pipe": 0.0, "speed": 0.0})
    rows = pd.concat([rows, parked.assign(position=rows.position.iloc[-1])]).drop(columns="brake_pressure")
    rows = rows.assign(lat=47.0, lon=8.0 + rows.position / 75_800.0).drop(columns=drop)
    assert importing(text(rows), "--pipe", "pipe", "--pressure-unit", "bar") == 0, importing.errors
    demanded = [BRAKE_DEMAND.read(message).pressure_pa for message in importing.messages("brake_demand")]
    assert (demanded[100], demanded[500]) == pytest.approx((0.0, 410e3))


def test_a_pipe_without_a_value_demands_nothing_that_is_known(
    importing: Import, capsys: pytest.CaptureFixture[str]
) -> None:
    assert importing("time,position,pipe\n0,0,-\n1,30,\n2,60,-\n", "--pipe", "pipe") == 1
    assert import_csv.main([str(importing.log), "--dry-run", "--pipe", "pipe"]) == 1
    told = capsys.readouterr().out
    assert "brake pipe: no value while the train runs, so what is demanded is unknown: --pipe-released, or" in told
    assert "nan pa" not in told


@pytest.mark.parametrize("released", ["500000", "0", "-5", "nan", "inf"])
def test_a_pipe_is_released_at_a_pressure_that_pipes_have(importing: Import, released: str) -> None:
    log = "time,position,pipe\n0,0,5.0\n1,30,5.0\n2,60,3.5\n"
    options = "--pipe", "pipe", "--pressure-unit", "bar"
    assert importing(log, *options, "--pipe-released", released) == 2
    assert f"pipe-released = {released} bar: give what the pipe has" in importing.errors[0]
    assert "2 to 12 bar" in importing.errors[0]
    assert importing(log, *options, "--pipe-released", "5.0") == 0


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
        (["--encoding", "base64"], "encoding = 'base64': there is none of this name"),
        (["--encoding", "idna"], "encoding = 'idna': there is none of this name"),
        (["--encoding", "utf-16"], "FILE: encoding = utf-16: UTF-16 stream does not start with BOM: name another"),
        (["--time-format", "%"], "time-format = '%': "),
        (["--time-format", "%Q"], "time-format = '%Q': "),
    ],
)
def test_options_that_cannot_be_are_refused(importing: Import, options: list[str], message: str) -> None:
    assert importing("time,speed\n1,2\n", *options) == 2
    assert importing.errors[-1].startswith(f"import_csv: {message}")


@pytest.mark.parametrize(
    ("name", "value", "cure"),
    [
        ("--pipe-released", "5.0", "--pipe COL, or"),
        ("--full-pressure", "300000.0", "--pipe COL, or"),
        ("--pressure-kind", "absolute", "--pressure COL or"),
        ("--pressure-unit", "bar", "--pressure COL or"),
        ("--acceleration-unit", "g", "--acceleration COL, or"),
        ("--wheel-radius", "0.4", "--wheel-speeds COL, or"),
        ("--position-std", "2.0", "--position COL or --lat COL, or"),
        ("--direction", "down", "--position COL, or"),
    ],
)
def test_an_option_of_a_column_that_a_log_has_not_is_refused(
    importing: Import, name: str, value: str, cure: str
) -> None:
    """Its column is there under a name that is not read, and all would be taken without it."""
    assert importing("time,speed,HL\n1,2,5\n", name, value) == 2
    why = "the log has no column of which it tells: name one with"
    assert importing.errors[0].startswith(f"import_csv: {name} {value}: {why} {cure}")
    assert not importing.output.exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--time-zone", "Europe/Berlin"],
            "--time-zone Europe/Berlin: the times have no date, and no zone: leave it out",
        ),
        (["--time-unit", "s", "--time-format", "%S"], "--time-unit s: dates by --time-format have no unit: leave the"),
    ],
)
def test_an_option_of_other_times_is_refused(importing: Import, options: list[str], message: str) -> None:
    assert importing("time,speed\n1,2\n", *options) == 2
    assert importing.errors[0].startswith(f"import_csv: {message}")


def test_what_is_usual_and_what_the_train_tells_is_refused_for_no_log(importing: Import) -> None:
    usual = ["--pressure-kind", "gauge", "--direction", "up", "--time-zone", "UTC"]
    assert importing("time,speed\n1,2\n", *usual, "--train", "metro") == 0, importing.errors


def test_a_guess_from_the_beginning_does_not_spoil_the_rest(importing: Import) -> None:
    """Whole numbers first, then commas: said with the option that helps, and cured by it."""
    log = "time;speed\n" + "".join(f"{i};20\n" for i in range(SAMPLE)) + f"{SAMPLE};20,5\n"
    assert importing(log) == 1
    assert "'20,5'" in importing.errors[0]
    assert "--decimal" in importing.errors[0]
    importing.output = importing.output.with_name("cured")
    assert importing(log, "--decimal", ",") == 0


@pytest.mark.parametrize("mark", [" ", "|"])
def test_a_delimiter_that_nothing_guesses_is_named(importing: Import, mark: str) -> None:
    log = "time,position,speed\n0,0,30\n1,30,30\n".replace(",", mark)
    code = importing(log)
    assert code == 0 or f"is the --delimiter {mark!r}?" in importing.errors[0]
    importing.output = importing.output.with_name("told")
    assert importing(log, "--delimiter", mark) == 0
