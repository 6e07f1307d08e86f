# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whatever a CSV log holds, it ends in rows or in a ValueError with a message."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from breakable import refusals_say_why
from hypothesis import assume, given
from hypothesis import strategies as st

from adhesion_node.bag import BagReader
from adhesion_node.core.intake.samples import MAX_POSITION_M
from adhesion_node.tools import import_csv
from adhesion_node.tools.log import format as log_format
from adhesion_node.tools.log.cell.numbers import END_OF_STAMPS_NS
from adhesion_node.tools.log.format import OPTIONAL, Format
from adhesion_node.tools.log.odd.checks import odd
from adhesion_node.tools.log.text import Refusal
from adhesion_node.tools.log.whole.read import read_log

CELLS = st.sampled_from(
    ["0.1", "1e400", "-1e-400", "nan", "inf", "", '"', '""', "1_0", "٣", "0x10", "1,5", "\0", "1" * 5000, "1e-99999999"]
) | st.text(max_size=8)
FORMATS = st.builds(
    Format,
    named=st.dictionaries(st.sampled_from(("time", *OPTIONAL)), st.sampled_from("abt"), max_size=3),
    delimiter=st.sampled_from([None, ",", ";", "\t", " "]),
    decimal=st.sampled_from([None, ".", ","]),
    skip_rows=st.none() | st.integers(0, 3),
    time_unit=st.sampled_from([None, *log_format.TIME_UNITS, "iso"]),
    time_format=st.sampled_from([None, "%H:%M:%S", "%d.%m.%Y", "ISO8601"]),
    time_zone=st.sampled_from(["UTC", "Europe/Berlin"]),
    sort=st.booleans(),
    direction=st.sampled_from(["up", "down"]),
    position_unit=st.sampled_from(list(log_format.POSITION_UNITS)),
    pressure_unit=st.sampled_from(list(log_format.PRESSURE_UNITS)),
    is_gauge=st.none() | st.booleans(),
    speed_unit=st.sampled_from(list(log_format.SPEED_UNITS)),
    acceleration_unit=st.sampled_from(list(log_format.ACCELERATION_UNITS)),
    wheel_unit=st.sampled_from(log_format.WHEEL_UNITS),
)
HEADERS = st.sampled_from(
    [
        "time,position,variance,brake_pressure,speed",
        "time,lat,lon,height,variance",
        "time,speed,speed_std,acceleration,wheel_speed_1,wheel_speed_2",
    ]
) | st.text(max_size=40)
LINES = st.lists(st.lists(CELLS, max_size=6).map(",".join) | st.text(max_size=40), max_size=8)


@given(header=HEADERS, lines=LINES, form=FORMATS)
def test_any_text_as_a_log(header: str, lines: list[str], form: Format) -> None:
    text = "\n".join([header, *lines])
    with refusals_say_why():
        check_rows(text, form)


@given(
    times=st.lists(st.decimals(allow_nan=False, allow_infinity=False) | st.floats() | CELLS, min_size=1, max_size=5),
    cells=st.lists(st.floats() | CELLS, min_size=4, max_size=4),
    form=FORMATS,
)
def test_any_numbers_in_a_log(times: list[Any], cells: list[Any], form: Format) -> None:
    assume(not form.named)
    table = [["time", "position", "variance", "brake_pressure", "speed"], *([time, *cells] for time in times)]
    text = "\n".join((form.delimiter or ",").join(map(str, row)) for row in table)
    with refusals_say_why():
        check_rows(text, form)


@given(data=st.binary(max_size=60), good=st.booleans())
def test_any_file_as_a_log(data: bytes, good: bool) -> None:
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder, "log.csv")
        log.write_bytes(b"time,position\n" + b"0.1,5.0\n" * good + data)
        code = import_csv.main([str(log), "--output", str(Path(folder, "bag"))])
        assert code in ((0, 1) if good else (0, 1, 2))
        if code < 2:
            with BagReader(Path(folder, "bag")) as reader:
                assert reader.complete
                assert sum(reader.counts.values()) == len(list(reader.messages())) > 0


def check_rows(text: str, form: Format) -> None:
    """Every line is a plausible measurement with a rising time, or a refusal in one line that names the place."""
    refused: list[Refusal] = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "log")
        path.write_text(text, encoding="utf-8", errors="surrogatepass")
        log = read_log(path, form, refused.append)
    assert all(each.message.startswith(f"{path}:") for each in refused)
    t_ns = log.rows["t_ns"]
    assert ((t_ns >= 0) & (t_ns < END_OF_STAMPS_NS)).all()
    assert t_ns.diff().dropna().gt(0).all()
    assert not np.isinf(log.rows.to_numpy(dtype=float)).any()
    for row in log.rows.fillna({"variance": 1.0}).to_dict("records"):
        assert not abs(row.get("position", 0.0)) > MAX_POSITION_M
    if not log.rows.empty:
        assert all(odd(log))
