# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The way of sensor messages into a node: subscribed, counted, read or refused, and what an operator must know."""

from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from rclpy.node import Node

from adhesion_node.core import Event
from adhesion_node.core.atp.supervision import Severity
from adhesion_node.run.reader import Reader
from adhesion_node.wire import topics
from adhesion_node.wire.line import Line
from adhesion_node.wire.messages.refused import Reason, Rejected
from adhesion_node.wire.topic import Topic

from . import qos
from .diagnostics import Finding, doubled, unlike
from .silence import Silence

BY_SPEED = "no position: the train is followed by its speed or its wheels alone, wherever it is on the track"

AS_WANTED = (Reason.OTHER_SOURCE.name, Reason.SWITCHED_OFF.name)
UNUSED = (*AS_WANTED, Reason.DISABLED.name)
"""Reasons of a refusal that say nothing against the message: its sensor is alive."""


class Listener(Protocol):
    """What a node does with what comes in; while it is not active nothing of that."""

    active: bool

    def take(self, sample: Any) -> Iterable[Event]:
        """Use a sample; return what it brought about other than that it was used."""

    def refuse(self, topic: Topic, refusal: Rejected) -> None:
        """Count a message that was refused."""

    def settle(self, silent_s: float) -> None:
        """Use what waits for others of its time: the sensor has been silent for so long."""

    def report(self) -> None:
        """Publish the state of affairs in /diagnostics."""


class Intake:
    """Subscribes what `reader` reads; its anchor must not fall silent for longer than `timeout_s`.

    `heard` counts the messages by topic, refused ones included. While `enabled` is False all are refused.
    """

    def __init__(self, node: Node, listener: Listener, reader: Reader, timeout_s: float) -> None:
        self.heard: Counter[Topic] = Counter()
        self.enabled = True
        self._node, self._listener, self._reader = node, listener, reader
        self._counts: Counter[str] = Counter()
        self._refusals: dict[str, str] = {}
        self._events: dict[str, str] = {}
        self._refused = ""
        self._silence = Silence(node, timeout_s, self._on_silence)
        for topic in reader.inputs:
            qos.subscribe(node, topic, self._receiver(topic), tell=self.tell)
        node.get_logger().info(f"ready: waiting for {' or '.join(self._watched)}")

    def resume(self) -> None:
        """Begin to wait anew."""
        self._silence.wait()

    def change(self, line: Line, timeout_s: float) -> None:
        """Read and wait from now on with what has changed."""
        self._reader.line = line
        self._silence.change(timeout_s)

    def note(self, reason: str, text: str) -> None:
        """Keep what went wrong for the next report; the 1st, 2nd, 4th, 8th ... of a reason is told at once."""
        self._counts[reason] += 1
        count = self._counts[reason]
        self._refusals[reason] = f"{text} ({count} so far)"
        if count & (count - 1) == 0:
            self._node.get_logger().warning(self._refusals[reason])
            self._listener.report()

    def tell(self, event: str) -> None:
        """Keep an event of DDS, the last one of each topic, log and report it at once."""
        self._events[event.partition(":")[0]] = event
        self._node.get_logger().warning(event)
        self._listener.report()

    def findings(self) -> list[Finding]:
        """Return what is wrong now and what has been refused or has happened since the last call."""
        found = [Finding(Severity.WARN, text) for text in (*self._refusals.values(), *self._events.values())]
        self._refusals.clear()
        # What happened to the watched topic stands until that is heard again: it may be why it is silent.
        self._events = {name: text for name, text in self._events.items() if name in self._watched}
        if self._silence.for_s is not None:
            moves = self.heard[topics.SPEED] + self.heard[topics.WHEEL_SPEED] > 0
            by_speed = moves and self._reader.source is None and topics.POSITION in self._reader.anchors
            text = BY_SPEED if by_speed else self._silent(self._silence.for_s)
            found.append(Finding(Severity.WARN if by_speed else Severity.STALE, text))
        if not self.enabled:
            found.append(Finding(Severity.WARN, f"disabled: {Reason.DISABLED.value}"))
        unheard = [topic for topic in self._reader.inputs if not self.heard[topic]]
        return [*found, *unlike(self._node, unheard), *doubled(self._node, self._reader.inputs)]

    @property
    def _watched(self) -> list[str]:
        """The full names of what must not fall silent: of the anchor, before that is known of all that may be it."""
        source = self._reader.source
        return [self._node.resolve_topic_name(one.name) for one in ((source,) if source else self._reader.anchors)]

    def _silent(self, for_s: float) -> str:
        names = self._watched
        name = " or ".join(names)
        if self._refused:
            return f"{name}: nothing that can be used for {for_s:.1f} s: {self._refused}"
        if self._silence.ever_heard:
            return f"{name}: nothing for {for_s:.1f} s: is the sensor alive? If it is that slow, raise sensor_timeout_s"
        publishers = sum(map(self._node.count_publishers, names))
        return f"{name}: nothing received yet, publishers: {publishers}: is the sensor running, its topic remapped?"

    def _on_silence(self) -> None:
        if self._listener.active:
            self._listener.settle(self._silence.for_s or 0.0)
            self._listener.report()

    def _receiver(self, topic: Topic) -> Callable[[Any], None]:
        def receive(message: Any) -> None:
            self.heard[topic] += 1
            if not self._listener.active:
                return
            try:
                sample = self._sample(topic, message)
            except Rejected as refusal:
                self._heard(topic, str(refusal) if refusal.reason not in UNUSED else "")
                self._listener.refuse(topic, refusal)
                if refusal.reason not in AS_WANTED:  # nothing is wrong: it is counted
                    self.note(refusal.reason, f"{topic.name}: message refused: {refusal}")
            else:
                self._heard(topic)
                for event in self._listener.take(sample):
                    if event.is_told:
                        self.note(event.outcome.name, str(event))

        return receive

    def _heard(self, topic: Topic, refused: str = "") -> None:
        """Note that the watched topic is not silent; with what is refused it is."""
        if topic in self._reader.anchors and self._reader.source in (None, topic):
            self._refused = refused
            if not refused:
                self._silence.heard()
                self._events.pop(self._node.resolve_topic_name(topic.name), None)

    def _sample(self, topic: Topic, message: Any) -> Any:
        if not self.enabled:
            raise Rejected(Reason.DISABLED, "disabled")
        return self._reader.read(topic, message)
