# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Simulated time: which /clock was in force when a message was published."""

from bisect import bisect_right, insort
from typing import NamedTuple

CLOCKS = 1000
"""How many /clock are remembered: more than a subscription's queue holds."""

BEFORE_NS = 60_000_000_000
"""A stamp that is earlier than the first /clock by no more than this is of its time; any other one is no time at all,
that of a node whose clock has not begun or goes by the machine."""


class Tick(NamedTuple):
    """A /clock. Sorts by the time of publishing."""

    published_ns: int
    clock_ns: int


class SimulatedTime:
    """The /clock heard so far, by when they were published."""

    def __init__(self) -> None:
        self._ticks: list[Tick] = []

    @property
    def begun(self) -> bool:
        """Whether a /clock has been heard."""
        return bool(self._ticks)

    def tick(self, published_ns: int, clock_ns: int) -> Tick | None:
        """Take a /clock in; return the one before the newest: what was published since may be on its way."""
        insort(self._ticks, Tick(published_ns, clock_ns))
        del self._ticks[:-CLOCKS]
        return self._ticks[-2] if len(self._ticks) > 1 else None

    def of(self, published_ns: int, stamp_ns: int) -> int:
        """Return the /clock in force when a message was published, however late it comes.

        A message from before the first one has the time of its stamp, where that is near, else that of the first one.
        There must be one.
        """
        following = bisect_right(self._ticks, published_ns, key=lambda tick: tick.published_ns)
        if following:
            return self._ticks[following - 1].clock_ns
        first_ns = self._ticks[0].clock_ns
        return stamp_ns if 0 <= first_ns - stamp_ns <= BEFORE_NS else first_ns
