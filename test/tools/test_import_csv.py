# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A person's own log: units, exact times, a message for every kind of fault, nothing silently dropped."""

from __future__ import annotations

import json
import re
import tracemalloc
from pathlib import Path
from typing import Any

import pytest

from adhesion_node.bag import BagReader
from adhesion_node.core.intake.samples import PositionSample
from adhesion_node.tools import import_csv
from adhesion_node.tools.log.format import Format
from adhesion_node.wire.topics import POSITION, SPEED

GOOD = """\
time,position,variance,brake_pressure,speed
0.1,10.5,0.25,0,80.0
0.2,18.5,0.36,410000,79.9
0.3,26.4,,,
"""


class Import:
    """Runs import_csv on a text; afterwards its exit code, its summary and what it said."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.log, self.output, self._capsys = folder / "log.csv", folder / "bag", capsys
        self.code = -1
        self.errors: list[str] = []
        self.summary: dict[str, Any] = {}

    def __call__(self, text: str | bytes, *options: str) -> int:
        self.log.write_bytes(text.encode() if isinstance(text, str) else text)
        self.code = import_csv.main([str(self.log), "--output", str(self.output), "--json", "-", *options])
        out, err = self._capsys.readouterr()
        said = err.replace(str(self.log), "FILE").splitlines()
        self.errors = [line for line in said if not re.search(r"^\d+( of \d+)? rows", line)]  # progress, if it is slow
        self.summary = json.loads(out) if out else {}
        return self.code

    def messages(self, topic: str) -> list[Any]:
        with BagReader(self.output) as reader:
            assert reader.complete
            return [record.message for record in reader.messages([topic])]

    def positions(self) -> list[PositionSample]:
        return [POSITION.read(message) for message in self.messages("position")]


@pytest.fixture
def importing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Import:
    return Import(tmp_path, capsys)


def test_a_good_log(importing: Import) -> None:
    assert importing(GOOD) == 0
    assert importing.errors == []
    assert importing.summary == {
        "rows": 3,
        "written": 3,
        "refused": {},
        "empty": {"brake_pressure": 1, "speed": 1, "variance": 1},
        "odd": [],
        "messages": {"/brake_pressure": 2, "/speed": 2, "/position": 3},
        "output": str(importing.output),
    }
    assert importing.positions() == [
        (100_000_000, 10.5, 0.25),
        (200_000_000, 18.5, 0.36),
        (300_000_000, 26.4, 0.25),
    ]
    assert [m.fluid_pressure for m in importing.messages("brake_pressure")] == [101_325.0, 511_325.0]
    assert [tuple(SPEED.read(m)) for m in importing.messages("speed")] == [(10**8, 80.0, None), (2 * 10**8, 79.9, None)]


def test_order_and_log_times_are_those_of_a_live_run(importing: Import) -> None:
    importing(GOOD)
    with BagReader(importing.output) as reader:
        records = [(record.topic, record.log_ns) for record in reader.messages()]
    assert records[:3] == [("/brake_pressure", 10**8), ("/speed", 10**8), ("/position", 10**8)]
    assert records[-1] == ("/position", 3 * 10**8)


def test_equal_logs_give_equal_recordings(importing: Import, tmp_path: Path) -> None:
    importing(GOOD)
    again = tmp_path / "again"
    assert import_csv.main([str(importing.log), "--output", str(again)]) == 0
    names = {file.name for file in again.iterdir()}
    assert names == {file.name for file in importing.output.iterdir()}
    assert all((again / name).read_bytes() == (importing.output / name).read_bytes() for name in names)


@pytest.mark.parametrize(
    ("options", "cell", "absolute_pa"),
    [
        ([], "410000", 511_325.0),
        (["--pressure-unit", "kpa"], "410", 511_325.0),
        (["--pressure-unit", "bar"], "4.1", 511_325.0),
        (["--pressure-unit", "bar", "--pressure-kind", "absolute"], "5.11325", 511_325.0),
        (["--pressure-kind", "absolute"], "511325", 511_325.0),
        (["--ambient-pressure", "58000"], "410000", 468_000.0),
        (["--ambient-pressure", "58000"], "0", 58_000.0),
        ([], "-100", 101_225.0),
    ],
)
def test_pressure_units(importing: Import, options: list[str], cell: str, absolute_pa: float) -> None:
    assert importing(f"time,position,brake_pressure\n1,2,{cell}\n", *options) == 0
    assert [message.fluid_pressure for message in importing.messages("brake_pressure")] == [absolute_pa]


@pytest.mark.parametrize(
    ("unit", "cell", "t_ns"),
    [
        ("s", "1700000000.123456789", 1_700_000_000_123_456_789),
        ("s", "0", 0),
        ("s", "1e-1", 100_000_000),
        ("s", "0.1000000004", 100_000_000),
        ("s", "0.1000000006", 100_000_001),
        ("ms", "1700000000123.456789", 1_700_000_000_123_456_789),
        ("ns", "1700000000123456789", 1_700_000_000_123_456_789),
        ("iso", "2023-11-14T22:13:20.123456789Z", 1_700_000_000_123_456_789),
        ("iso", "2023-11-14T23:13:20,5+01:00", 1_700_000_000_500_000_000),
        ("iso", "2023-11-14 22:13:20", 1_700_000_000_000_000_000),
    ],
)
def test_times_are_exact_to_the_nanosecond(importing: Import, unit: str, cell: str, t_ns: int) -> None:
    assert importing(f'time,position\n"{cell}",2\n', "--time-unit", unit) == 0
    assert importing.positions()[0][0] == t_ns
    with BagReader(importing.output) as reader:
        assert next(reader.messages()).log_ns == t_ns


def test_columns_units_and_delimiter_of_another_log(importing: Import) -> None:
    text = "v [km/h];Weg;t;ignored\n288;1.5;10;x\n270;1.575;11;\n"
    options = ["--time", "t", "--position", "Weg", "--speed", "v [km/h]", "--delimiter", ";"]
    assert importing(text, *options, "--position-unit", "km", "--speed-unit", "kmh", "--position-std", "2") == 0
    assert importing.positions() == [(10 * 10**9, 1500.0, 4.0), (11 * 10**9, 1575.0, 4.0)]
    assert [SPEED.read(message).speed_mps for message in importing.messages("speed")] == [80.0, 75.0]


def test_tabs_byte_order_mark_windows_lines_and_blank_lines(importing: Import) -> None:
    assert importing(b"\xef\xbb\xbftime\tposition\r\n\r\n1\t2\r\n\r\n2\t3\r\n", "--delimiter", "\\t") == 0
    assert importing.positions() == [(10**9, 2.0, 0.25), (2 * 10**9, 3.0, 0.25)]
    assert importing.summary["rows"] == 2


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
        "FILE:3: time = '-1': a stamp lies between 1970 (or 0) and 2038: is the --time-unit",
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


def test_memory_does_not_grow_with_the_log(tmp_path: Path) -> None:
    def peak(rows: int) -> int:
        log = tmp_path / f"{rows}.csv"
        log.write_text("time,position\n" + "".join(f"{row},1.0\n" for row in range(rows)))
        tracemalloc.start()
        import_csv.convert(log, tmp_path / f"bag{rows}", Format(named={}))
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    peak(100)  # types and caches
    small, large = peak(2000), peak(10_000)
    assert large < 8000 * 100 + small, "less than 100 bytes for every further row: the index of the file"
