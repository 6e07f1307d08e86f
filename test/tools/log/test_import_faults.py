# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A message for every kind of fault of a log, nothing silently dropped, and nothing left of what gives no recording."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from test_import_csv import GOOD, Import, importing

from adhesion_node.tools import import_csv

__all__ = ["importing"]


FAULTS = [
    ("x,1,1,0,0", "not_a_number", "FILE:3: time = 'x': write a finite number with a decimal point, without its unit"),
    ("2,1 m,1,0,0", "not_a_number", "FILE:3: position = '1 m': write a finite number"),
    ("2,nan1,1,0,0", "not_a_number", "FILE:3: position = 'nan1': write a finite number"),
    ("2,1_0,1,0,0", "not_a_number", "FILE:3: position = '1_0': write a finite number"),
    ("2,1,inf,0,0", "not_a_number", "FILE:3: variance = 'inf': write a finite number"),
    ("2,1,1,x,0", "not_a_number", "FILE:3: brake_pressure = 'x': write a finite number"),
    ("2,1,1,0,-+", "not_a_number", "FILE:3: speed = '-+': write a finite number"),
    (",1,1,0,0", "empty", "FILE:3: time = '': every row needs a time and something measured"),
    ("2,,1,,", "empty", "FILE:3: row = '2,,1,,': every row needs a time and something measured"),
    ("1,1,1,0,0", "time_not_rising", "FILE:3: time = 1 s: time must rise, the last good row has 1 s: drop repeated"),
    ("0.5,1,1,0,0", "time_not_rising", "FILE:3: time = 0.5 s: time must rise"),
    (
        "-1,1,1,0,0",
        "out_of_range",
        "FILE:3: time = '-1': it is below 0: add the same to all, so that none is",
    ),
    ("1700000000000,1,1,0,0", "out_of_range", "FILE:3: time = '1700000000000': a stamp lies between 1970"),
    ("2,1e300,1,0,0", "out_of_range", "FILE:3: position = '1e300': 1e+300 is not from -1e+07 to 1e+07 m"),
    ("2,1e999999999,1,0,0", "not_a_number", "FILE:3: position = '1e999999999': write a finite number"),
    (
        "2,1e8,1,0,0",
        "out_of_range",
        "FILE:3: position = '1e8': 1e+08 is not from -1e+07 to 1e+07 m: is the --position-un",
    ),
    (
        "2,1,0,0,0",
        "out_of_range",
        "FILE:3: variance = '0': 0 is not from 1e-12 to 1e+08 m^2: leave it empty where unkn",
    ),
    ("2,1,-1,0,0", "out_of_range", "FILE:3: variance = '-1': -1 is not from"),
    (
        "2,1,1,-90000,0",
        "out_of_range",
        "FILE:3: brake_pressure = '-90000': 11325 is not from 45000 to 5e+06 Pa absolute: ",
    ),
    ("2,1,1,1e7,0", "out_of_range", "FILE:3: brake_pressure = '1e7': "),
    (
        "2,1,1,0,300",
        "out_of_range",
        "FILE:3: speed = '300': 300 is not from -200 to 200 m/s: is the --speed-unit another?",
    ),
    ("2,1,1,0", "cell_count", "FILE:3: row = '2,1,1,0': 4 cells under 5 columns: is the row cut off?"),
    ("2,1,5,1,0,0", "cell_count", "FILE:3: row = '2,1,5,1,0,0': 6 cells under 5 columns: quote a cell that holds ','"),
    ('2,"1,1,0,0', "broken_quotes", "FILE:3: row = '2,\"1,1,0,0': close the quotes of this row"),
    ("2,\xff,1,0,0", "not_a_number", "FILE:3: position = "),
]


@pytest.mark.parametrize(("row", "reason", "message"), FAULTS)
def test_every_kind_of_fault_is_named_and_counted(importing: Import, row: str, reason: str, message: str) -> None:
    text = f"time,position,variance,brake_pressure,speed\n1,1,1,0,0\n{row}\n3,1,1,0,0\n"
    assert importing(text.encode("latin-1")) == 1
    assert len(importing.errors) == 1
    assert importing.errors[0].startswith(f"import_csv: {message}")
    assert importing.summary["refused"] == {reason: 1}
    assert (importing.summary["rows"], importing.summary["written"]) == (3, 2)
    assert [t_ns for t_ns, _, _ in importing.positions()] == [10**9, 3 * 10**9]


@pytest.mark.parametrize(("times", "line", "behind"), [((1, 2, 999, 3, 4, 5), 4, 3), ((999, 1, 2, 3, 4, 5), 2, 1)])
def test_one_stamp_that_is_too_high_costs_its_row_alone(
    importing: Import, times: tuple[int, ...], line: int, behind: int
) -> None:
    assert importing("time,position\n" + "".join(f"{time},{time}\n" for time in times)) == 1
    assert importing.errors == [
        f"import_csv: FILE:{line}: time = 999 s: time must rise, the row behind it has {behind} s: "
        "its stamp is too high"
    ]
    assert [t_ns // 10**9 for t_ns, _, _ in importing.positions()] == [1, 2, 3, 4, 5]


@pytest.mark.parametrize(
    ("shift", "cure"),
    [(0, "rows are there twice: drop them"), (1, "rows share a time: log it with the fraction of the second")],
)
def test_rows_that_are_there_twice_are_told_apart_from_coarse_times(importing: Import, shift: int, cure: str) -> None:
    rows = "".join(f"{second},{10 * second + part * shift}\n" for second in range(20) for part in range(2))
    assert importing(f"time,position\n{rows}") == 1
    assert importing.errors[0].endswith(f"the last good row has 0 s: {cure}")


def test_a_wrong_iso_time_is_named(importing: Import) -> None:
    text = "time,position\n2024-01-01T00:00:00Z,1\nyesterday,1\n2024-02-30T00:00:00Z,1\n"
    assert importing(text, "--time-unit", "iso") == 1
    assert importing.errors[0].startswith(
        "import_csv: FILE:3: time = 'yesterday': it is not written in a way that is known: say how with"
    )
    assert importing.summary["refused"] == {"not_a_time": 2}


def test_all_faults_together_are_told_five_of_a_kind_then_counted(importing: Import) -> None:
    rows = [row.encode("latin-1") for row, _, _ in FAULTS]
    assert importing(b"time,position,variance,brake_pressure,speed\n1,1,1,0,0\n" + b"\n".join(rows)) == 1
    counts = importing.summary["refused"]
    assert counts["not_a_number"] > 5
    assert [line for line in importing.errors if " more: " in line] == [
        f"import_csv: {count - 5} more: {reason}" for reason, count in counts.items() if count > 5
    ]
    assert len([line for line in importing.errors if "write a finite number" in line]) == 5
    assert sum(importing.summary["refused"].values()) == len(FAULTS)
    assert importing.summary["rows"] == len(FAULTS) + 1


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("", [], "FILE: has no header line: begin with the names of the columns"),
        ("\n1,2\n", [], "FILE: has no header line"),
        ('time,"position\n1,2\n', [], "FILE:1: quotes are not closed in this line: close them, or take the line"),
        ("t,position\n1,2\n", [], "FILE: column 'time' is missing: it has ['t', 'position']; name one with --time COL"),
        (
            "time,position\n1,2\n",
            ["--speed", "v"],
            "FILE: column 'v' is missing: it has ['time', 'position']; name one",
        ),
        ("time,position\n1,2\n", ["--pressure", "p"], "FILE: column 'p' is missing: it has ['time', 'position']; name"),
        ("time,position,time\n1,2,1\n", [], "FILE: column 'time' is there 2 times: rename one"),
        ("time,bus,bus,position\n1,a,b,2\n", ["--where", "bus=a"], "FILE: column 'bus' is there 2 times: rename one"),
        *(
            (
                f"time,signal,value,{name},unit\n1,v,2,v,m/s\n",
                ["--speed", "v"],
                f"FILE: column '{name}' is there 2 times",
            )
            for name in ("signal", "value", "unit")
        ),
        ("time,position\n", [], "FILE: no good row in 0: nothing was written"),
        ("time,position\n1,2\n", ["--delimiter", ";;"], "delimiter = ';;': give one character"),
        *(
            ("time,position\n1,2\n", ["--position-std", std], f"position-std = {told}: give a standard deviation from")
            for std, told in (("0", "0.0"), ("nan", "nan"), ("1e200", "1e+200"), ("1e-200", "1e-200"))
        ),
    ],
)
def test_what_gives_no_recording_leaves_nothing(importing: Import, text: str, options: list[str], message: str) -> None:
    assert importing(text, *options) == 2
    assert importing.errors[-1].startswith(f"import_csv: {message}")
    assert not importing.output.exists()
    assert importing.summary == {}


def test_no_good_row_tells_every_row_and_leaves_nothing(importing: Import) -> None:
    assert importing("time,position\na,1\nb,1\n") == 2
    assert [line.split(":")[2] for line in importing.errors[:2]] == ["2", "3"]
    assert importing.errors[-1].startswith("import_csv: FILE: no good row in 2: nothing was written; read as utf-8, ")
    assert not importing.output.exists()


def test_a_missing_log_and_an_existing_output(importing: Import, tmp_path: Path, capsys: Any) -> None:
    assert import_csv.main([str(tmp_path / "none.csv"), "--output", str(tmp_path / "bag")]) == 2
    assert "none.csv: is no file: name a CSV log" in capsys.readouterr().err
    importing.output.mkdir()
    (importing.output / "precious").touch()
    assert importing(GOOD) == 2
    assert "it exists already" in importing.errors[-1]
    assert (importing.output / "precious").exists()
