# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a topic's publishers offer goes through a recording into the player: who subscribes late sees no difference."""

from __future__ import annotations

import time
from copy import copy
from pathlib import Path

import pytest
from conftest import SpinUntil
from messages import message_class
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSProfile
from rclpy.serialization import serialize_message
from recorders import stamped
from rosbags.interfaces import ConnectionExtRosbag2, QosDurability, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import Reader
from test_replay_waits import turned_by_hand

from adhesion_node.bag import BagReader, BagWriter, select_from
from adhesion_node.bag.qos import FOREVER
from adhesion_node.nodes import offers
from adhesion_node.nodes.player import Replay
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.nodes.ros.qos import EXPIRING, LATCHED, SENSOR_SUBSCRIPTION, subscribe
from adhesion_node.tools.recover import recover
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKING_CURVE, POSITION

S = 10**9


def record(
    path: Path, topic: Topic, profiles: list[QoSProfile], executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> BagReader:
    """Record one message of each publisher, under a remapped name."""
    context = executor.context
    remapped = ["--ros-args", "-r", f"{topic.name}:=elsewhere"]
    recording = Recorder(path, context=context, cli_args=remapped)
    executor.add_node(recording)
    talker = Node("talker", context=context, cli_args=remapped)
    executor.add_node(talker)
    ends = [talker.create_publisher(message_class(topic), topic.name, profile) for profile in profiles]
    spin_until(executor, lambda: all(end.get_subscription_count() for end in ends))
    spin_until(executor, lambda: recording.count_publishers("elsewhere") == len(ends))
    for number, end in enumerate(ends):
        end.publish(stamped(topic, number + 1))
    spin_until(executor, lambda: recording.counts == {"/elsewhere": len(ends)})
    recording.close()
    for node in (recording, talker):
        executor.remove_node(node)
        node.destroy_node()
    return BagReader(path)


def test_a_recording_says_what_the_publishers_offered(
    tmp_path: Path, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    with record(tmp_path / "bag", BRAKING_CURVE, [EXPIRING], executor, spin_until) as reader:
        (offered,) = reader.infos["/elsewhere"].offered
    assert (offered.reliability, offered.durability) == (QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL)
    assert (offered.lifespan, offered.deadline) == (QosTime(5, 0), FOREVER)
    recover(tmp_path / "bag", tmp_path / "again")
    for path in (tmp_path / "bag", tmp_path / "again"):
        with Reader(path) as other:  # metadata.yaml, by another reader
            (connection,) = other.connections
            assert isinstance(connection.ext, ConnectionExtRosbag2)
            assert connection.ext.offered_qos_profiles == [offered]


def test_each_kind_of_publisher_stands_once(
    tmp_path: Path, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    alive = QoSProfile(
        depth=3, liveliness=LivelinessPolicy.MANUAL_BY_TOPIC, liveliness_lease_duration=Duration(seconds=2)
    )
    profiles = [SENSOR_SUBSCRIPTION, alive, SENSOR_SUBSCRIPTION]
    with record(tmp_path / "bag", POSITION, profiles, executor, spin_until) as reader:
        offered = reader.infos["/elsewhere"].offered
    assert {(one.reliability, one.liveliness, one.liveliness_lease_duration) for one in offered} == {
        (QosReliability.BEST_EFFORT, QosLiveliness.AUTOMATIC, FOREVER),
        (QosReliability.RELIABLE, QosLiveliness.MANUAL_BY_TOPIC, QosTime(2, 0)),
    }
    assert len(offered) == 2


def test_a_publisher_that_has_gone_counts_as_one_of_ours(context: Context, executor: SingleThreadedExecutor) -> None:
    node = Node("nobody", context=context)
    executor.add_node(node)
    (curve,) = offers.offered(node, BRAKING_CURVE)
    assert (curve.durability, curve.lifespan) == (QosDurability.TRANSIENT_LOCAL, QosTime(5, 0))


@pytest.mark.parametrize(("lifespan_s", "waits"), [(3600.0, True), (0.2, False)])
def test_a_played_curve_waits_for_who_comes_late_until_it_is_too_old(
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    monkeypatch: pytest.MonkeyPatch,
    lifespan_s: float,
    waits: bool,
) -> None:
    """The test turns the player's clock, which stands until the first curve is too old or has been heard."""
    expiring = copy(EXPIRING)
    expiring.lifespan = Duration(seconds=lifespan_s)
    with record(tmp_path / "live", BRAKING_CURVE, [expiring], executor, spin_until) as reader:
        (only,) = reader.messages()
        with BagWriter(tmp_path / "bag") as writer:  # the same topic with a curve a second
            writer.add_topic(only.topic, only.type, offered=reader.infos[only.topic].offered)
            for second in range(1, 61):
                cdr = serialize_message(stamped(BRAKING_CURVE, second * S))
                writer.write(only.topic, only.type, cdr, second * S)
    now_ms, heard = turned_by_hand(monkeypatch), list[int]()
    late = Node("late", context=context)
    executor.add_node(late)
    with BagReader(tmp_path / "bag") as played:
        player = Replay(played, select_from(played, [], ["/elsewhere"]), subscribers=0, context=context)
        executor.add_node(player)
        spin_until(executor, lambda: player.published["/elsewhere"] == 1)
        expired_s = time.monotonic() + lifespan_s + 1.0
        spin_until(executor, lambda: waits or time.monotonic() > expired_s)
        topic = BRAKING_CURVE._replace(name="elsewhere")
        joined = subscribe(late, topic, lambda curve: heard.append(curve.header.stamp.sec), LATCHED)
        spin_until(executor, lambda: joined.get_publisher_count() and (heard or not waits))

        def heard_of_later() -> bool:
            now_ms[0] += 1000
            return bool(heard) and heard[-1] > 1

        spin_until(executor, heard_of_later)
    assert (heard[0] == 1) is waits
