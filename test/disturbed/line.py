# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Simulator, estimator, ATP monitor and recorder as processes, and a node that listens to them and disturbs them."""

from __future__ import annotations

import random
import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from adhesion_node.core.atp.supervision import Level
from adhesion_node.wire import topics
from adhesion_node.wire.messages.parts import stamp_ns
from adhesion_node.wire.topic import Topic

from .kept import Recorded, Sent
from .process import Process

WATCHED = (topics.STATE, topics.ATP_STATUS)
"""Reliable topics, of which a recording must hold all that was sent."""

CLOCKED_NS = 10**9
"""Stamps above tell messages apart: our own floods have none, and a program's first ones, before it has a clock, have
the same ones in each of its lives."""

SIMULATED = ("--ros-args", "-p", "use_sim_time:=true")
FAR = ("-p", "target_position_m:=1000000.0", "-p", "target_speed_kmh:=0.0")


@dataclass
class Line:
    """The processes, and a node that listens to them and disturbs them."""

    folder: Path
    rng: random.Random
    seen: list[tuple[float, str]] = field(default_factory=list)
    """When a level was heard."""
    sent: Sent = field(default_factory=lambda: defaultdict(list))
    recorded: list[Recorded] = field(default_factory=list)
    epoch_s: float = 1000.0

    def __post_init__(self) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node

        from adhesion_node.nodes.ros import qos

        rclpy.init()
        self.qos, self.node = qos, Node("chaos")
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        for topic in WATCHED:
            qos.subscribe(self.node, topic, self._receiver(topic))
        self.clock = qos.advertise(self.node, topics.CLOCK)
        self.simulator = Process(
            "simulator", self.folder, "--ros-args", "-p", "scenario:=long_braking", "-p", "exit_at_end:=false"
        )
        self.estimator = Process("estimator", self.folder, *SIMULATED)
        self.monitor = Process("atp_monitor", self.folder, *SIMULATED, *FAR)
        self.recorder = Process("recorder", self.folder, "--output", str(self._next_bag()))

    @property
    def processes(self) -> tuple[Process, ...]:
        return self.simulator, self.estimator, self.monitor, self.recorder

    def _receiver(self, topic: Topic) -> Callable[..., None]:
        def receive(message: Any, info: Mapping[str, int]) -> None:
            now_s = time.time()
            if (stamp := stamp_ns(message.header)) > CLOCKED_NS:
                self.sent[topic.name].append((info["source_timestamp"] / 1e9, stamp))
            if topic is topics.ATP_STATUS:
                (status,) = message.status
                self.seen.append((now_s, next(pair.value for pair in status.values if pair.key == "level")))

        return receive

    def spin(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Listen for so long, or until something holds; say whether it does."""
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0.0:
            self.executor.spin_once(timeout_sec=min(left_s, 0.05))
            if until():
                return True
        return until()

    def heard(self, since_s: float, braked: bool) -> float | None:
        """When, after a time, a level was first heard that brakes, or that does not."""
        brake = Level.EMERGENCY_BRAKE.name
        return next((at_s for at_s, level in self.seen if at_s > since_s and (level == brake) == braked), None)

    def _next_bag(self) -> Path:
        self.recorded.append(Recorded(self.folder / f"bag_{len(self.recorded)}", time.time()))
        return self.recorded[-1].bag

    def begin_recorder(self) -> None:
        self.recorder.arguments = ("--output", str(self._next_bag()))
        self.recorder.begin()

    def kill_recorder(self) -> None:
        self.recorder.kill()
        self.recorded[-1] = self.recorded[-1]._replace(until_s=time.time())

    def again(self, by_s: float) -> None:
        """A simulator whose clock is ahead of the one before by so much."""
        self.epoch_s += by_s
        self.simulator.begin("-p", f"start_time_s:={self.epoch_s}")

    def flood(self, topic: Topic, message: Any, seconds: float, rate_hz: float) -> None:
        """Publish one message again and again, at such a rate at most."""
        output, end_s = self.qos.advertise(self.node, topic), time.monotonic() + seconds
        while time.monotonic() < end_s:
            output.publish(message)
            self.spin(1.0 / rate_hz)
        self.node.destroy_publisher(output)

    def flap(self, times: int) -> None:
        """Come and go as a publisher and as a subscriber."""
        for _ in range(times):
            ends = [self.qos.advertise(self.node, topic) for topic in (topics.POSITION, topics.STATE)]
            listener = self.qos.subscribe(self.node, topics.BRAKING_CURVE, lambda _: None)
            self.spin(0.1)
            self.node.destroy_subscription(listener)
            for end in ends:
                self.node.destroy_publisher(end)

    def set_clock(self, by_s: float) -> None:
        """Another time on /clock for 2 s, between those of the simulator: some judgements are to fall into it."""
        from adhesion_node.nodes.ros.types import new

        stamps = self.sent[topics.ATP_STATUS.name]  # heard before all else; the estimator may yet be to be found
        at_ns = max(stamps[-1][1] + round(by_s * 1e9), 0)
        for _ in range(100):
            self.clock.publish(topics.CLOCK.build(new, at_ns))
            self.spin(0.02)

    def message(self, topic: Topic) -> Any:
        """One without a number in it."""
        from adhesion_node.nodes.ros.types import message_class

        message = message_class(topic.type)()
        message.header.frame_id = "track"
        message.pose.pose.position.x = float("nan")
        return message
