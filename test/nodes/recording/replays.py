# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Who listens to a replay, and the program in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from messages import message_class
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from adhesion_node.bag import Record
from adhesion_node.nodes.ros.qos import SENSOR_SUBSCRIPTION, subscribe
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import CLOCK

S = 10**9
UNLIMITED = QoSProfile(history=HistoryPolicy.KEEP_ALL, depth=1, reliability=ReliabilityPolicy.RELIABLE)


class Listener(Node):
    """Keeps the raw bytes of each topic in the order of arrival, and the times of /clock."""

    def __init__(self, context: Context, *topics: Topic, profile: QoSProfile = SENSOR_SUBSCRIPTION) -> None:
        super().__init__("listener", context=context)
        self.heard: list[tuple[str, bytes]] = []
        self.clock: list[int] = []
        for topic in topics:
            self._listen(topic, profile)
        subscribe(self, CLOCK, self._on_clock, profile)

    def _listen(self, topic: Topic, profile: QoSProfile) -> None:
        def keep(cdr: bytes) -> None:
            self.heard.append((topic.name, cdr))

        self.create_subscription(message_class(topic), topic.name, keep, profile, raw=True)

    def _on_clock(self, message: Any) -> None:
        self.clock.append(message.clock.sec * S + message.clock.nanosec)

    def of(self, topic: Topic) -> list[bytes]:
        return [cdr for name, cdr in self.heard if name == topic.name]


def of(written: list[Record], topic: str) -> list[bytes]:
    return [record.cdr for record in written if record.topic == topic]


REPLAY = [sys.executable, "-c", "import sys; from adhesion_node.nodes.replay import main; sys.exit(main())"]


@contextmanager
def replay_process(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Run the program; it does not outlive a test that fails."""
    private = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")
    environment = {name: value for name, value in os.environ.items() if name not in private}
    with subprocess.Popen(
        [*REPLAY, *arguments], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()
