# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whatever a file holds, the readers stand: recordings, CSV logs, parameter files and settings.

Each ends in a result or in a ValueError with a message; never in another exception, never in a hang.
"""

from __future__ import annotations

import io
import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cdrs
import numpy as np
import pytest
import yaml
from conftest import ROOT
from hypothesis import assume, given
from hypothesis import strategies as st

from adhesion_node.bag import BagReader, BagWriter, Limits, Record
from adhesion_node.bag.write.writer import file_name
from adhesion_node.core.intake.samples import MAX_POSITION_M
from adhesion_node.tools import import_csv, recover
from adhesion_node.tools.log import format as log_format
from adhesion_node.tools.log.cell.numbers import END_OF_STAMPS_NS
from adhesion_node.tools.log.format import OPTIONAL, Format
from adhesion_node.tools.log.odd.checks import odd
from adhesion_node.tools.log.text import Refusal
from adhesion_node.tools.log.whole.read import read_log
from adhesion_node.wire.files import parameters
from adhesion_node.wire.settings.given import parse_setting
from adhesion_node.wire.settings.nodes import SETTINGS
from adhesion_node.wire.settings.setup import Setup, setup_of
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION

S = 10**9
DEFAULTS = (ROOT / "adhesion_node" / "nodes" / "defaults.yaml").read_text(encoding="utf-8")


def written() -> list[Record]:
    """The messages of a small recording of several chunks."""
    records = []
    for step in range(40):
        t_ns = step * S // 10
        records.append(Record("/brake_pressure", BRAKE_PRESSURE.type, cdrs.brake_pressure(t_ns, 1e5 + step), t_ns))
        records.append(Record("/position", POSITION.type, cdrs.position(t_ns, step / 3, 0.25), t_ns))
    return records


@pytest.fixture(scope="module")
def whole() -> Iterator[tuple[bytes, str]]:
    """A recording: its MCAP file and its metadata."""
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder, "bag")
        with BagWriter(bag, Limits(span_ns=S)) as writer:
            for record in written():
                writer.write(*record)
        yield (bag / file_name(0)).read_bytes(), (bag / "metadata.yaml").read_text()


@contextmanager
def refusals_say_why() -> Iterator[None]:
    """Let a ValueError with a message pass as a refusal."""
    try:
        yield
    except ValueError as error:
        if not str(error):
            raise AssertionError("the refusal says nothing") from error


def read(mcap: bytes, metadata: str | bytes | None = None, name: str = file_name(0)) -> list[Record] | None:
    """Return the records of a recording with this content, or None where it is refused with a message."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, name).write_bytes(mcap)
        if metadata is not None:
            Path(folder, "metadata.yaml").write_bytes(metadata.encode() if isinstance(metadata, str) else metadata)
        with refusals_say_why(), BagReader(folder) as reader:
            records = list(reader.messages())
            assert len(records) == sum(reader.counts.values())
            for record in records:
                with refusals_say_why():
                    _ = record.message
            return records
    return None


def is_part(records: list[Record], of: list[Record]) -> bool:
    """Tell whether the records are among the written ones, in their order."""
    rest = iter(of)
    return all(record in rest for record in records)


EDITS = st.lists(st.tuples(st.integers(0, 10**6), st.binary(min_size=1, max_size=9)), min_size=1, max_size=6)


def edited(data: bytes, edits: list[tuple[int, bytes]]) -> bytes:
    """Overwrite pieces of the data."""
    changed = bytearray(data)
    for place, piece in edits:
        start = place % len(data)
        changed[start : start + len(piece)] = piece
    return bytes(changed[: len(data)])


@given(data=st.binary(max_size=2000), has_magic=st.booleans())
def test_random_bytes_are_no_recording(data: bytes, has_magic: bool) -> None:
    for name in ("x.mcap", "x.db3"):
        assert not read(b"\x89MCAP0\r\n" * has_magic + data, None, name)


@given(place=st.integers(0, 10**6))
def test_a_cut_recording_is_a_shorter_one(whole: tuple[bytes, str], place: int) -> None:
    mcap, metadata = whole
    records = read(mcap[: place % len(mcap)], metadata)
    assert records is None or records == written()[: len(records)]


@given(place=st.integers(0, 10**6), bit=st.integers(0, 7))
def test_a_flipped_bit_costs_a_part(whole: tuple[bytes, str], place: int, bit: int) -> None:
    """The chunks are guarded by checksums; what stands around them says where they are and not what they hold."""
    mcap, metadata = whole
    place %= len(mcap)
    records = read(edited(mcap, [(place, bytes([mcap[place] ^ 1 << bit]))]), metadata)
    assert records is None or is_part(records, written())


@given(edits=EDITS)
def test_a_recording_with_overwritten_pieces(whole: tuple[bytes, str], edits: list[tuple[int, bytes]]) -> None:
    damaged = edited(whole[0], edits)
    records = read(damaged, whole[1])
    with tempfile.TemporaryDirectory() as folder, refusals_say_why():
        Path(folder, "x.mcap").write_bytes(damaged)
        summary = recover.recover(Path(folder, "x.mcap"), Path(folder, "whole"))
        assert records is not None
        with BagReader(Path(folder, "whole")) as reader:
            assert reader.complete
            assert list(reader.messages()) == records
        assert sum(summary["messages"].values()) == len(records)


@given(edits=EDITS)
def test_broken_metadata_cannot_hide_the_messages(whole: tuple[bytes, str], edits: list[tuple[int, bytes]]) -> None:
    mcap, metadata = whole
    broken = edited(metadata.encode(), edits)
    assume(b"compress" in broken)
    records = read(mcap, broken)
    assert records is None or records == written()


YAML_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=10),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9) | st.integers(), inner, max_size=4),
    max_leaves=8,
)
ENTRIES = ("relative_file_paths", "topics_with_message_count", "compression_mode", "message_count", "files", "version")


@given(entry=st.sampled_from(ENTRIES), value=YAML_VALUES)
def test_metadata_of_any_shape(whole: tuple[bytes, str], entry: str, value: Any) -> None:
    mcap, metadata = whole
    document = yaml.safe_load(metadata)
    document["rosbag2_bagfile_information"][entry] = value
    text = io.StringIO()
    yaml.safe_dump(document, text)
    records = read(mcap, text.getvalue())
    assert records == written() or entry == "compression_mode"


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
    pressure_is_gauge=st.booleans(),
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


NAMES = st.sampled_from([setting.name for setting in SETTINGS])
VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=20),
    st.sampled_from([0, -1, 10**9, 10**400, 1e308, math.nan, math.inf, "tunnel 0 1000", "grade 0 1e308 1e308", [], {}]),
    st.lists(st.integers(), max_size=2),
)


@given(text=st.text(max_size=30) | st.builds("{}={}".format, NAMES, VALUES))
def test_any_text_as_a_setting(text: str) -> None:
    with refusals_say_why():
        assert isinstance(setup_of(dict([parse_setting(text, SETTINGS)])), Setup)


@given(values=st.dictionaries(NAMES, VALUES, max_size=4))
def test_any_values_as_settings(values: dict[str, Any]) -> None:
    with refusals_say_why():
        assert isinstance(setup_of(values), Setup)
        numbers = [value for value in values.values() if isinstance(value, float)]
        assert all(map(math.isfinite, numbers)), "what is not finite is no setting"


def parameters_in(content: bytes) -> dict[str, Any] | None:
    """Return the settings in a parameter file, or None where they are refused with a message."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "params.yaml")
        path.write_bytes(content)
        with refusals_say_why():
            values = parameters.read(str(path), "estimator")
            setup_of(values)
            return values
    return None


@given(edits=EDITS)
def test_a_parameter_file_with_overwritten_pieces(edits: list[tuple[int, bytes]]) -> None:
    parameters_in(edited(DEFAULTS.encode(), edits))


@given(data=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_any_file_as_a_parameter_file(data: bytes) -> None:
    parameters_in(data)


@given(document=YAML_VALUES, node=st.sampled_from(["estimator", "/**", "**", "/estimator", "estimatr", "simulator"]))
def test_parameters_of_any_shape(document: Any, node: str) -> None:
    text = io.StringIO()
    yaml.safe_dump({node: {"ros__parameters": document}}, text)
    values = parameters_in(text.getvalue().encode())
    assert values is None or node.strip("/") in ("estimator", "**"), "a file for another node is not taken for ours"
