# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Recordings that were killed, cut or damaged: what is left is read, what is not is said."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.summary import Summary
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from recorded import write_steps

from adhesion_node.bag import BagReader
from adhesion_node.bag.types import definition
from adhesion_node.bag.write.writer import file_name

WRITER_THAT_IS_KILLED = """
import sys
from adhesion_node.bag import BagWriter, encode
from adhesion_node.wire.topics import POSITION
writer = BagWriter(sys.argv[1])
step = 0
while True:
    writer.write("/position", POSITION.type, encode(POSITION, step * 10**7, (step / 7,), 0.25), step * 10**7)
    step += 1
    if step % 100 == 0:  # a second of a 100 Hz sensor
        writer.flush()
        print(step, flush=True)
"""


def test_a_killed_recording_loses_at_most_what_was_not_flushed(tmp_path: Path) -> None:
    path = tmp_path / "bag"
    with subprocess.Popen(
        [sys.executable, "-c", WRITER_THAT_IS_KILLED, str(path)], stdout=subprocess.PIPE, env=child_environment()
    ) as process:
        assert process.stdout is not None
        flushed = [int(process.stdout.readline()) for _ in range(20)][-1]
        process.send_signal(signal.SIGKILL)
        flushed = max([flushed, *(int(line) for line in process.stdout if line.endswith(b"\n"))])
    assert process.returncode == -signal.SIGKILL
    assert not (path / "metadata.yaml").exists()
    with BagReader(path) as reader:
        assert not reader.complete
        assert "breaks off" in reader.damage[0]
        steps = [record.log_ns // 10**7 for record in reader.messages()]
    assert steps == list(range(len(steps)))
    assert len(steps) >= flushed


def child_environment() -> dict[str, str]:
    """The environment without what rclpy's wheels leave in it for their own process."""
    private = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")
    return {name: value for name, value in os.environ.items() if name not in private}


def test_a_cut_file_is_read_up_to_the_cut(tmp_path: Path) -> None:
    written = write_steps(tmp_path / "bag", 1500)
    whole = (tmp_path / "bag" / file_name(0)).read_bytes()
    cut = tmp_path / "cut.mcap"
    lengths: list[int] = []
    summary = index_of(tmp_path / "bag" / file_name(0))
    for size in np.linspace(summary.chunk_indexes[1].chunk_start_offset, len(whole) - 1, 60).astype(int).tolist():
        cut.write_bytes(whole[:size])
        with BagReader(cut) as reader:
            read = list(reader.messages())
            assert not reader.complete
        assert read == written[: len(read)]
        lengths.append(len(read))
    assert lengths == sorted(lengths)
    assert lengths[-1] == len(written), "only the end of the file is missing"
    assert len(set(lengths)) == len(summary.chunk_indexes) >= 5, "the cuts fall into every chunk but the first"
    cut.write_bytes(whole[: summary.chunk_indexes[0].chunk_start_offset + 300])
    with pytest.raises(ValueError, match="holds no readable message"):
        BagReader(cut)


@pytest.mark.parametrize("compression", CompressionType)
def test_a_chunk_that_is_cut_off_is_read_up_to_the_cut(compression: CompressionType, tmp_path: Path) -> None:
    """Other recorders write chunks of megabytes: that with the cut was lost."""
    written = write_steps(tmp_path / "bag", 1500)
    cut = tmp_path / "cut.mcap"
    with cut.open("wb") as stream:
        writer: Any = McapWriter(stream, compression=compression, chunk_size=2**30)
        writer.start()
        channels = {
            topic: writer.register_channel(
                topic, "cdr", writer.register_schema(kind, "ros2msg", definition(kind).text.encode())
            )
            for topic, kind, _, _ in written[:2]
        }
        for topic, _, cdr, log_ns in written:
            writer.add_message(channels[topic], log_ns, cdr, log_ns)
        writer.finish()
    chunk = index_of(cut).chunk_indexes[0]
    cut.write_bytes(cut.read_bytes()[: chunk.chunk_start_offset + chunk.chunk_length // 2])
    with BagReader(cut) as reader:
        read = list(reader.messages())
        assert reader.damage == (
            f"{cut} breaks off at byte {chunk.chunk_start_offset}: its recording was interrupted or the file was cut, "
            f"{len(read)} messages of the chunk there are read",
        )
    assert len(read) > 1000
    assert read == written[: len(read)]


def index_of(file: Path) -> Summary:
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return summary


def test_a_damaged_chunk_is_left_out_and_reported(tmp_path: Path) -> None:
    written = write_steps(tmp_path / "bag", 1500)
    file = tmp_path / "bag" / file_name(0)
    data = bytearray(file.read_bytes())
    data[index_of(file).chunk_indexes[2].chunk_start_offset + 200] ^= 0xFF
    file.write_bytes(data)
    with BagReader(tmp_path / "bag") as reader:
        read = list(reader.messages())
        assert not reader.complete
        assert "is damaged at byte" in reader.damage[0]
    assert 0 < len(read) < len(written)
    kept = iter(written)
    assert all(record in kept for record in read), "what is left is in order and unchanged"
    assert read[-1] == written[-1]


def test_a_chunk_that_no_longer_looks_like_one_is_missed(tmp_path: Path) -> None:
    """One wrong bit makes it a record of an unknown kind; the statistics at the end know better."""
    written = write_steps(tmp_path / "bag", 1500)
    file = tmp_path / "bag" / file_name(0)
    data = bytearray(file.read_bytes())
    chunk = index_of(file).chunk_indexes[2]
    data[chunk.chunk_start_offset] ^= 0x80
    single = tmp_path / "single.mcap"
    single.write_bytes(data)
    with BagReader(single) as reader:
        read = list(reader.messages())
        lost = len(written) - len(read)
        assert lost > 0
        assert not reader.complete
        assert reader.damage == (f"{single}: {lost} messages are lost, its end counts {len(written)}",)


@pytest.mark.parametrize("where", ["chunk", "index"])
@pytest.mark.parametrize("length", [0, 5, 50_000, 2**40])
@pytest.mark.parametrize("finished", [True, False])
def test_behind_a_torn_record_reading_goes_on_with_the_next_chunk(
    where: str, length: int, finished: bool, tmp_path: Path
) -> None:
    """A chunk that only claims to be longer than it is is there as a whole."""
    written = write_steps(tmp_path / "bag", 1500)
    file = tmp_path / "bag" / file_name(0)
    before, chunk, after, *_ = index_of(file).chunk_indexes[1:]
    data = bytearray(file.read_bytes())
    at = chunk.chunk_start_offset if where == "chunk" else before.chunk_start_offset + before.chunk_length
    data[at + 1 : at + 9] = length.to_bytes(8, "little")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data if finished else data[: index_of(file).chunk_indexes[-1].chunk_start_offset])
    whole = where == "chunk" and length == 50_000
    lost = (chunk.message_start_time, chunk.message_end_time) if where == "chunk" and not whole else (1, 0)
    with BagReader(cut) as reader:
        read = list(reader.messages())
        assert whole or f"{cut} is damaged at byte " in "".join(reader.damage)
    kept, left = ([each for each in all_ if not lost[0] <= each.log_ns <= lost[1]] for all_ in (read, written))
    assert kept == (left if finished else left[: len(kept)])
    assert after.message_end_time <= read[-1].log_ns
    assert not [each for each in read if lost[0] < each.log_ns < lost[1]]


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4])
@pytest.mark.parametrize("claimed", [None, 1000])
def test_a_chunk_that_is_too_long_is_left_out_before_it_is_made(
    compression: CompressionType, claimed: int | None, tmp_path: Path
) -> None:
    """Some hundred kB of zeros compressed stand for 200 MB, whatever the chunk says that they do."""
    path = tmp_path / "bomb.mcap"
    with path.open("wb") as stream:
        writer: Any = McapWriter(stream, compression=compression, chunk_size=2**31)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/bomb", "cdr", schema)
        writer.add_message(channel, 1, bytes(200 * 2**20), 1)
        writer.finish()
    data = bytearray(path.read_bytes())
    if claimed is not None:
        start = index_of(path).chunk_indexes[0].chunk_start_offset
        data[start + 9 + 16 : start + 9 + 24] = claimed.to_bytes(8, "little")
        path.write_bytes(data)
    del data
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match=r"holds no readable message .*is damaged at byte"):
            BagReader(path)
        assert tracemalloc.get_traced_memory()[1] < 20 * 2**20
    finally:
        tracemalloc.stop()


def test_an_index_is_not_taken_for_a_message(tmp_path: Path) -> None:
    """One wrong bit makes the one kind of record the other."""
    written = write_steps(tmp_path / "bag", 20)
    file = tmp_path / "bag" / file_name(0)
    data = bytearray(file.read_bytes())
    chunk = index_of(file).chunk_indexes[0]
    place = chunk.chunk_start_offset + chunk.chunk_length
    assert data[place] == Opcode.MESSAGE_INDEX
    data[place] = Opcode.MESSAGE
    file.write_bytes(data)
    with BagReader(tmp_path / "bag") as reader:
        assert list(reader.messages()) == written
        assert not reader.complete
        assert "is damaged at byte" in reader.damage[0]
