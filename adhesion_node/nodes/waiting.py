# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Recorded messages that wait for the /clock which gives them their log time."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

from .log_time import SimulatedTime

HELD = 10_000
"""Messages that wait for the first /clock at most."""


class Message(NamedTuple):
    """A received message. Sorts by the time of publishing."""

    published_ns: int
    arrival: int
    name: str
    type: str
    cdr: bytes
    stamp_ns: int


class Waiting:
    """Messages that wait; `time` is what /clock has told so far."""

    def __init__(self) -> None:
        self.time, self.given_up = SimulatedTime(), 0
        self._messages: list[Message] = []
        self._last_ns = 0

    def __len__(self) -> int:
        return len(self._messages)

    @property
    def begun(self) -> bool:
        """Whether a /clock has been heard."""
        return self.time.begun

    def takes(self, message: Message) -> bool:
        """Take a message; False where the oldest had to be given up for it, as no /clock has come."""
        self._messages.append(message)
        if self.begun or len(self._messages) <= HELD:
            return True
        del self._messages[0]
        self.given_up += 1
        return False

    def released(self, ready: Callable[[Message], bool]) -> Iterator[tuple[Message, int]]:
        """Yield those that are ready in the order of publishing, with their log times.

        Without any /clock that is the stamp, or the log time of the message before.
        """
        due = sorted(filter(ready, self._messages))
        self._messages = [message for message in self._messages if not ready(message)]
        for message in due:
            without_ns = message.stamp_ns or self._last_ns
            self._last_ns = self.time.of(message.published_ns, message.stamp_ns) if self.begun else without_ns
            yield message, self._last_ns

    def clear(self) -> None:
        """Give up all, as nothing more can be written."""
        self._messages = []
