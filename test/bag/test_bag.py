# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Recordings: round trips read back by three readers, equal bytes, order, what cannot be written."""

from __future__ import annotations

import hashlib
import itertools
from pathlib import Path
from typing import Any

import cdrs
import messages
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.serialization import deserialize_message, serialize_message
from recorded import LATCHED, S, filled, plain, ros_class, write_steps
from rosbags.interfaces import ConnectionExtRosbag2, QosDurability
from rosbags.rosbag2 import Reader

from adhesion_node.bag import BagReader, BagWriter, deserialize, serialize, typestore
from adhesion_node.bag.write.writer import file_name
from adhesion_node.wire.topics import BRAKE_PRESSURE, BRAKING_CURVE, MU, POSITION, RECORDED, WHEEL_SPEED


@pytest.fixture(scope="module")
def every_topic(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """A recording of one message of every recorded topic, encoded by rclpy, and those messages."""
    path = tmp_path_factory.mktemp("bag") / "every"
    numbers = itertools.count(1)
    messages = {topic.name: filled(topic.type, numbers) for topic in RECORDED}
    with BagWriter(path) as writer:
        for number, topic in enumerate(RECORDED):
            writer.add_topic(topic.name, topic.type, offered=[LATCHED] if topic is BRAKING_CURVE else [])
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


@pytest.mark.parametrize("axles", [1, 3, 12])
def test_bytes_behind_a_message_mean_nothing(axles: int) -> None:
    """As rclpy itself leaves them: it takes the most that the padding of names and numbers may come to."""
    message = messages.wheel_speed(7, [float(axle) for axle in range(axles)])
    written = bytes(serialize_message(message))
    exact = serialize(deserialize(written, WHEEL_SPEED.type), WHEEL_SPEED.type)
    assert len(written) > len(exact) + 3
    for tail in (b"", b"\0", b"\xff" * 100):
        assert plain(deserialize(exact + tail, WHEEL_SPEED.type)) == plain(message)


def test_serialising_again_clears_what_stands_in_the_padding() -> None:
    clean = cdrs.position(1, 2.0, 3.0)
    text_end = clean.index(b"track\0") + 6
    assert clean[text_end : text_end + 2] == b"\0\0", "this message has padding before its numbers"
    dirty = clean[:text_end] + b"\xab\xcd" + clean[text_end + 2 :]
    assert serialize(deserialize(dirty, POSITION.type), POSITION.type) == clean


def test_sensor_messages_say_what_they_should() -> None:
    position = deserialize(cdrs.position(1_500_000_001, 12.5, 0.25), POSITION.type)
    assert (position.header.stamp.sec, position.header.stamp.nanosec) == (1, 500_000_001)
    assert position.header.frame_id == "track"
    assert (position.pose.pose.position.x, position.pose.covariance[0]) == (12.5, 0.25)
    assert position.pose.pose.orientation.w == 1.0
    pressure = deserialize(cdrs.brake_pressure(7, 511325.0), BRAKE_PRESSURE.type)
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
        deserialize(cdrs.brake_pressure(0, 1.0), POSITION.type)
