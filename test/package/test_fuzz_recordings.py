# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whatever a recording holds, the reader stands: it ends in messages or in a ValueError that says why, never hangs."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cdrs
import pytest
import yaml
from breakable import EDITS, YAML_VALUES, edited, refusals_say_why
from hypothesis import assume, given
from hypothesis import strategies as st

from adhesion_node.bag import BagReader, BagWriter, Limits, Record
from adhesion_node.bag.write.writer import file_name
from adhesion_node.tools import recover
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION

S = 10**9


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
