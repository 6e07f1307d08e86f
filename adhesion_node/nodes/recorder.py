"""Records every topic of the package into a rosbag2 directory that stays readable if the recorder dies."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rclpy.clock import Clock as NodeClock
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

from .. import topics
from ..bag import BagWriter, deserialize, serialize
from ..cli import help_texts, run_tool
from . import runtime
from .qos import RESULT, SENSOR_SUBSCRIPTION, subscribe

EXAMPLES = ("recorder --output my_run", "recorder --output my_run --ros-args -p use_sim_time:=true -r __ns:=/train1")

FLUSH_S = 0.5
"""A killed recorder loses what came since the last flush, or the one before while /clock stands still."""

LATCHED = (topics.BRAKING_CURVE, topics.BRAKING_CURVE_NOMINAL)
LATCHED_SUBSCRIPTION = QoSProfile(
    depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""Also receives the curve published before the recorder came; deep, so that the next ones do not displace it."""


class _Message(NamedTuple):
    """A received message that waits for its log time. Sorts by the time of publishing."""

    published_ns: int
    arrival: int
    name: str
    type: str
    cdr: bytes
    stamp_ns: int


class Recorder(Node):
    """Records `topics.RECORDED` under their resolved names into the new directory `output`.

    The log time is the node's time: the system clock at arrival, or with `use_sim_time` the /clock in force when the
    message was published. The latter is found by the time stamps that DDS gives every sample, so a busy recorder does
    not shift a message without a header; it takes publishers on one host, or hosts with synchronised clocks. Until the
    first /clock, the header's stamp takes its place. `heard` counts the messages received by topic. Call `close` at
    the end. Raises ValueError when `output` exists.
    """

    def __init__(self, output: Path, **kwargs: Any) -> None:
        super().__init__("recorder", **kwargs)
        self._simulated = bool(self.get_parameter("use_sim_time").value)
        self._clock_ns: int | None = None
        self._last_ns = 0
        self.heard: Counter[topics.Topic] = Counter()
        self._arrivals = 0
        self._arrived_at_flush = 0
        self._pending: list[_Message] = []
        if self._simulated:
            # First, so that the executor hands over a /clock before the messages published after it.
            subscribe(self, topics.CLOCK, self._on_clock, SENSOR_SUBSCRIPTION)
        for topic in topics.RECORDED:
            subscribe(self, topic, self._receiver(topic), _profile(topic), raw=True)
        self.create_timer(FLUSH_S, self.flush, clock=NodeClock(clock_type=ClockType.STEADY_TIME))
        self._writer = BagWriter(output)
        self.get_logger().info(f"recording to {output}")

    @property
    def counts(self) -> dict[str, int]:
        """Messages recorded so far by topic."""
        return self._writer.counts

    def flush(self) -> None:
        """Hand everything that has its log time to the operating system.

        What already waited at the last flush goes with it: its /clock stands still or was the last one.
        """
        self._release(lambda message: message.arrival <= self._arrived_at_flush)
        self._arrived_at_flush = self._arrivals
        self._writer.flush()

    def close(self) -> None:
        """Write the rest, the index and the metadata."""
        self._release(lambda _: True)
        self._writer.close()
        self.get_logger().info(f"recorded {sum(self.counts.values())} messages to {self._writer.path}")

    def _receiver(self, topic: topics.Topic) -> Callable[..., None]:
        """Return the callback of a topic; with its second argument rclpy passes the time stamps of DDS."""
        name = self.resolve_topic_name(topic.name)

        def receive(cdr: bytes, info: Mapping[str, int]) -> None:
            self._writer.add_topic(name, topic.type, latched=topic in LATCHED)
            exact, stamp_ns = self._canonical(name, topic.type, cdr)
            self._arrivals += 1
            self.heard[topic] += 1
            message = _Message(info["source_timestamp"], self._arrivals, name, topic.type, exact, stamp_ns)
            if self._simulated:
                self._pending.append(message)
            else:
                self._write(message, self.get_clock().now().nanoseconds)

        return receive

    def _canonical(self, name: str, type_name: str, cdr: bytes) -> tuple[bytes, int]:
        """Return the message with its padding zeroed, so that equal runs give equal bytes, and its header's stamp."""
        try:
            message = deserialize(cdr, type_name)
        except ValueError as error:
            self.get_logger().warning(f"{name}: recorded as it came: {error}", throttle_duration_sec=10.0)
            return cdr, 0
        header = getattr(message, "header", None)
        stamp_ns = header.stamp.sec * 10**9 + header.stamp.nanosec if header else 0
        return serialize(message, type_name), stamp_ns

    def _on_clock(self, message: Clock, info: Mapping[str, int]) -> None:
        now_ns = message.clock.sec * 10**9 + message.clock.nanosec
        if self._clock_ns is None:
            self._clock_ns = now_ns
        published_ns = info["source_timestamp"]
        self._release(lambda message: message.published_ns < published_ns)
        self._clock_ns = now_ns

    def _release(self, ready: Callable[[_Message], bool]) -> None:
        """Write the waiting messages that are ready in the order of publishing."""
        for message in sorted(filter(ready, self._pending)):
            self._write(message, self._clock_ns if self._clock_ns is not None else message.stamp_ns or self._last_ns)
        self._pending = [message for message in self._pending if not ready(message)]

    def _write(self, message: _Message, log_ns: int) -> None:
        self._last_ns = log_ns
        self._writer.write(message.name, message.type, message.cdr, log_ns)


def main(args: Sequence[str] | None = None) -> int:
    """Run `recorder --output DIR [--ros-args ...]` until a signal."""
    own, ros = runtime.split_ros_arguments(sys.argv[1:] if args is None else args)
    parser = argparse.ArgumentParser(
        "recorder", usage="%(prog)s --output DIR [--ros-args ...]", **help_texts(__doc__, *EXAMPLES)
    )
    parser.add_argument("--output", metavar="DIR", required=True, help="the recording, a new directory")
    return run_tool(parser, lambda options: runtime.run(lambda: Recorder(Path(options.output)), ros), own)


def _profile(topic: topics.Topic) -> QoSProfile:
    if topic in LATCHED:
        return LATCHED_SUBSCRIPTION
    sensors = (*topics.SENSORS, *topics.CREEP_SENSORS, *topics.TRUTH)
    return SENSOR_SUBSCRIPTION if topic in sensors else RESULT
