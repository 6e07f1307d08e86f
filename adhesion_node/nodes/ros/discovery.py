# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Waits for subscribers: what is published before DDS has found them is lost."""

import time
from collections.abc import Iterable

from rclpy.publisher import Publisher

PERIOD_S = 0.005
"""Between two looks of a node that only waits."""

SETTLE_S, SETTLE_LOOKS = 0.5, 100
"""The subscribers count as found when no other one has appeared for so long and in so many looks: discovery is not
finished on the other side, nor for its other topics, when the first one is seen. On a machine that is busy it takes
longer, and so do the looks."""


class Subscribers:
    """The subscribers of `publishers`, of which `awaited` must have as many as are `wanted`; 0: nobody is awaited."""

    def __init__(self, publishers: Iterable[Publisher], awaited: Publisher, wanted: int) -> None:
        self._publishers, self._awaited, self._wanted = tuple(publishers), awaited, wanted
        self._seen: tuple[int, ...] = ()
        self._seen_since = time.monotonic()
        self._looks = 0

    @property
    def enough(self) -> bool:
        """Whether those that are wanted are there."""
        return self._awaited.get_subscription_count() >= self._wanted

    def found(self) -> bool:
        """Look once more: whether they are there and no other one comes."""
        now = time.monotonic()
        seen = tuple(publisher.get_subscription_count() for publisher in self._publishers)
        self._looks += 1
        if seen != self._seen:
            self._seen, self._seen_since, self._looks = seen, now, 0
        settled = now - self._seen_since >= SETTLE_S and self._looks >= SETTLE_LOOKS
        return self.enough and (settled or not self._wanted)
