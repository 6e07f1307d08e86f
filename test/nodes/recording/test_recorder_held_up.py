# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A recorder that is signalled, stopped or given no processor: what it has, and what it says that it has not."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import pytest
from conftest import SpinUntil
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from recorders import S, has_messages, recorded, recording_process, stamped, start
from rosbags.rosbag2 import Reader

from adhesion_node.bag import BagReader
from adhesion_node.nodes.ros.qos import SENSOR_PUBLISHER, advertise, subscribe
from adhesion_node.wire.topics import (
    DIAGNOSTICS,
    POSITION,
    STATE,
)


@pytest.fixture
def talking(context: Context, executor: SingleThreadedExecutor) -> tuple[Publisher, list[int]]:
    """A node that publishes a position every 10 ms once it is heard, and the stamps it has published."""
    talker = Node("talker", context=context)
    executor.add_node(talker)
    end = advertise(talker, POSITION, SENSOR_PUBLISHER)
    sent: list[int] = []

    def talk() -> None:
        if end.get_subscription_count():
            sent.append(len(sent) + 1)
            end.publish(stamped(POSITION, sent[-1]))

    talker.create_timer(0.01, talk)
    return end, sent


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_recording_properly(
    tmp_path: Path,
    talking: tuple[Publisher, list[int]],
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    number: signal.Signals,
) -> None:
    _, sent = talking
    with recording_process(tmp_path / "bag") as process:
        spin_until(executor, lambda: len(sent) >= 50 and has_messages(tmp_path / "bag"))
        process.send_signal(number)
        spin_until(executor, lambda: process.poll() is not None)
        out, err = process.communicate()
    assert process.returncode == 0
    assert out == ""
    assert "Traceback" not in err
    with BagReader(tmp_path / "bag") as reader, Reader(tmp_path / "bag") as other:
        assert reader.complete
        assert other.message_count == reader.counts["/position"] > 0


def test_a_recorder_that_was_not_given_the_processor_still_has_what_came_meanwhile(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [STATE, POSITION], False)
    for number in range(1, 801):
        for topic in (STATE, POSITION):
            ends[topic].publish(stamped(topic, number * S))
            assert ends[topic].wait_for_all_acked(Duration(seconds=10))
    spin_until(executor, lambda: len(recording.counts) == 2 and min(recording.counts.values()) == 800)
    recording.close()


def _number(status: Any, key: str) -> int:
    return next(int(pair.value) for pair in status.values if pair.key == key)


def test_what_a_stopped_recorder_has_lost_is_told(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """Of 5000 messages its publisher keeps the last 100; some more are on their way."""
    talker, told = Node("talker", context=context), []
    end = advertise(talker, STATE)
    subscribe(talker, DIAGNOSTICS, lambda message: told.append(message.status[0]))
    executor.add_node(talker)
    with recording_process(tmp_path / "bag", silent=("-p", "diagnostics_period_s:=0.1")) as process:
        spin_until(executor, lambda: end.get_subscription_count() > 0 and bool(told))
        end.publish(stamped(STATE, S))
        spin_until(executor, lambda: has_messages(tmp_path / "bag"))
        process.send_signal(signal.SIGSTOP)
        for number in range(5000):
            end.publish(stamped(STATE, (number + 2) * S))
        process.send_signal(signal.SIGCONT)
        spin_until(executor, lambda: "lost on the way" in told[-1].message)
        spin_until(executor, lambda: recorded(tmp_path / "bag")["/adhesion/state"] > 100)
        process.send_signal(signal.SIGINT)
        spin_until(executor, lambda: process.poll() is not None)
        _, err = process.communicate()
    with BagReader(tmp_path / "bag") as reader:
        kept = reader.counts["/adhesion/state"]
    lost = _number(told[-1], "lost")
    assert 100 <= kept < 5001
    assert 1 <= lost <= 5001 - kept
    assert "adhesion/state: messages lost on the way" in err
