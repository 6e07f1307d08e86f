# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Notices that a topic has fallen silent. For /diagnostics alone: no result depends on it.

Silence is counted in ticks of a monotonic timer, so that a process that was held up does not blame its sensors. With
use_sim_time it is measured by /clock, however fast that runs, and a /clock that stands still is told by the ticks.
"""

from collections.abc import Callable
from typing import NamedTuple

from rclpy.clock import Clock, ROSClock
from rclpy.clock_type import ClockType
from rclpy.node import Node

TICKS = 5
"""Ticks in the time after which a topic counts as silent."""

REPEAT_NS = 1_000_000_000
"""Time between two reports of a silence that goes on."""

CLOCK_NS = 2_000_000_000
"""A simulated clock that moves less often stands still."""


class Moment(NamedTuple):
    """When a message came."""

    ticked_ns: int
    """By the ticks."""
    clock_ns: int | None
    """By /clock with use_sim_time, else by the ticks; None: of no message, when waiting for one began."""


class Silence:
    """Watches one topic; calls `report` when it falls silent and every second from then on."""

    def __init__(self, node: Node, timeout_s: float, report: Callable[[], None]) -> None:
        self.for_s: float | None = None
        """How long the topic has been silent; None while it is not."""
        self._node, self._report = node, report
        self._period_ns, self._ticked_ns = _period_ns(timeout_s), 0
        self._last = Moment(0, None)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(timeout_s / TICKS, self._on_tick, clock=steady)

    @property
    def ever_heard(self) -> bool:
        """Whether a message has come since waiting began."""
        return self._last.clock_ns is not None

    def wait(self) -> None:
        """Begin to wait anew."""
        self.for_s, self._last = None, Moment(self._ticked_ns, None)

    def change(self, timeout_s: float) -> None:
        """Wait so long from now on."""
        self._period_ns = self._timer.timer_period_ns = _period_ns(timeout_s)

    def heard(self) -> None:
        """Note a message."""
        self.for_s, self._last = None, self.now()

    def now(self) -> Moment:
        """When a message comes that comes now."""
        simulated_ns = self._simulated_ns()
        return Moment(self._ticked_ns, self._ticked_ns if simulated_ns is None else simulated_ns)

    def since_s(self, moment: Moment) -> float | None:
        """How long nothing has come since then; None within the timeout."""
        timeout_ns = least_ns = TICKS * self._period_ns
        simulated_ns = self._simulated_ns()
        if simulated_ns is not None:
            gone_ns = 0 if moment.clock_ns is None else simulated_ns - moment.clock_ns
            if gone_ns > timeout_ns:
                return gone_ns * 1e-9
            least_ns = CLOCK_NS
        passed_ns = self._ticked_ns - moment.ticked_ns - self._period_ns
        return passed_ns * 1e-9 if passed_ns >= least_ns else None

    def _simulated_ns(self) -> int | None:
        clock = self._node.get_clock()
        return clock.now().nanoseconds if isinstance(clock, ROSClock) and clock.ros_time_is_active else None

    def _on_tick(self) -> None:
        self._ticked_ns += self._period_ns
        new = self.for_s is None
        self.for_s = self.since_s(self._last)
        if self.for_s is not None and (new or self._ticked_ns % REPEAT_NS < self._period_ns):
            self._report()


def _period_ns(timeout_s: float) -> int:
    return round(timeout_s / TICKS * 1e9)
