# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A node's entry in /diagnostics: what an operator must know, in words with the remedy, and the numbers behind it."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from rclpy.clock import Clock, ROSClock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from adhesion_node.core.atp.supervision import Severity
from adhesion_node.core.setting import make
from adhesion_node.wire.line import TRAIN
from adhesion_node.wire.messages.results import Status
from adhesion_node.wire.settings.telling import Telling
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import CLOCK, DIAGNOSTICS

from . import qos
from .types import new

JUMP_NS = 60_000_000_000
"""A stamp further back than this belongs to another time; within it stamps must not go back."""


class Finding(NamedTuple):
    """Something that an operator must know."""

    severity: Severity
    text: str


Told = tuple[list[Finding], dict[str, str]]
"""What there is to tell: findings, at least one, and numbers by name."""


def doubled(node: Node, inputs: Iterable[Topic]) -> list[Finding]:
    """Name what is published by more than one: sensors or estimators that get mixed up, a time that jumps."""
    clock = node.get_clock()
    clocks = (CLOCK,) if isinstance(clock, ROSClock) and clock.ros_time_is_active else ()
    names = [node.resolve_topic_name(topic.name) for topic in (*inputs, *clocks)]
    counts = {name: node.count_publishers(name) for name in names}
    return [
        Finding(Severity.WARN, f"{count} publishers of {name}: stop all but one")
        for name, count in counts.items()
        if count > 1
    ]


def unlike(node: Node, unheard: Iterable[Topic]) -> list[Finding]:
    """Name what is published as another type than it is read: nothing of that arrives, and DDS does not tell."""
    ends = ((topic, end.topic_type) for topic in unheard for end in node.get_publishers_info_by_topic(topic.name))
    kinds = {topic: kind for topic, kind in ends if kind != topic.type}
    return [
        Finding(Severity.WARN, f"{node.resolve_topic_name(topic.name)} is published as {kind}: give it as {topic.type}")
        for topic, kind in kinds.items()
    ]


class Diagnostics:
    """Speaks in /diagnostics of `part` of a node: by `tell`, and by a steady timer, so that no entry grows stale.

    `values` are those of the node's settings, of `Telling` among them. The stamps are the node's clock. `published`
    counts the messages.
    """

    def __init__(
        self,
        node: Node,
        part: str,
        values: Mapping[str, Any],
        told: Callable[[], Told],
        published: Counter[Topic] | None = None,
    ) -> None:
        telling = make(Telling, values)
        self.name = f"{node.get_fully_qualified_name().lstrip('/')}/{part}"
        self.hardware_id = telling.hardware_id or node.get_namespace().strip("/") or TRAIN
        self._published = Counter() if published is None else published
        self._node, self._told, self._stamp_ns = node, told, 0
        self._output = qos.advertise(node, DIAGNOSTICS)
        node.create_timer(telling.diagnostics_period_s, self.tell, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def tell(self) -> None:
        """Publish what there is to tell."""
        self._stamp_ns = next_stamp(self._node.get_clock().now().nanoseconds, self._stamp_ns)
        status = self.status(*self._told())
        self._output.publish(DIAGNOSTICS.build(new, self._stamp_ns, status))
        self._published[DIAGNOSTICS] += 1

    def status(self, findings: Iterable[Finding], values: Mapping[str, str]) -> Status:
        """Return the entry: as bad as the worst finding, which its message begins with."""
        ranked = sorted(findings, key=lambda finding: -finding.severity)
        text = "; ".join(finding.text for finding in ranked)
        return Status(self.name, ranked[0].severity, text, values, self.hardware_id)


def next_stamp(t_ns: int, before_ns: int) -> int:
    """Return a stamp for `t_ns` that comes after the one before, unless time itself has jumped back.

    >>> next_stamp(5, 3), next_stamp(3, 3), next_stamp(0, 3 * JUMP_NS)
    (5, 4, 0)
    """
    return t_ns if t_ns > before_ns or before_ns - t_ns > JUMP_NS else before_ns + 1
