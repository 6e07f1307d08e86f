# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Records every topic of the package into a rosbag2 directory that stays readable if the recorder dies."""

import argparse
import math
import sys
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.clock import Clock as NodeClock
from rclpy.clock import ClockType
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from ..bag import BagWriter, Limits, deserialize, serialize
from ..bag.write.writer import MB
from ..command.checks import at_least
from ..command.options import help_texts, run_tool
from ..core.atp.supervision import Severity
from ..wire import topics
from ..wire.messages.parts import stamp_ns
from ..wire.settings.telling import TELLING
from ..wire.topic import Topic
from .offers import offered
from .ros import runtime
from .ros.diagnostics import JUMP_NS, Diagnostics, Finding, Told, doubled, unlike
from .ros.params import SettingsNode, declare
from .ros.qos import PROFILES, subscribe
from .waiting import Message, Waiting

EXAMPLES = ("recorder --output my_run", "recorder --output my_run --ros-args -p use_sim_time:=true -r __ns:=/train1")

SPAN_NS = 200_000_000
"""Log time in a chunk. A message waits for two more /clock and for its chunk to end: 0.3 s with a /clock of 10 Hz."""

ROUND_S = 0.1
ROUNDS = 5
"""A message that log time has not brought to the disk goes there after so many rounds of the system's clock: /clock
stands still or is slow. A busy machine misses rounds, so it does not change what equal runs leave, as a deadline would.
"""

NO_CLOCK = "no /clock yet, what comes waits for it: is the simulator running? Else leave use_sim_time out"

WENT_BACK = f"time went back by more than {JUMP_NS * 1e-9:g} s: does a recording loop, is there a second /clock?"

MIN_FREE_MB = 100.0

MAX_DURATION_S = 1800.0
"""Of a file: its index, which stays in memory until its end, grows by 7 kB a second."""

LIMITS = Limits(span_ns=SPAN_NS, min_free_bytes=MIN_FREE_MB * MB)

DEPTH = 2000
"""Messages of a topic that wait while the recorder is not given the processor: 20 s of 100 Hz. DDS does not tell of
those beyond, but of those that a publisher has given up meanwhile; it keeps 100 for a recorder that is stopped."""

LATCHED_SUBSCRIPTION = QoSProfile(
    depth=DEPTH, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
"""Also receives the curve published before the recorder came."""


class Recorder(SettingsNode):
    """Records `topics.RECORDED` under their resolved names into the new directory `output`.

    The log time is that of the system clock at arrival, or with `use_sim_time` at the start the /clock in force when
    the message was published. The latter is found by the time stamps that DDS gives every sample, so a busy recorder
    does not shift a message without a header; it takes publishers on one host, or hosts with synchronised clocks.

    What comes before the first /clock waits for it, the newest `waiting.HELD` messages: it is of its header's stamp
    where that is of the same time, else of the first /clock. So a recording begins when its time begins. Where /clock
    never comes the stamps stand for it.

    `heard` counts the messages received by topic. Call `close` at the end. Raises ValueError when `output` exists. A
    callback or `close` raises OSError when the disk is full; `close` makes the recording complete up to there all the
    same.
    """

    def __init__(self, output: Path, limits: Limits = LIMITS, *, by_log_time: bool = False, **kwargs: Any) -> None:
        """Begin a recording; with `by_log_time` only log time brings messages to the disk.

        That is for a /clock that does not stand still, and leaves equal bytes on the slowest machine too.
        """
        super().__init__("recorder", automatically_declare_parameters_from_overrides=True, **kwargs)
        values = declare(self, TELLING, quiet=True)
        self._simulated = bool(self.get_parameter("use_sim_time").value)
        self.heard: Counter[Topic] = Counter()
        self._arrivals = 0
        self._rounds = deque([0] * ROUNDS, maxlen=ROUNDS)
        """Arrivals at the latest rounds."""
        self._oldest_unsaved = 0
        self._latest_ns, self._went_back = 0, False
        self._waiting = Waiting()
        self._lost: Counter[Topic] = Counter()
        if self._simulated:
            subscribe(self, topics.CLOCK, self._on_clock)
        for topic in topics.RECORDED:
            profile = copy(LATCHED_SUBSCRIPTION if topic.latched else PROFILES[topic.quality].subscription)
            profile.depth = DEPTH
            subscribe(self, topic, self._receiver(topic), profile, raw=True, lost=partial(self._on_lost, topic))
        self._writer = BagWriter(output, limits)
        each_round = self._writer.check_disk if by_log_time else self.save
        self.create_timer(ROUND_S, each_round, clock=NodeClock(clock_type=ClockType.STEADY_TIME))
        self._diagnostics = Diagnostics(self, "recording", values, self._told)
        self.get_logger().info(f"recording to {output}")

    @property
    def counts(self) -> dict[str, int]:
        """Messages recorded so far by topic."""
        return self._writer.counts

    def save(self) -> None:
        """Hand what has waited for `ROUNDS` of these calls to the operating system; see to the room on the disk."""
        self._writer.check_disk()
        due = self._rounds[0]
        self._rounds.append(self._arrivals)
        if self._waiting.begun:
            self._release(lambda message: message.arrival <= due)
        elif self._waiting:
            self.get_logger().warning(NO_CLOCK, once=True)
        if self._writer.unsaved and self._oldest_unsaved <= due:
            self._writer.flush()

    def close(self) -> None:
        """Write the rest, the index and the metadata."""
        for timer in self.timers:
            timer.cancel()
        try:
            self._release(lambda _: True)
        finally:  # the disk may be full by now
            self._writer.close()
        self.get_logger().info(f"recorded {sum(self.counts.values())} messages to {self._writer.path}")

    def _told(self) -> Told:
        unheard = [topic for topic in topics.RECORDED if not self.heard[topic]]
        found = [Finding(Severity.OK, f"recording to {self._writer.path}"), *unlike(self, unheard), *doubled(self, ())]
        if self._simulated and not self._waiting.begun:
            found.append(Finding(Severity.WARN, NO_CLOCK))
        if self._went_back:
            found.append(Finding(Severity.WARN, WENT_BACK))
        if given_up := self._waiting.given_up:
            found.append(Finding(Severity.WARN, f"{given_up} messages given up: they waited for /clock"))
        if self._lost:
            names = ", ".join(topic.name for topic in self._lost)
            found.append(Finding(Severity.WARN, f"messages lost on the way, {self._lost.total()} at least: {names}"))
        numbers = {
            "written": sum(self.counts.values()),
            "bytes": self._writer.size,
            "waiting": len(self._waiting),
            "dropped": self._waiting.given_up,
            "lost": self._lost.total(),
        }
        return found, {"file": str(self._writer.file), **{name: str(number) for name, number in numbers.items()}}

    def _on_lost(self, topic: Topic, event: Any) -> None:
        """Count what a publisher could not keep until the recorder took it (see `DEPTH`); a gap may count as one."""
        self._lost[topic] = event.total_count
        self.get_logger().warning(
            f"{topic.name}: messages lost on the way, {event.total_count} at least; was this stopped?"
        )

    def _receiver(self, topic: Topic) -> Callable[..., None]:
        """Return the callback of a topic; with its second argument rclpy passes the time stamps of DDS."""
        name = self.resolve_topic_name(topic.name)

        def receive(cdr: bytes, info: Mapping[str, int]) -> None:
            if not self.heard[topic]:
                self._writer.add_topic(name, topic.type, offered=offered(self, topic))
            exact, stamp_ns = self._canonical(name, topic.type, cdr)
            self._arrivals += 1
            self.heard[topic] += 1
            message = Message(info["source_timestamp"], self._arrivals, name, topic.type, exact, stamp_ns)
            if not self._simulated:
                self._write(message, time.time_ns())
            elif not self._waiting.takes(message):
                self.get_logger().warning(
                    f"no /clock: of {len(self._waiting)} messages that wait for it the oldest is given up", once=True
                )

        return receive

    def _canonical(self, name: str, type_name: str, cdr: bytes) -> tuple[bytes, int]:
        """Return the message with its padding zeroed, so that equal runs give equal bytes, and its header's stamp."""
        try:
            message = deserialize(cdr, type_name)
        except ValueError as error:
            self.get_logger().warning(f"{name}: recorded as it came: {error}", throttle_duration_sec=10.0)
            return cdr, 0
        header = getattr(message, "header", None)
        return serialize(message, type_name), stamp_ns(header) if header else 0

    def _on_clock(self, message: Any, info: Mapping[str, int]) -> None:
        """Write what was published before the /clock before this one."""
        self.heard[topics.CLOCK] += 1
        before = self._waiting.time.tick(info["source_timestamp"], topics.CLOCK.read(message))
        if before is not None:
            self._release(lambda message: message.published_ns < before.published_ns)
            self._writer.advance(before.clock_ns)

    def _release(self, ready: Callable[[Message], bool]) -> None:
        """Write the waiting messages that are ready in the order of publishing."""
        for message, log_ns in self._waiting.released(ready):
            self._write(message, log_ns)

    def _write(self, message: Message, log_ns: int) -> None:
        try:  # a stamp may lie before 1970, a log time may not
            self._writer.write(message.name, message.type, message.cdr, max(log_ns, 0))
        except OSError:
            self._waiting.clear()  # the recording ends here, not with a gap
            raise
        if log_ns < self._latest_ns - JUMP_NS:
            self._went_back = True
            self.get_logger().warning(WENT_BACK, once=True)
        self._latest_ns = max(self._latest_ns, log_ns)
        first = self._writer.unsaved == 1
        self._oldest_unsaved = message.arrival if first else min(self._oldest_unsaved, message.arrival)


def main(args: Sequence[str] | None = None) -> int:
    """Run `recorder --output DIR [--ros-args ...]` until a signal."""
    own, ros = runtime.split_ros_arguments(sys.argv[1:] if args is None else args)
    return run_tool(_parser(), lambda options: _record(options, ros), own)


def _record(options: argparse.Namespace, ros: Sequence[str]) -> int:
    at_least(options, max_size_mb=1, max_duration_s=1, min_free_mb=0)
    limits = LIMITS._replace(
        max_bytes=options.max_size_mb * MB,
        max_duration_ns=options.max_duration_s * 1e9,
        min_free_bytes=options.min_free_mb * MB,
    )
    return runtime.run("recorder", lambda: Recorder(Path(options.output), limits), ros)


def _parser() -> argparse.ArgumentParser:
    usage = "%(prog)s --output DIR [--ros-args ...]"
    parser = argparse.ArgumentParser("recorder", usage=usage, **help_texts(__doc__, *EXAMPLES))
    add = parser.add_argument
    add("--output", metavar="DIR", required=True, help="the recording, a new directory")
    add("--max-size-mb", metavar="MB", type=float, default=math.inf, help="go on in a new file before this size")
    longest = "go on in a new file after this log time; inf: never"
    add("--max-duration-s", metavar="S", type=float, default=MAX_DURATION_S, help=longest)
    room = "end before less is free on the disk"
    add("--min-free-mb", metavar="MB", type=float, default=MIN_FREE_MB, help=room)
    return parser


if __name__ == "__main__":
    sys.exit(main())
