# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Recordings that were killed, cut, damaged, split, or made by others: what is left is read, what is not is said."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import cdrs
import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.summary import Summary
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from recorded import S, write_steps
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from adhesion_node.bag import BagReader, Record, typestore
from adhesion_node.bag.write.writer import file_name
from adhesion_node.wire.topics import POSITION

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


INFINITE = (
    "rosbag2_bagfile_information: {topics_with_message_count: [{topic_metadata: {name: a}, message_count: .inf}]}"
)


@pytest.mark.parametrize("text", ["[" * 20_000, INFINITE])
def test_metadata_that_makes_no_sense_is_as_good_as_none(text: str, tmp_path: Path) -> None:
    written = write_steps(tmp_path / "bag", 3)
    (tmp_path / "bag" / "metadata.yaml").write_text(text)
    with BagReader(tmp_path / "bag") as reader:
        assert list(reader.messages()) == written
        assert "has no readable metadata.yaml" in reader.damage[0]


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


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("x.mcap", b"", r"x\.mcap: is empty: name another recording"),
        ("x.mcap", b"garbage " * 100, r"x\.mcap: is not an MCAP file"),
        ("x.mcap", b"\x89MCAP0\r\n", r"x\.mcap: holds no readable message \(.*breaks off"),
        ("x.mcap", b"\x89MCAP0\r\n" + b"\xff" * 300, r"x\.mcap: holds no readable message"),
        ("x.db3", b"garbage " * 100, r"x\.db3: unreadable \(.*\): name another recording"),
        ("x.bag", b"#ROSBAG V2.0", r"x\.bag: is no recording of ROS 2: convert it with rosbags-convert"),
        ("x.CSV", b"time,speed", r"x\.CSV: is no recording of ROS 2: make one of a log by import_csv"),
        ("x.mcap.zstd", b"text", r"x\.mcap\.zstd: is no recording of ROS 2: name its directory"),
        ("x.txt", b"text", r"x\.txt: is no recording of ROS 2: name a rosbag2 directory or an \.mcap file"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message):
        BagReader(tmp_path / name)


def test_directories_without_a_recording_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"missing: does not exist: name a rosbag2 directory"):
        BagReader(tmp_path / "missing")
    with pytest.raises(ValueError, match=r"holds no \.mcap or \.db3 file"):
        BagReader(tmp_path)


def test_recordings_within_a_folder_are_named(tmp_path: Path) -> None:
    for name in ("tuesday", "monday"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run_0.mcap").touch()
    with pytest.raises(ValueError, match=r"name the directory of a recording, as .*monday$"):
        BagReader(tmp_path)


def test_broken_metadata_does_not_matter(tmp_path: Path) -> None:
    written = write_steps(tmp_path / "bag", 3)
    (tmp_path / "bag" / "metadata.yaml").write_text("{ this is : [ no yaml")
    with BagReader(tmp_path / "bag") as reader:
        assert list(reader.messages()) == written


def test_a_missing_file_of_a_split_recording_is_reported(tmp_path: Path) -> None:
    written = write_steps(tmp_path / "bag", 3)
    metadata = tmp_path / "bag" / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(f"- {file_name(0)}\n", f"- {file_name(0)}\n  - bag_1.mcap\n"))
    with BagReader(tmp_path / "bag") as reader:
        assert list(reader.messages()) == written
        assert not reader.complete
        assert reader.damage[0].endswith("bag_1.mcap is missing")


def test_split_recordings_are_merged(tmp_path: Path) -> None:
    one, two = write_steps(tmp_path / "one", 300), write_steps(tmp_path / "two", 300, first=200)
    both = tmp_path / "both"
    both.mkdir()
    (tmp_path / "one" / file_name(0)).rename(both / "x_9.mcap")
    (tmp_path / "two" / file_name(0)).rename(both / "x_10.mcap")
    with BagReader(both) as reader:
        assert list(reader.messages()) == sorted([*one, *two], key=lambda record: record.log_ns)


@pytest.mark.parametrize("plugin", StoragePlugin)
@pytest.mark.parametrize("compression", CompressionMode)
def test_recordings_of_other_recorders(tmp_path: Path, plugin: StoragePlugin, compression: CompressionMode) -> None:
    if plugin is StoragePlugin.SQLITE3 and compression is CompressionMode.STORAGE:
        pytest.skip("sqlite3 has no compression of its own")
    path = tmp_path / "foreign"
    foreign = Writer(path, version=9, storage_plugin=plugin)
    foreign.set_compression(compression, CompressionFormat.ZSTD)
    topic = "/train1/odometry/position"
    written = [Record(topic, POSITION.type, cdrs.position(step * S, float(step), 0.25), step * S) for step in range(50)]
    with foreign:
        connection = foreign.add_connection(topic, POSITION.type, typestore=typestore())
        for record in written:
            foreign.write(connection, record.log_ns, record.cdr)
    with BagReader(path) as reader:
        assert reader.complete
        assert reader.topics == {topic: POSITION.type}
        assert reader.counts == {topic: 50}
        assert list(reader.messages()) == written
        assert list(reader.messages(["position"])) == []
