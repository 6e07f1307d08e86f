# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Recordings: round trips read back by three readers, equal bytes, interruption, truncation, damage, other forms."""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.summary import Summary
from mcap_ros2.decoder import DecoderFactory
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.interfaces import ConnectionExtRosbag2, QosDurability
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer

from adhesion_node.bag import (
    BagReader,
    BagWriter,
    Record,
    deserialize,
    parse_remap,
    select,
    sensors,
    serialize,
    typestore,
)
from adhesion_node.bag.writer import file_name
from adhesion_node.topics import BRAKE_PRESSURE, BRAKING_CURVE, CLOCK, MU, POSITION, RECORDED, WHEEL_SPEED

S = 10**9


def ros_class(type_name: str) -> type[Any]:
    package, *_, name = type_name.split("/")
    found: type[Any] = getattr(import_module(f"{package}.msg"), name)
    return found


def filled(type_name: str, numbers: Iterator[int]) -> Any:
    """Return an rclpy message with another value in every field, sequences of two."""
    message = ros_class(type_name)()
    for field, kind in message.get_fields_and_field_types().items():
        element = kind.removeprefix("sequence<").removesuffix(">").split("[")[0].split(",")[0]
        count = int(kind.split("[")[1][:-1]) if "[" in kind else 2
        values = [_value(element, numbers) for _ in range(count)]
        setattr(message, field, values if "[" in kind or kind.startswith("sequence") else values[0])
    return message


def _value(element: str, numbers: Iterator[int]) -> Any:
    number = next(numbers)
    if "/" in element:
        return filled(element, numbers)
    if element == "string":
        return f"text {number}"
    if element == "octet":
        return bytes([number % 100])
    return number + 0.5 if element in ("double", "float") else number % 100


def plain(value: Any) -> Any:
    """Return a message of any of the libraries as nested dicts and lists."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value)]  # among them the message's constants, OK = 0
        return {name: plain(getattr(value, name)) for name in names if name.islower() and name != "__msgtype__"}
    if hasattr(value, "__slots__") and not isinstance(value, (np.ndarray, np.generic, bytes)):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, bytes):
        return value[0]
    if isinstance(value, (list, tuple, np.ndarray)) or hasattr(value, "tolist"):
        listed = value.tolist() if hasattr(value, "tolist") else value
        return [plain(item) for item in listed] if isinstance(listed, (list, tuple)) else listed
    return value


def write_steps(path: Path, steps: int, first: int = 0) -> list[Record]:
    """Write positions and pressures at 10 Hz and return what was written."""
    records = []
    for step in range(first, first + steps):
        t_ns = step * S // 10
        records.append(Record("/brake_pressure", BRAKE_PRESSURE.type, sensors.brake_pressure(t_ns, 101325.0), t_ns))
        records.append(Record("/position", POSITION.type, sensors.position(t_ns, step / 3, 0.25), t_ns))
    with BagWriter(path) as writer:
        for record in records:
            writer.write(*record)
    return records


@pytest.fixture(scope="module")
def every_topic(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """A recording of one message of every recorded topic, encoded by rclpy, and those messages."""
    path = tmp_path_factory.mktemp("bag") / "every"
    numbers = itertools.count(1)
    messages = {topic.name: filled(topic.type, numbers) for topic in RECORDED}
    with BagWriter(path) as writer:
        for number, topic in enumerate(RECORDED):
            writer.add_topic(topic.name, topic.type, latched=topic is BRAKING_CURVE)
            writer.write(topic.name, topic.type, serialize_message(messages[topic.name]), S + number)
    return path, messages


def test_every_recorded_topic_comes_back(every_topic: tuple[Path, dict[str, Any]]) -> None:
    path, messages = every_topic
    with BagReader(path) as reader:
        records = list(reader.messages())
        assert reader.topics == {topic.name: topic.type for topic in RECORDED}
        assert reader.complete
        assert reader.damage == ()
    assert [(record.topic, record.log_ns) for record in records] == [
        (topic.name, S + number) for number, topic in enumerate(RECORDED)
    ]
    for record in records:
        assert plain(record.message) == plain(messages[record.topic]), record.topic


def test_rosbags_reads_it(every_topic: tuple[Path, dict[str, Any]]) -> None:
    path, messages = every_topic
    with Reader(path) as reader:
        read = {connection.topic: (log_ns, bytes(cdr)) for connection, log_ns, cdr in reader.messages()}
        types = {connection.topic: connection.msgtype for connection in reader.connections}
        durable = {
            connection.topic
            for connection in reader.connections
            if isinstance(connection.ext, ConnectionExtRosbag2)
            and connection.ext.offered_qos_profiles[0].durability is QosDurability.TRANSIENT_LOCAL
        }
        assert (reader.message_count, reader.start_time, reader.duration) == (len(RECORDED), S, len(RECORDED))
    assert durable == {BRAKING_CURVE.name}
    for number, topic in enumerate(RECORDED):
        log_ns, cdr = read[topic.name]
        assert log_ns == S + number
        assert plain(typestore().deserialize_cdr(cdr, types[topic.name])) == plain(messages[topic.name])


def test_mcap_with_its_own_ros2_decoder_reads_it(every_topic: tuple[Path, dict[str, Any]]) -> None:
    path, messages = every_topic
    with (path / file_name(0)).open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        read = {channel.topic: (message, decoded) for _, channel, message, decoded in reader.iter_decoded_messages()}
    for number, topic in enumerate(RECORDED):
        message, decoded = read[topic.name]
        assert (message.log_time, message.publish_time) == (S + number, S + number)
        assert plain(decoded) == plain(messages[topic.name]), topic.name


def test_ros_decodes_our_serialisation() -> None:
    for number, topic in enumerate(RECORDED):
        message = filled(topic.type, itertools.count(number))
        ours = serialize(deserialize(serialize_message(message), topic.type), topic.type)
        assert plain(deserialize_message(ours, ros_class(topic.type))) == plain(message), topic.name


def test_serialising_again_clears_what_stands_in_the_padding() -> None:
    clean = sensors.position(1, 2.0, 3.0)
    text_end = clean.index(b"track\0") + 6
    assert clean[text_end : text_end + 2] == b"\0\0", "this message has padding before its numbers"
    dirty = clean[:text_end] + b"\xab\xcd" + clean[text_end + 2 :]
    assert serialize(deserialize(dirty, POSITION.type), POSITION.type) == clean


def test_sensor_messages_say_what_they_should() -> None:
    position = deserialize(sensors.position(1_500_000_001, 12.5, 0.25), POSITION.type)
    assert (position.header.stamp.sec, position.header.stamp.nanosec) == (1, 500_000_001)
    assert position.header.frame_id == "track"
    assert (position.pose.pose.position.x, position.pose.covariance[0]) == (12.5, 0.25)
    assert position.pose.pose.orientation.w == 1.0
    pressure = deserialize(sensors.brake_pressure(7, 511325.0), BRAKE_PRESSURE.type)
    assert (pressure.header.stamp.nanosec, pressure.fluid_pressure) == (7, 511325.0)


def test_equal_messages_give_equal_files(tmp_path: Path) -> None:
    write_steps(tmp_path / "one", 500)
    write_steps(tmp_path / "two", 500)
    write_steps(tmp_path / "other", 500, first=1)
    one, two, other = (
        [hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted((tmp_path / name).iterdir())]
        for name in ("one", "two", "other")
    )
    assert one == two
    assert len(one) == 2
    assert all(ours != theirs for ours, theirs in zip(one, other, strict=True))


def test_messages_come_in_the_order_of_log_time_then_arrival(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    times = rng.integers(0, 300, size=4000).tolist()
    with BagWriter(tmp_path / "bag") as writer:
        for number, t_ns in enumerate(times):
            cdr = serialize(typestore().types[MU.type](data=float(number)), MU.type)
            writer.write("/adhesion/mu", MU.type, cdr, t_ns)
            if number % 700 == 0:
                writer.flush()
    with BagReader(tmp_path / "bag") as reader:
        read = [(record.log_ns, int(record.message.data)) for record in reader.messages()]
    assert read == sorted((t_ns, number) for number, t_ns in enumerate(times))


def test_messages_of_chosen_topics_with_or_without_slash(tmp_path: Path) -> None:
    written = write_steps(tmp_path / "bag", 3)
    with BagReader(tmp_path / "bag") as reader:
        assert list(reader.messages(["position", "nowhere"])) == written[1::2]
        assert list(reader.messages(["/position"])) == written[1::2]
        assert list(reader.messages()) == written
        assert reader.counts == {"/brake_pressure": 3, "/position": 3}


def test_a_recording_may_be_renamed_and_is_never_overwritten(tmp_path: Path) -> None:
    written = write_steps(tmp_path / "bag", 3)
    (tmp_path / "bag").rename(tmp_path / "moved")
    with Reader(tmp_path / "moved") as reader:
        assert reader.message_count == len(written)
    with pytest.raises(ValueError, match=r"output = '.*moved': it exists already, give the name of a new directory"):
        BagWriter(tmp_path / "moved")
    with Reader(tmp_path / "moved") as reader:
        assert reader.message_count == len(written)


def test_an_empty_recording_is_one(tmp_path: Path) -> None:
    BagWriter(tmp_path / "bag").close()
    with BagReader(tmp_path / "bag") as reader, Reader(tmp_path / "bag") as plain_reader:
        assert (reader.topics, reader.complete, list(reader.messages())) == ({}, True, [])
        assert plain_reader.message_count == 0


def test_what_cannot_be_written_is_refused_by_name(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        writer.write("/position", POSITION.type, b"", 0)
        with pytest.raises(ValueError, match="topic /position: type = std_msgs/msg/Float64: the recording holds it as"):
            writer.write("/position", MU.type, b"", 0)
        with pytest.raises(ValueError, match=r"log time = -1 ns: give nanoseconds from 0"):
            writer.write("/position", POSITION.type, b"", -1)
        with pytest.raises(ValueError, match=r"message type = 'foo_msgs/msg/Bar'"):
            writer.write("/bar", "foo_msgs/msg/Bar", b"", 0)
    with (
        BagReader(tmp_path / "bag") as reader,
        pytest.raises(ValueError, match="/position at 0 ns: message of 0 bytes"),
    ):
        _ = next(reader.messages()).message
    with pytest.raises(ValueError, match=f"does not decode as {POSITION.type}"):
        deserialize(sensors.brake_pressure(0, 1.0), POSITION.type)


WRITER_THAT_IS_KILLED = """
import sys
from adhesion_node.bag import BagWriter, sensors
from adhesion_node.topics import POSITION
writer = BagWriter(sys.argv[1])
step = 0
while True:
    writer.write("/position", POSITION.type, sensors.position(step * 10**7, step / 7, 0.25), step * 10**7)
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
    written = [
        Record(topic, POSITION.type, sensors.position(step * S, float(step), 0.25), step * S) for step in range(50)
    ]
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


RECORDED_ELSEWHERE = {"/odo/pose": POSITION.type, "/brake_pressure": BRAKE_PRESSURE.type, "/x": MU.type}


def test_selection_renames_and_takes_sensors_and_truth_alone() -> None:
    own = {f"/{topic.name}": topic.type for topic in RECORDED} | {CLOCK.name: CLOCK.type}
    sensors = ("position", "brake_pressure", "speed", "wheel_speed", "traction_force")
    assert select(own) == {f"/{name}": name for name in (*sensors, "truth/state", "truth/mu")}
    creep = {"/wheel_speed": WHEEL_SPEED.type}
    assert select(creep) == {"/wheel_speed": "wheel_speed"}, "a recording for the creep curve needs no position"
    remapped = select(RECORDED_ELSEWHERE, [parse_remap("odo/pose:=/position")])
    assert remapped == {"/odo/pose": "position", "/brake_pressure": "brake_pressure"}
    assert select(RECORDED_ELSEWHERE, [], ["brake_pressure", "/x"]) == {"/brake_pressure": "brake_pressure", "/x": "/x"}
    displaced = select(own | {"/gnss": POSITION.type}, [("/gnss", "position")], ["position"])
    assert displaced == {"/gnss": "position"}


@pytest.mark.parametrize(
    ("remaps", "names", "message"),
    [
        ([], None, r"topic position: not in the recording\. It holds: /brake_pressure \(.*--remap /odo/pose:=position"),
        ([("/odo", "position")], None, r"remap from /odo: not in the recording\. It holds: .*--remap /odo/pose:="),
        ([("/x", "position")], None, r"topic /x: type = std_msgs/msg/Float64: position needs geometry_msgs/msg/Pose"),
        ([], ["speed"], r"topic speed: not in the recording\. .*--remap /recorded/name:=speed"),
    ],
)
def test_a_selection_that_does_not_fit_says_so(
    remaps: list[tuple[str, str]], names: list[str] | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        select(RECORDED_ELSEWHERE, remaps, names)


@pytest.mark.parametrize("text", ["", "a", "a:=", ":=b", "a:=b:=c", "/:=b"])
def test_a_remap_without_two_names_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"write FROM:=TO, for instance /odometry/position:=position"):
        parse_remap(text)
