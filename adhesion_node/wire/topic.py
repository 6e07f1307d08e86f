# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a topic is: its name, type, role, quality of service, frame and codec."""

from enum import Enum
from typing import Any, NamedTuple

from .line import NOMINAL, Line
from .messages.codec import Codec, New
from .messages.refused import Reason, Rejected


class Role(Enum):
    """What a topic is to the package."""

    SENSOR = "measured"
    TRUTH = "what a simulator knows"
    ADHESION = "found out by the estimator; its writers take a Prediction"
    CREEP = "found out by the creep estimator; its writers take a CreepEstimate"
    STATUS = "how things stand"
    COMMAND = "what is asked of the package"
    CLOCK = "time"
    OTHER = "not ours"


class Quality(Enum):
    """Quality of service in words; nodes/ros/qos.py has the profiles."""

    SENSOR = "reliable; subscribed best effort, so that every publisher matches"
    RESULT = "reliable"
    EXPIRING = "reliable, transient local: who comes later gets the last one, unless it is too old"


class Frame(Enum):
    """Which frame_id a reader insists on."""

    ANY = "none: it says how the train moves, or what it feels"
    LINE = "that of the parameter `frame`: it says where"


class Topic(NamedTuple):
    """A topic: its relative name, its message type in ROS 2 spelling, and how its messages are carried and coded."""

    name: str
    type: str
    role: Role = Role.OTHER
    quality: Quality = Quality.SENSOR
    frame: Frame = Frame.ANY
    codec: Codec | None = None
    meaning: str = ""
    """For the documentation."""

    @property
    def latched(self) -> bool:
        """Whether who subscribes late gets the last message."""
        return self.quality is Quality.EXPIRING

    def read(self, message: Any, line: Line = NOMINAL) -> Any:
        """Read and check a message; raises Rejected with reason and remedy."""
        self._check_frame(message, line)
        return self._codec.read(message, line)

    def together(self, message: Any, line: Line = NOMINAL) -> Any:
        """Read one message that stands for many; raises Rejected where that refuses them all."""
        self._check_frame(message, line)
        return self._codec.together and self._codec.together(message, line)

    def _check_frame(self, message: Any, line: Line) -> None:
        if self.frame is Frame.LINE and message.header.frame_id != line.frame:
            raise Rejected(Reason.WRONG_FRAME, f"header.frame_id = {message.header.frame_id!r}, frame = {line.frame!r}")

    def build(self, new: New, *values: Any) -> Any:
        """Build the message of what the codec's writer takes; None where there is nothing to publish."""
        fields = self._codec.write(new, *values)
        return None if fields is None else new(self.type, **fields)

    @property
    def _codec(self) -> Codec:
        assert self.codec is not None, f"{self.name}: {self.role.value}"
        return self.codec
