# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which sensors are heard and which are silent, in words for an operator."""

import math
from collections import defaultdict, deque
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from statistics import median

from rclpy.node import Node

from adhesion_node.core.atp.supervision import Severity
from adhesion_node.run.reader import Reader
from adhesion_node.wire.settings.sensing import USE
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import POSITION, POSITIONS, SPEED, WHEEL_SPEED

from ..diagnostics import Finding
from .silence import Moment, Silence

BY_SPEED = "no position: the train is followed by its speed or its wheels alone, wherever it is on the track"
MOVERS = (SPEED, WHEEL_SPEED)
"""What it is followed by without a position."""

LATEST = 9
"""Messages of a topic that show how often they come."""

SELDOM = 5.0
"""Usual intervals without a message: a sensor that is slower than the timeout does not fall silent every time."""


class Hearing:
    """Watches the anchor of `reader` by `silence`, and tells of its other inputs how long they have been silent."""

    def __init__(self, node: Node, reader: Reader, timeout_s: float, report: Callable[[], None]) -> None:
        self.silence = Silence(node, timeout_s, report)
        self._node, self._reader = node, reader
        self._moments: defaultdict[Topic, deque[Moment]] = defaultdict(partial(deque, maxlen=LATEST))
        self._unusable: dict[Topic, str] = {}
        """Why the last message of a topic could not be used; empty where it could."""

    def wait(self) -> None:
        """Begin to wait anew."""
        self.silence.wait()
        self._moments.clear()
        self._unusable.clear()

    def heard(self, topic: Topic, unusable: str) -> bool:
        """Note a message, which is as none where it is `unusable`; return whether one is that was awaited."""
        self._unusable[topic] = unusable
        if unusable:
            return False
        self._moments[topic].append(self.silence.now())
        if topic in self._watched:
            self.silence.heard()
        return topic in self._watched

    @property
    def awaited(self) -> list[str]:
        """The full names of what must not fall silent: of the anchor, before that is known of all that may be it."""
        return [self._node.resolve_topic_name(topic.name) for topic in self._watched]

    def silent_s(self, topic: Topic) -> float | None:
        """How long a topic has been silent; None within the timeout, and where that is usual or nothing is yet."""
        for_s = self._since_s(topic)
        if for_s is None or len(self._moments[topic]) < 2:
            return None
        stamps = [moment.clock_ns or 0 for moment in self._moments[topic]]
        usual_s = median(later - earlier for earlier, later in pairwise(stamps)) * 1e-9
        return for_s if for_s > SELDOM * usual_s else None

    def findings(self) -> list[Finding]:
        """Return what is silent: the anchor; where the train is followed all the same other sensors that were heard."""
        for_s, by_speed = self.silence.for_s, self._reader.source is None and POSITION in self._reader.anchors
        found = []
        if for_s is not None:
            if not (by_speed and any(map(self._comes, MOVERS))):
                return [Finding(Severity.STALE, self._stale(for_s, MOVERS if by_speed else ()))]
            found.append(Finding(Severity.WARN, BY_SPEED))
        others = [topic for topic in self._reader.inputs if topic not in self._reader.anchors and self._is_on(topic)]
        silent = [((topic,), gone_s) for topic in others if (gone_s := self.silent_s(topic)) is not None]
        return [*found, Finding(Severity.WARN, self._nothing(*silent))] if silent else found

    @property
    def _watched(self) -> Sequence[Topic]:
        return (self._reader.source,) if self._reader.source else self._reader.anchors

    def _stale(self, for_s: float, movers: Sequence[Topic]) -> str:
        """Say that the anchor is silent, as are those `movers` that were heard, and which other one might be used."""
        ages_s = {topic: self._since_s(topic) for topic in movers}
        gone_s = {topic: age_s for topic, age_s in ages_s.items() if age_s is not None and age_s < math.inf}
        if not (gone_s or self.silence.ever_heard or any(map(self._unusable.get, self._watched))):
            publishers = sum(map(self._node.count_publishers, self.awaited))
            remedy = f"is the sensor running, its topic remapped?{self._instead()}"
            return f"{' or '.join(self.awaited)}: nothing received yet, publishers: {publishers}: {remedy}"
        text = self._nothing(((*self._watched, *gone_s), min(gone_s.values(), default=for_s)))
        source, others = self._reader.source, [topic for topic in self._reader.anchors if self._comes(topic)]
        if source is None or not others:
            return text
        return f"{text}; {others[0].name} comes but is not used: set {USE}{source.name} to false, or call ~/reset"

    def _instead(self) -> str:
        """Say which other source of the position is published, and what keeps it from being one."""
        watched = self._watched[0] in POSITIONS
        others = [self._node.resolve_topic_name(one.name) for one in POSITIONS if watched and one not in self._watched]
        named = "track_line" if self._reader.line.position_source == "auto" else "position_source"
        published = filter(self._node.count_publishers, others)
        return next((f" {name} is published but not used: set {named}" for name in published), "")

    def _nothing(self, *silent: tuple[Sequence[Topic], float]) -> str:
        """Say of topics for how long nothing has come of any of them; the remedy stands once."""
        dead, unusable = [], []
        for some, for_s in silent:
            names = " or ".join(self._node.resolve_topic_name(topic.name) for topic in some)
            why = next(filter(None, map(self._unusable.get, some)), "")
            if why:
                unusable.append(f"{names}: nothing that can be used for {for_s:.1f} s: {why}")
            else:
                dead.append(f"{names}: nothing for {for_s:.1f} s")
        alive = [f"{', '.join(dead)}: is the sensor alive? If it is that slow, raise sensor_timeout_s"] if dead else []
        return "; ".join(alive + unusable)

    def _is_on(self, topic: Topic) -> bool:
        return topic.name not in self._reader.line.unused

    def _comes(self, topic: Topic) -> bool:
        """Whether it is heard, and not switched off."""
        return self._is_on(topic) and self._since_s(topic) is None

    def _since_s(self, topic: Topic) -> float | None:
        """How long nothing has come; infinite where nothing ever has, None within the timeout."""
        moments = self._moments.get(topic)
        return self.silence.since_s(moments[-1]) if moments else math.inf
