# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Reads what an estimator takes in, live and offline.

One topic alone gives the positions, and the axes of an accelerometer are what they seem.
"""

from collections.abc import Sequence
from typing import Any

from ..core import Sample
from ..wire.line import Line
from ..wire.messages.parts import NS
from ..wire.messages.refused import Reason, Rejected
from ..wire.settings.sensing import USE
from ..wire.topic import Topic
from ..wire.topics import FIX, IMU, POSITIONS
from .gravity import Gravity


class Reader:
    """Reads messages of `inputs`; `anchors` are those of them without which there is no estimate, the best one first.

    Two sensors of the position never agree to the metre, and going to and fro between them would look like steps of
    the train. So one of the anchors counts alone: the first in order of those that have been heard. `position_source`
    names one.
    """

    def __init__(self, inputs: Sequence[Topic], line: Line) -> None:
        possible = [topic for topic in inputs if topic in POSITIONS and _is_meant(topic, line)]
        self.line = line
        self.anchors = tuple(possible) or (inputs[-1],)
        self.inputs = tuple(topic for topic in inputs if topic in possible or topic not in POSITIONS)
        self.source: Topic | None = None
        """The anchor that counts; None before one was heard."""
        self._gravity = Gravity()

    def read(self, topic: Topic, message: Any) -> Sample:
        """Read a message of one of the inputs, at the time of what it measured; raises Rejected.

        What is a sample already only takes its turn.
        """
        if self.source is not None and self.source.name in self.line.unused:
            self.source = None  # another one takes over, though this one may never be heard again
        if topic.name in self.line.unused:
            raise Rejected(Reason.SWITCHED_OFF, f"{USE}{topic.name} = false")
        is_better = topic is not self.source and topic in self.anchors
        if is_better and self.source is not None and self.anchors.index(topic) > self.anchors.index(self.source):
            raise Rejected(Reason.OTHER_SOURCE, f"{topic.name} beside {self.source.name}")
        sample: Sample = message if isinstance(message, Sample) else topic.read(message, self.line)
        if topic.name == IMU.name and sample is not message:
            self._gravity = self._gravity.after(sample.t_ns, message.linear_acceleration)
            self._gravity.check()
        if is_better:
            self.source = topic
        late_s = self.line.latency_s.get(topic.name)
        return sample._replace(t_ns=sample.t_ns - round(late_s * NS)) if late_s else sample


def _is_meant(topic: Topic, line: Line) -> bool:
    """Whether a topic may give the positions: without a track line a fix cannot."""
    if line.position_source == "auto":
        return topic != FIX or line.track is not None
    return topic.name == line.position_source
