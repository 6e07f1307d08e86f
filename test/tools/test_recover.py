# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`recover` makes a complete recording of an interrupted, cut or foreign one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cdrs
import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from recorded import JSON, LATCHED, NUMBER, TEXT, cdr_beside, write_beside
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from test_bag_damaged import index_of
from test_recording_survives import file_size_limit

from adhesion_node.bag import BagReader, BagWriter, Limits
from adhesion_node.bag.types import Definition, definition, type_hash
from adhesion_node.bag.write.writer import file_name
from adhesion_node.tools import recover
from adhesion_node.wire.topics import BRAKE_PRESSURE, BRAKING_CURVE, POSITION

S = 10**9


def interrupted(path: Path, steps: int) -> None:
    """Leave a recording as a killed recorder does: without index and metadata, ending within a chunk."""
    writer = BagWriter(path)
    writer.add_topic("/curve", BRAKING_CURVE.type, offered=[LATCHED])
    writer.write("/curve", BRAKING_CURVE.type, b"\0\1\0\0", 0)
    for step in range(steps):
        writer.write("/position", POSITION.type, cdrs.position(step * S, step / 3, 0.25), step * S)
        if step % 100 == 99:
            writer.flush()
    writer.close()
    (path / "metadata.yaml").unlink()
    with (path / file_name(0)).open("r+b") as file:
        file.truncate(file.seek(0, 2) * 2 // 3)


def test_an_interrupted_recording_becomes_complete(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    interrupted(tmp_path / "bag", 1000)
    assert recover.main([str(tmp_path / "bag"), "--output", str(tmp_path / "whole"), "--json", "-"]) == 0
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert summary["complete"] is False
    assert [f"recover: {loss}" for loss in summary["damage"]] == err.splitlines()
    assert "breaks off" in err
    with (
        BagReader(tmp_path / "bag") as before,
        BagReader(tmp_path / "whole") as after,
        Reader(tmp_path / "whole") as it,
    ):
        read = list(after.messages())
        assert read == list(before.messages())
        assert after.complete
        assert after.infos["/curve"].offered == (LATCHED,)
        assert it.message_count == len(read) == sum(summary["messages"].values()) > 100


def damaged_first_chunk(path: Path) -> Path:
    """Damage the chunk that names the type of /early and /late; that of /pressure is named in a later one."""
    with BagWriter(path) as writer:
        for number, (name, topic) in enumerate(
            {"/early": POSITION, "/late": POSITION, "/pressure": BRAKE_PRESSURE}.items()
        ):
            for step in range(10):
                t_ns = number * S + step * S // 100
                cdr = cdrs.position(t_ns, 0.0, 0.25) if topic is POSITION else cdrs.brake_pressure(t_ns, 1e5)
                writer.write(name, topic.type, cdr, t_ns)
            writer.flush()
    file = path / file_name(0)
    data = bytearray(file.read_bytes())
    data[index_of(file).chunk_indexes[0].chunk_start_offset + 100] ^= 0xFF
    file.write_bytes(data)
    (path / "metadata.yaml").unlink()
    return file


def test_a_type_that_a_damaged_chunk_named_is_that_of_the_end(tmp_path: Path) -> None:
    file = damaged_first_chunk(tmp_path / "bag")
    summary = recover.recover(file, tmp_path / "whole")
    assert summary["messages"] == {"/late": 10, "/pressure": 10}
    (damage,) = summary["damage"]
    assert "is damaged at byte" in damage
    with BagReader(tmp_path / "whole") as reader:
        assert reader.topics == {"/late": POSITION.type, "/pressure": BRAKE_PRESSURE.type}
        assert all(record.is_whole for record in reader.messages())


def test_a_topic_whose_type_is_lost_is_said_and_all_others_are_rescued(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = damaged_first_chunk(tmp_path / "bag")
    last = index_of(file).chunk_indexes[-1]
    with file.open("r+b") as stream:
        stream.truncate(last.chunk_start_offset + last.chunk_length)
    assert recover.main([str(file), "--output", str(tmp_path / "whole")]) == 0
    out, err = capsys.readouterr()
    assert f"recover: {file}: 10 messages of /late are left out, their type is lost" in err.splitlines()
    assert "10 /pressure" in out.splitlines()
    with BagReader(tmp_path / "whole") as reader:
        assert reader.counts == {"/pressure": 10}


def test_recovering_twice_changes_nothing(tmp_path: Path) -> None:
    interrupted(tmp_path / "bag", 500)
    recover.recover(tmp_path / "bag", tmp_path / "one")
    summary = recover.recover(tmp_path / "one", tmp_path / "two")
    assert summary["complete"]
    assert (tmp_path / "one" / file_name(0)).read_bytes() == (tmp_path / "two" / file_name(0)).read_bytes()


def test_what_does_not_decode_is_kept_or_left_out_on_demand(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = [(POSITION, cdrs.position(step * S, float(step), 0.25)) for step in range(10)]
    with BagWriter(tmp_path / "bag") as writer:
        writer.write("/curve", BRAKING_CURVE.type, b"\0\1\0\0", 0)
        for step, (topic, cdr) in enumerate(good):
            writer.write("/position", topic.type, cdr[:40] if step == 4 else cdr + bytes(8 * (step == 5)), step * S)
        writer.add_topic("/bar", "foo_msgs/msg/Bar", known_as=Definition("ros2msg", "int32 baz"))
        writer.write("/bar", "foo_msgs/msg/Bar", b"\0\1", 3)
    kept = recover.recover(tmp_path / "bag", tmp_path / "kept")
    assert (kept["messages"], kept["undecodable"]) == ({"/curve": 1, "/position": 10, "/bar": 1}, {})
    arguments = [str(tmp_path / "bag"), "--output", str(tmp_path / "whole"), "--drop-undecodable"]
    assert recover.main(arguments) == 0
    assert "1 /position left out, they do not decode" in capsys.readouterr().out
    with BagReader(tmp_path / "whole") as reader:
        records = list(reader.messages())
        assert [record.cdr for record in records if record.topic == "/position"][:6] == [
            *(cdr for _, cdr in good[:4]),
            good[5][1] + bytes(8),
            good[6][1],
        ]
        assert reader.counts == {"/position": 9, "/bar": 1}
        assert reader.complete


def test_types_of_others_are_kept(tmp_path: Path) -> None:
    file = tmp_path / "foreign.mcap"
    with file.open("wb") as stream:
        writer: Any = Writer(stream, compression=CompressionType.LZ4)
        writer.start(profile="ros2")
        schema = writer.register_schema("foo_msgs/msg/Bar", "ros2msg", b"int32 baz")
        channel = writer.register_channel("/bar", "cdr", schema)
        writer.add_message(channel, log_time=5, data=b"\0\1\0\0\7\0\0\0", publish_time=5)
        writer.finish()
    recover.recover(file, tmp_path / "kept")
    with BagReader(tmp_path / "kept") as reader:
        (record,) = reader.messages()
        assert (record.topic, record.type, record.cdr, record.log_ns) == (
            "/bar",
            "foo_msgs/msg/Bar",
            b"\0\1\0\0\7\0\0\0",
            5,
        )
        assert reader.infos["/bar"].definition.text == "int32 baz"
        with pytest.raises(ValueError, match="/bar at 5 ns: message type = 'foo_msgs/msg/Bar'"):
            _ = record.message


def test_what_other_readers_refuse_is_left_out_and_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    both = cdr_beside("/foo", TEXT, b"\0\1\0\0\1\0\0\0\0"), cdr_beside("/foo", NUMBER, bytes(12), bytes(12))
    file = write_beside(tmp_path / "x.mcap", JSON, *both)
    assert recover.main([str(file), "--output", str(tmp_path / "whole"), "--json", "-"]) == 0
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert summary["messages"] == {"/brake_pressure": 3, "/position": 3, "/foo": 1}
    assert (summary["left_out"], summary["complete"]) == ({"/foo": 2, "/log": 2}, False)
    assert [f"recover: {loss}" for loss in summary["damage"]] == err.splitlines()
    assert "recover: topic /log: encoding = 'json': only CDR (ROS 2) is read: 2 messages are left out" in err
    with AnyReader([tmp_path / "whole"]) as it:
        assert it.message_count == 7


def test_a_type_that_is_defined_otherwise_is_kept_as_it_is(tmp_path: Path) -> None:
    """Whatever is asked to be dropped: by its own definition it decodes."""
    other = Definition("ros2msg", "int8 data\n")
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/ours", NUMBER)
        writer.add_topic("/theirs", NUMBER, known_as=other)
        for name, cdr in {"/ours": bytes(12), "/theirs": b"\0\1\0\0\7"}.items():
            writer.write(name, NUMBER, cdr, 0)
    summary = recover.recover(tmp_path / "bag", tmp_path / "whole", drop_undecodable=True)
    assert (summary["messages"], summary["complete"]) == ({"/ours": 1, "/theirs": 1}, True)
    with BagReader(tmp_path / "whole") as reader:
        assert [reader.infos[name].definition for name in ("/ours", "/theirs")] == [definition(NUMBER), other]
    summary = recover.recover(tmp_path / "bag", tmp_path / "whole2")
    with Reader(tmp_path / "whole2") as it:
        assert [connection.digest for connection in it.connections] == [type_hash(NUMBER), ""]


@pytest.mark.parametrize("turned", [1, -1])
def test_what_a_later_file_defines_otherwise_is_left_out_and_counted(turned: int, tmp_path: Path) -> None:
    """Under the definition of the first file it would be read as something else."""
    defined = [Definition("ros2msg", "int8 data\n"), definition(NUMBER)][::turned]
    (tmp_path / "bag").mkdir()
    for number, known_as in enumerate(defined):
        with BagWriter(tmp_path / str(number)) as writer:
            writer.add_topic("/foo", NUMBER, known_as=known_as)
            writer.write("/foo", NUMBER, bytes(12) if known_as == definition(NUMBER) else b"\0\1\0\0\7", number)
        (tmp_path / str(number) / "bag_0.mcap").rename(tmp_path / "bag" / f"bag_{number}.mcap")
    summary = recover.recover(tmp_path / "bag", tmp_path / "whole")
    assert (summary["messages"], summary["left_out"]) == ({"/foo": 1}, {"/foo": 1})
    with BagReader(tmp_path / "whole") as reader:
        assert reader.infos["/foo"].definition == defined[0]


@pytest.mark.parametrize("content", [b"", b"garbage" * 50])
def test_nothing_to_recover(tmp_path: Path, content: bytes, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.mcap").write_bytes(content)
    assert recover.main([str(tmp_path / "x.mcap"), "--output", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("recover: ")
    assert "name another recording" in line
    assert not (tmp_path / "out").exists()


def test_the_output_is_never_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    interrupted(tmp_path / "bag", 200)
    assert recover.main([str(tmp_path / "bag"), "--output", str(tmp_path / "bag")]) == 2
    assert "it exists already" in capsys.readouterr().err
    with BagReader(tmp_path / "bag") as reader:
        assert reader.counts["/position"] > 0


def test_bad_usage_is_code_2(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        recover.main(["bag"])
    assert end.value.code == 2
    assert "--output" in capsys.readouterr().err


def test_it_says_what_is_lost_where_the_metadata_tells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with BagWriter(tmp_path / "bag", Limits(max_duration_ns=10 * S)) as writer:
        for step in range(40):
            writer.write("/position", POSITION.type, cdrs.position(step * S, step / 3, 0.25), step * S)
    (tmp_path / "bag" / file_name(1)).unlink()
    cut(tmp_path / "bag" / file_name(3))
    assert recover.main([str(tmp_path / "bag"), "--output", str(tmp_path / "whole"), "--json", "-"]) == 0
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert (summary["messages"], summary["lost"]) == ({"/position": 20}, {"/position": 20})
    assert [f"recover: {loss}" for loss in summary["damage"]] == err.splitlines()
    last, missing, lost = summary["damage"]
    assert f"{file_name(3)} breaks off at byte" in last
    assert last.endswith(" bytes there are left out")
    assert missing == f"{tmp_path / 'bag' / file_name(1)} is missing"
    assert lost == "/position: 20 messages are lost"


def cut(file: Path) -> None:
    """Cut a file of one chunk within its chunk."""
    with file.open("r+b") as stream:
        stream.truncate(stream.seek(0, 2) // 5)


def test_a_complete_recording_without_metadata_gets_it(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        writer.write("/position", POSITION.type, cdrs.position(0, 0.0, 0.25), 0)
    (tmp_path / "bag" / "metadata.yaml").unlink()
    summary = recover.recover(tmp_path / "bag", tmp_path / "whole")
    assert summary["damage"] == [f"{tmp_path / 'bag'} has no readable metadata.yaml: its recording was interrupted"]
    assert summary["messages"] == {"/position": 1}
    with Reader(tmp_path / "whole") as reader:
        assert reader.message_count == 1


def test_a_full_disk_leaves_nothing_half_recovered(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Neither when it is full from the beginning, nor when it fills up on the way."""
    rng = np.random.default_rng(1)
    with BagWriter(tmp_path / "bag") as writer:
        for step in range(200):
            writer.write("/text", "std_msgs/msg/String", rng.bytes(5000), step * S)
    for size in (100_000, 700_000):
        with file_size_limit(size):
            assert recover.main([str(tmp_path / "bag"), "--output", str(tmp_path / "whole")]) == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"recover: {tmp_path / 'whole'}")
        assert "File too large" in line
        assert not (tmp_path / "whole").exists()
