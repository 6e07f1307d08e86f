# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The way of sensor messages into a node: subscribed, counted, read or refused, and what an operator must know."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, Protocol

from rclpy.node import Node

from adhesion_node.core import Event
from adhesion_node.core.atp.supervision import Severity
from adhesion_node.core.intake.outcome import KEPT_OUT
from adhesion_node.run.reader import Reader
from adhesion_node.wire.line import Line
from adhesion_node.wire.messages.refused import Reason, Rejected
from adhesion_node.wire.topic import Topic

from .. import qos
from ..diagnostics import Finding, doubled, unlike
from .hearing import Hearing

AS_WANTED = (Reason.OTHER_SOURCE.name, Reason.SWITCHED_OFF.name)
"""Reasons of a refusal that somebody wanted so: the message is counted, no more."""

ALIVE = (Reason.OTHER_SOURCE.name, Reason.DISABLED.name)
"""Those that say nothing of the sensor: it is heard. One that is switched off is as good as silent."""


class Listener(Protocol):
    """What a node does with what comes in; while it is not active nothing of that."""

    active: bool

    def take(self, sample: Any) -> tuple[Sequence[Any], Iterable[Event]]:
        """Use a sample; return what it completes, and what it brought about other than that it was used."""

    def publish(self, outputs: Sequence[Any]) -> None:
        """Publish what was completed."""

    def refuse(self, topic: Topic, refusal: Rejected) -> None:
        """Count a message that was refused."""

    def settle(self, silent_s: float) -> None:
        """Use what waits for others of its time: the sensor has been silent for so long."""

    def report(self) -> None:
        """Publish the state of affairs in /diagnostics."""


class Intake:
    """Subscribes what `reader` reads; its anchor must not fall silent for longer than `timeout_s`.

    `heard` counts the messages by topic, refused ones included, `lost` those that were lost on the way, of which a gap
    may count as one. While `enabled` is False all are refused.
    """

    def __init__(self, node: Node, listener: Listener, reader: Reader, timeout_s: float) -> None:
        self.heard: Counter[Topic] = Counter()
        self.lost: Counter[Topic] = Counter()
        self.enabled = True
        self._node, self._listener, self._reader = node, listener, reader
        self._counts: Counter[str] = Counter()
        self._refusals: dict[str, str] = {}
        self._events: dict[str, str] = {}
        self._hearing = Hearing(node, reader, timeout_s, self._on_silence)
        for topic in reader.inputs:
            qos.subscribe(node, topic, self._receiver(topic), tell=self.tell, lost=partial(self._on_lost, topic))
        node.get_logger().info(f"ready: waiting for {' or '.join(self._hearing.awaited)}")

    def resume(self) -> None:
        """Begin to wait anew."""
        self._hearing.wait()

    def change(self, line: Line, timeout_s: float) -> None:
        """Read and wait from now on with what has changed."""
        self._reader.line = line
        self._hearing.silence.change(timeout_s)

    def note(self, what: str, text: str) -> None:
        """Keep what went wrong for the next report; the 1st, 2nd, 4th, 8th ... of `what` is told at once."""
        self._counts[what] += 1
        count = self._counts[what]
        self._refusals[what] = f"{text} ({count} so far)"
        if count & (count - 1) == 0:
            self._node.get_logger().warning(self._refusals[what])
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
        awaited = self._hearing.awaited
        self._events = {name: text for name, text in self._events.items() if name in awaited}
        found += self._hearing.findings()
        if not self.enabled:
            found.append(Finding(Severity.WARN, f"disabled: {Reason.DISABLED.value}"))
        fell_silent = self._hearing.silent_s
        unheard = [topic for topic in self._reader.inputs if not self.heard[topic] or fell_silent(topic) is not None]
        return [*found, *unlike(self._node, unheard), *doubled(self._node, self._reader.inputs)]

    def _on_lost(self, topic: Topic, event: Any) -> None:
        self.lost[topic] = event.total_count

    def _on_silence(self) -> None:
        if self._listener.active:
            self._listener.settle(self._hearing.silence.for_s or 0.0)
            self._listener.report()

    def _receiver(self, topic: Topic) -> Callable[[Any], None]:
        def receive(message: Any) -> None:
            self.heard[topic] += 1
            if not self._listener.active:
                return
            try:
                sample = self._sample(topic, message)
            except Rejected as refusal:
                self._heard(topic, str(refusal) if refusal.reason not in ALIVE else "")
                self._listener.refuse(topic, refusal)
                if refusal.reason not in AS_WANTED:  # nothing is wrong: it is counted
                    self.note(f"{topic.name} {refusal.reason}", f"{topic.name}: message refused: {refusal}")
            else:
                outputs, events = self._listener.take(sample)
                self._heard(topic, next((str(event) for event in events if event.outcome in KEPT_OUT), ""))
                self._listener.publish(outputs)
                for event in events:
                    if event.is_told:
                        self.note(event.outcome.name, str(event))

        return receive

    def _heard(self, topic: Topic, unusable: str) -> None:
        if self._hearing.heard(topic, unusable):
            self._events.pop(self._node.resolve_topic_name(topic.name), None)

    def _sample(self, topic: Topic, message: Any) -> Any:
        if not self.enabled:
            raise Rejected(Reason.DISABLED, "disabled")
        return self._reader.read(topic, message)
