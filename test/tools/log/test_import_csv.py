# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A person's own log: its columns, units and exact times, and a recording as a live run leaves it."""

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
