# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A recorder, in this process or in one of its own, and who publishes for it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from conftest import SpinUntil
from messages import message_class
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock

from adhesion_node.bag import BagReader, Limits
from adhesion_node.nodes import recorder
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.nodes.ros.qos import LATCHED, RESULT, SENSOR_PUBLISHER, advertise
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import (
    BRAKING_CURVE,
    BRAKING_CURVE_NOMINAL,
    CLOCK,
    SENSORS,
    TRUTH,
)

S = 10**9
SILENT = [Parameter("diagnostics_period_s", value=3600.0)]
"""What the recorder says of itself once a second would be recorded."""


def publishers(node: Node, *topics: Topic) -> dict[Topic, Publisher]:
    return {topic: advertise(node, topic, _profile(topic)) for topic in topics}


def _profile(topic: Topic) -> Any:
    if topic in (BRAKING_CURVE, BRAKING_CURVE_NOMINAL):
        return LATCHED
    return SENSOR_PUBLISHER if topic in (*SENSORS, *TRUTH) else RESULT


def stamped(topic: Topic, t_ns: int) -> Any:
    message = message_class(topic)()
    if hasattr(message, "header"):
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(t_ns, S)
    return message


def clock(t_ns: int) -> Clock:
    message = Clock()
    message.clock.sec, message.clock.nanosec = divmod(t_ns, S)
    return message


def simulated() -> list[Parameter]:
    return [Parameter("use_sim_time", value=True), *SILENT]


def start(
    path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    topics: list[Topic],
    sim: bool,
    limits: Limits = recorder.LIMITS,
) -> tuple[Recorder, dict[Topic, Publisher]]:
    """Return a recorder and publishers of `topics` and /clock that have found each other."""
    talker = Node("talker", context=context, namespace="/train1")
    ends = publishers(talker, *topics, CLOCK)
    given = simulated() if sim else SILENT
    recording = Recorder(path, limits, context=context, namespace="/train1", parameter_overrides=given)
    executor.add_node(talker)
    executor.add_node(recording)
    heard = [end for topic, end in ends.items() if sim or topic is not CLOCK]
    spin_until(executor, lambda: all(end.get_subscription_count() > 0 for end in heard))
    return recording, ends


@contextmanager
def recording_process(
    path: Path, *arguments: str, silent: Sequence[str] = ("-p", "diagnostics_period_s:=3600.0")
) -> Iterator[subprocess.Popen[str]]:
    """Run the program; it does not outlive a test that fails."""
    private = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")
    environment = {name: value for name, value in os.environ.items() if name not in private}
    code = "import sys; from adhesion_node.nodes.recorder import main; sys.exit(main())"
    command = [sys.executable, "-c", code, "--output", str(path), *arguments, "--ros-args", *silent]
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def recorded(bag: Path) -> Counter[str]:
    """Count the messages by topic that a recording in progress has on the disk."""
    try:
        with BagReader(bag) as reader:
            return Counter(reader.counts)
    except ValueError:
        return Counter()


def has_messages(bag: Path) -> bool:
    """Tell whether a recording in progress has messages on the disk."""
    return bool(recorded(bag))
