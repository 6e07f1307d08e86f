# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Waits for reliable subscribers to take what was published; one that hangs is waited for once."""

import time
from collections import deque
from collections.abc import Callable, Iterable

from rclpy.duration import Duration
from rclpy.publisher import Publisher

ACKNOWLEDGED_S = 10.0
"""Longest wait for reliable subscribers to take what was published."""

KEPT_S = 0.2
"""Where one hangs, a message stays in the queue for so long: the others take theirs within milliseconds."""


class Acknowledged:
    """Publishes so that a sound subscriber loses nothing of `publishers`. `tell` hears of topics that are given up."""

    def __init__(self, publishers: Iterable[Publisher], tell: Callable[[str], None]) -> None:
        self._queues = {publisher: _Queue(publisher) for publisher in publishers}
        self._tell = tell

    def publish(self, publisher: Publisher, cdr: bytes) -> None:
        """Publish a message; a full queue first waits until all of it is taken: the next message overwrites.

        Only then: DDS asks for acknowledgements when the queue is full, and else just every three seconds.
        """
        queue = self._queues.get(publisher)
        if queue is None:
            publisher.publish(cdr)
            return
        if not queue.hung and queue.unsure == queue.depth:
            self._await((queue,))
        queue.publish(cdr)

    def finish(self) -> str | None:
        """Wait for the last messages; return what may be lost, None where all is acknowledged."""
        self._await([queue for queue in self._queues.values() if not queue.hung])
        losses = [f"{one.name}, up to {one.unsure} of {one.published}" for one in self._queues.values() if one.hung]
        return f"a subscriber hung, messages may be lost to it: {'; '.join(losses)}" if losses else None

    @property
    def hung(self) -> str:
        """The topics that are not waited for any more; empty while there is none."""
        return ", ".join(queue.name for queue in self._queues.values() if queue.hung)

    def _await(self, queues: Iterable["_Queue"]) -> None:
        """Wait for some; with one that is given up so are all others not taken by then: who hangs, hangs in all."""
        if all(queue.is_taken(ACKNOWLEDGED_S) for queue in queues):
            return
        given_up = [queue for queue in self._queues.values() if not (queue.hung or queue.is_taken(0.0))]
        for queue in given_up:
            queue.hung = True
        if given_up:
            names = ", ".join(queue.name for queue in given_up)
            self._tell(f"{names}: a subscriber took nothing for {ACKNOWLEDGED_S:g} s and is not waited for any more")


class _Queue:
    """The messages of one publisher, the newest of which DDS keeps for its subscribers."""

    def __init__(self, publisher: Publisher) -> None:
        self.name, self.depth = publisher.topic_name, publisher.qos_profile.depth
        self.hung = False
        self.published = self.unsure = 0
        """Messages, and those of them that may not have been taken."""
        self._publisher = publisher
        self._times_s = deque[float](maxlen=self.depth)

    def is_taken(self, wait_s: float) -> bool:
        """Whether all is acknowledged within a time."""
        taken = bool(self._publisher.wait_for_all_acked(Duration(seconds=wait_s)))
        self.unsure = 0 if taken else self.unsure
        return taken

    def publish(self, cdr: bytes) -> None:
        """Publish a message; where a subscriber hangs the one that it overwrites has been there for `KEPT_S`."""
        if self.hung and len(self._times_s) == self.depth:
            time.sleep(max(self._times_s[0] + KEPT_S - time.monotonic(), 0.0))
        self._publisher.publish(cdr)
        self._times_s.append(time.monotonic())
        self.published += 1
        self.unsure += 1
