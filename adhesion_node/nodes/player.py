# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Publishes the sensor topics of a recording with /clock; `replay` is the program around it."""

import math
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import Any

from rclpy.clock import Clock as NodeClock
from rclpy.clock import ClockType
from rclpy.publisher import Publisher
from rclpy.qos import ReliabilityPolicy

from ..bag import BagReader, Record
from ..bag.read.turns import in_turn
from ..core.atp.supervision import Severity
from ..wire import topics
from ..wire.settings.telling import TELLING
from ..wire.topic import Topic
from .acknowledged import Acknowledged
from .offers import as_recorded, expires
from .ros.diagnostics import Diagnostics, Finding, Told
from .ros.discovery import Subscribers
from .ros.params import SettingsNode, declare
from .ros.qos import advertise
from .ros.types import new

PERIOD_S, RUSH_PERIOD_S = 0.002, 0.0005
"""Between two ticks at a given rate and as fast as possible."""

DEPTH = 100
"""Of a publisher's queue, where none was kept for late subscribers."""

BURST = 20
"""Log times per tick at most: a fraction of a subscriber's queue."""

SUBSCRIBERS_S = 10.0
"""Longest wait for subscribers."""


class Replay(SettingsNode):
    """Publishes the records of `selection` (recorded name -> topic name), as raw bytes, each log time on /clock first.

    `rate` is the speed against the log times; 0 publishes as fast as the reliable subscribers take it. It starts
    once `subscribers` are there. `finished` becomes True at the end; `failure` then says why it ended early, or is
    None. Raises ValueError when the rate is not usable.
    """

    def __init__(
        self, reader: BagReader, selection: Mapping[str, str], rate: float = 1.0, subscribers: int = 1, **kwargs: Any
    ) -> None:
        if not math.isfinite(rate) or rate < 0:
            raise ValueError(f"rate = {rate!r}: give a factor above 0, or 0 for as fast as possible")
        super().__init__("replay", automatically_declare_parameters_from_overrides=True, **kwargs)
        values = declare(self, TELLING, quiet=True)
        self.finished = False
        self.failure: str | None = None
        self.published: Counter[str] = Counter()
        self._rate, self._left = rate, sum(reader.counts[source] for source in selection)
        self._wanted = subscribers
        self._clock_out = advertise(self, topics.CLOCK)
        self._outputs = {
            source: advertise(
                self, Topic(target, reader.topics[source]), as_recorded(reader.infos[source].offered, DEPTH)
            )
            for source, target in selection.items()
        }
        # Not for what expires: DDS would wait in vain for a subscriber that came too late for it.
        awaited = [end for source, end in self._outputs.items() if not expires(reader.infos[source].offered)]
        self._acknowledged = Acknowledged(awaited, self.get_logger().warning)
        self._steps = groupby(in_turn(reader.messages(selection)), key=lambda record: record.log_ns)
        self._next: tuple[int, Iterator[Record]] | None = None
        self._origin: tuple[float, int] | None = None
        self._waiting_since = time.monotonic()
        self._subscribers = Subscribers(self._outputs.values(), self._position(), subscribers)
        period = PERIOD_S if rate else RUSH_PERIOD_S
        self.create_timer(period, self.tick, clock=NodeClock(clock_type=ClockType.STEADY_TIME))
        self._diagnostics = Diagnostics(self, "playing", values, self._told)

    def tick(self) -> None:
        """Publish what is due."""
        if self.finished:
            return
        try:
            if self._origin is None:
                self._start_when_heard()
            else:
                self._publish_due()
        except ValueError as error:  # the recording turns out unreadable on the way
            self.failure = str(error)
            self.finished = True

    def _told(self) -> Told:
        finding = Finding(Severity.OK, "the end of the recording" if self.finished else "playing")
        if self.failure is not None:
            finding = Finding(Severity.ERROR, self.failure)
        elif self._origin is None:
            waits = f"waiting for {self._wanted} subscriber(s) to {self._position().topic_name}"
            finding = Finding(Severity.OK, waits)
        elif hung := self._acknowledged.hung:
            finding = Finding(Severity.WARN, f"{hung}: a subscriber hangs and is not waited for any more")
        published = sum(self.published.values())
        next_ns = "none" if self._next is None else str(self._next[0])
        return [finding], {"next_ns": next_ns, "published": str(published), "left": str(self._left - published)}

    def _start_when_heard(self) -> None:
        now = time.monotonic()
        if self._subscribers.found():
            self._warn_of_losses()
        elif not self._subscribers.enough and now - self._waiting_since >= SUBSCRIBERS_S:
            self.get_logger().warning(
                f"{self._position().topic_name}: fewer than {self._wanted} subscribers after {SUBSCRIBERS_S:g} s: "
                "replaying all the same"
            )
        else:
            return
        self._next = next(self._steps, None)
        self._origin = (now, self._next[0] if self._next else 0)

    def _position(self) -> Publisher:
        """Return the publisher whose subscribers count: the position's, or the first one's without a position."""
        named = {publisher.topic_name: publisher for publisher in self._outputs.values()}
        places = (named.get(self.resolve_topic_name(topic.name)) for topic in topics.POSITIONS)
        return next(filter(None, places), None) or next(iter(named.values()))

    def _warn_of_losses(self) -> None:
        """At full speed only a reliable subscriber can slow the replay down; any other one may lose messages."""
        for publisher in self._outputs.values() if not self._rate else ():
            for end in self.get_subscriptions_info_by_topic(publisher.topic_name):
                if end.qos_profile.reliability != ReliabilityPolicy.RELIABLE:
                    override = f"qos_overrides.{publisher.topic_name}.subscription"
                    self.get_logger().warning(
                        f"{end.node_name} subscribes {publisher.topic_name} best effort and may lose messages: start "
                        f"it with -p {override}.reliability:=reliable -p {override}.history:=keep_all, or set a --rate"
                    )

    def _publish_due(self) -> None:
        for _ in range(BURST if self._rate else 1):
            if self._next is None:
                self.failure = self._acknowledged.finish()
                self.finished = True
                return
            log_ns, records = self._next
            if log_ns > self._due_ns():
                return
            self._clock_out.publish(topics.CLOCK.build(new, log_ns))
            for record in records:
                self._publish(record)
            self._next = next(self._steps, None)

    def _publish(self, record: Record) -> None:
        self._acknowledged.publish(self._outputs[record.topic], record.cdr)
        self.published[record.topic] += 1

    def _due_ns(self) -> float:
        """Return the log time reached by now."""
        assert self._origin is not None
        started, first_ns = self._origin
        return first_ns + (time.monotonic() - started) * self._rate * 1e9 if self._rate else math.inf
