# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Every sensor's columns: what is written comes back as its sample; the log of the documentation gives an estimate."""

from __future__ import annotations

import math
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_import_csv import Import, importing

from adhesion_node.bag import BagReader
from adhesion_node.core.intake.samples import DemandSample, ImuSample, SpeedSample, WheelSample
from adhesion_node.nodes import replay
from adhesion_node.wire.line import Line
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKE_DEMAND, FIX, IMU, POSITION, SPEED, WHEEL_SPEED
from adhesion_node.wire.track_line import line_of

__all__ = ["importing"]

PAGE = Path(__file__).resolve().parents[3] / "doc" / "own_data.md"
S = 10**9

ALL = """\
time,lat,lon,height,variance,speed,speed_std,wheel_speed_1,wheel_speed_2,acceleration,brake_pressure,brake_demand
1,47.001,8.0,512.5,4.0,20.0,0.1,43.5,43.1,-0.02,0,0
2,,,,,19.0,,41.3,,-1.0,300000,410000
3,47.0013,8.0,,,,,,,,,
"""


def read(importing: Import, topic: Topic, line: Line | None = None) -> list[Any]:
    return [topic.read(message, line or Line()) for message in importing.messages(topic.name)]


def test_every_column_comes_back_as_a_sample(importing: Import) -> None:
    assert importing(ALL) == 0
    assert importing.summary["messages"] == {
        **{"/brake_pressure": 2, "/brake_demand": 2, "/speed": 2, "/imu": 2, "/wheel_speed": 2, "/fix": 2}
    }
    assert importing.summary["empty"]["wheel_speed_2"] == 2
    assert read(importing, SPEED) == [SpeedSample(S, 20.0, 0.1**2), SpeedSample(2 * S, 19.0, None)]
    assert read(importing, IMU) == [ImuSample(S, -0.02, None), ImuSample(2 * S, -1.0, None)]
    assert read(importing, BRAKE_DEMAND) == [DemandSample(S, 0.0), DemandSample(2 * S, 410e3)]
    first, second = read(importing, WHEEL_SPEED)
    assert first == WheelSample(S, (43.5, 43.1))
    assert second.speeds_radps[0] == 41.3
    assert math.isnan(second.speeds_radps[1])
    meridian = Line(track=line_of("meridian", np.array([47.0, 47.01]), np.array([8.0, 8.0]), None, 0.0))
    one, other = read(importing, FIX, meridian)
    assert (one.position_m, one.variance_m2) == pytest.approx((111.18, 4.0), abs=0.01)
    assert (other.t_ns, other.variance_m2) == (3 * S, 9.0), "unknown, so that of position_std_m"
    heights = [message.altitude for message in importing.messages("fix")]
    assert heights[0] == 512.5
    assert math.isnan(heights[1])


@pytest.mark.parametrize(
    ("options", "cell", "radps"),
    [
        (["--wheel-unit", "rpm"], "60", 2.0 * math.pi),
        (["--wheel-unit", "mps"], "23", 50.0),
        (["--wheel-unit", "kmh", "--wheel-radius", "0.5"], "180", 100.0),
    ],
)
def test_units_of_the_wheels(importing: Import, options: list[str], cell: str, radps: float) -> None:
    assert importing(f"time,speed,b,a\n1,20,{cell},1\n", "--wheel-speeds", "a", "b", *options) == 0
    assert read(importing, WHEEL_SPEED)[0].speeds_radps[1] == pytest.approx(radps)


def test_other_units(importing: Import) -> None:
    text = "time,speed,speed_std,acceleration,d\n1,72,3.6,-0.1,4.1\n"
    options = ["--speed-unit", "kmh", "--acceleration-unit", "g", "--demand", "d", "--pressure-unit", "bar"]
    assert importing(text, *options) == 0
    assert read(importing, SPEED)[0] == pytest.approx((S, 20.0, 1.0))
    assert read(importing, IMU)[0].acceleration_mps2 == pytest.approx(-0.980665)
    assert read(importing, BRAKE_DEMAND)[0].pressure_pa == pytest.approx(410e3)


def test_the_standard_deviation_of_all_positions(importing: Import) -> None:
    assert importing("time,position,lat,lon\n1,2,47,8\n", "--position-std", "2") == 0
    assert read(importing, POSITION)[0].variance_m2 == 4.0
    assert [message.position_covariance[0] for message in importing.messages("fix")] == [4.0]


def test_a_receiver_without_a_fix_tells_0_and_0(importing: Import) -> None:
    """What else its row holds counts."""
    assert importing("time,lat,lon,speed\n1,0,0.0,20\n2,0,8,20\n3,47,8,20\n") == 0, importing.errors
    assert [one.t_ns for one in read(importing, SPEED)] == [S, 2 * S, 3 * S]
    assert [message.longitude for message in importing.messages("fix")] == [8.0, 8.0]
    assert importing.summary["empty"]["lat"] == 1


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("1,91,8,", "FILE:2: lat = '91': 91 is not from -90 to 90 degrees: are latitude and longitude exchanged, or"),
        ("1,47,181,", "FILE:2: lon = '181': 181 is not from -180 to 180 degrees"),
        ("1,47,,", "FILE:2: row = '1,47,,': a place needs both, latitude and longitude"),
        ("1,47,8,2000", "FILE:2: wheel_speed_1 = '2000': 2000 is not from -1000 to 1000 rad/s: is the --wheel-unit"),
        ("1,47,8,x", "FILE:2: wheel_speed_1 = 'x': write a finite number"),
        ("1,,,", "FILE:2: row = '1,,,': every row needs a time and something measured"),
    ],
)
def test_bad_cells_are_named(importing: Import, row: str, message: str) -> None:
    assert importing(f"time,lat,lon,wheel_speed_1\n{row}\n2,47,8,40\n") == 1
    assert importing.errors[0].startswith(f"import_csv: {message}")


@pytest.mark.parametrize(
    ("header", "options", "message"),
    [
        (
            "time,acceleration",
            [],
            "FILE: columns ['time', 'acceleration']: has neither position, lat and lon, speed nor wheels",
        ),
        ("time,lat", [], "FILE: columns ['time', 'lat']: has neither"),
        ("time,lat,speed", ["--lat", "lat"], "FILE: lat = 'lat': a place needs both, name the other with --lon COL"),
        ("time,speed", ["--wheel-speeds", "a"], "FILE: column 'a' is missing: it has .*--wheel-speeds COL"),
        ("time,speed,a,a", ["--wheel-speeds", "a"], "FILE: column 'a' is there 2 times"),
        ("time,speed", ["--wheel-radius", "0"], "wheel-radius = 0.0: give a radius of 0.01 to 5 m"),
    ],
)
def test_columns_that_do_not_fit_are_named(importing: Import, header: str, options: list[str], message: str) -> None:
    assert importing(f"{header}\n1,2\n", *options) == 2
    words, _, remedy = message.partition(".*")
    assert importing.errors[-1].startswith(f"import_csv: {words}")
    assert remedy in importing.errors[-1]


def braking_log(path: Path) -> None:
    """Write 30 s with the columns and units of the documentation's log: the brake comes on at 10 s, 0.75 m/s^2."""
    lines = [re.search(r"^time,.*$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)]
    header = lines[0]
    assert header is not None
    rows, way_m, speed_mps = [header[0]], 0.0, 50.0
    for step in range(300):
        brake = 4.1 if step >= 100 else 0.0
        kmh = f"{3.6 * speed_mps:.2f}"
        place = f"{47.0 + way_m / 111_181.0:.8f},8.0" if step % 2 == 0 else ","
        rows.append(f"{step / 10},{place},,{kmh},0.4,{kmh},{kmh},{-0.75 if brake else -0.02},{brake},{brake}")
        way_m += 0.1 * speed_mps
        speed_mps -= 0.075 if brake else 0.0
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def test_the_documented_log_is_imported_and_replayed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The commands of the page, as they stand there."""
    from adhesion_node.tools import import_csv

    monkeypatch.chdir(tmp_path)
    braking_log(tmp_path / "log.csv")
    (tmp_path / "my_line.csv").write_text("lat,lon\n46.99,8.0\n47.2,8.0\n", encoding="utf-8")
    text = PAGE.read_text(encoding="utf-8").replace("\\\n", " ")
    block = next(part for part in text.split("```") if part.startswith("bash") and "--wheel-unit" in part)
    commands = [shlex.split(line) for line in block.splitlines() if line.startswith(("import_csv", "replay"))]
    programs = {"import_csv": import_csv.main, "replay": replay.main}
    assert [words[0] for words in commands] == ["import_csv", "replay"]
    assert [programs[program](arguments) for program, *arguments in commands] == [0, 1]
    said, errors = capsys.readouterr()
    assert "mu_final" in said
    least = re.search(r"nothing is identified: the brake limited throughout: the adhesion is at least (0\.\d+)", errors)
    assert least is not None, errors
    assert 0.06 <= float(least[1]) <= 0.0714, "what it used: 0.75 m/s^2 less the resistance at 40 m/s"
    with BagReader(tmp_path / "my_run") as reader:
        counts = {name.lstrip("/"): count for name, count in reader.counts.items()}
    others = ("brake_pressure", "brake_demand", "speed", "imu", "wheel_speed")
    assert counts == {**dict.fromkeys(others, 300), "fix": 150}
