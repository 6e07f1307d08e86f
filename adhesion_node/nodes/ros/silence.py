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

from rclpy.clock import Clock, ROSClock
from rclpy.clock_type import ClockType
from rclpy.node import Node

TICKS = 5
"""Ticks in the time after which a topic counts as silent."""

REPEAT_S = 1.0
"""Time between two reports of a silence that goes on."""

CLOCK_S = 2.0
"""A simulated clock that moves less often stands still."""


class Silence:
    """Watches one topic; calls `report` when it falls silent and every second from then on."""

    def __init__(self, node: Node, timeout_s: float, report: Callable[[], None]) -> None:
        self.for_s: float | None = None
        """How long the topic has been silent; None while it is not."""
        self.ever_heard = False
        self._node, self._timeout_s, self._report = node, timeout_s, report
        self._ticks = 0
        self._heard_ns = 0
        self._timer = node.create_timer(self._period_s, self._on_tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def wait(self) -> None:
        """Begin to wait anew."""
        self.ever_heard, self.for_s, self._ticks = False, None, 0

    def change(self, timeout_s: float) -> None:
        """Wait so long from now on."""
        self._timeout_s, self._ticks = timeout_s, 0
        self._timer.timer_period_ns = round(self._period_s * 1e9)

    @property
    def _period_s(self) -> float:
        return self._timeout_s / TICKS

    def heard(self) -> None:
        """Note a message."""
        self.ever_heard, self.for_s, self._ticks = True, None, 0
        self._heard_ns = self._node.get_clock().now().nanoseconds

    def _on_tick(self) -> None:
        self._ticks += 1
        passed_s = (self._ticks - 1) * self._period_s
        clock = self._node.get_clock()
        if isinstance(clock, ROSClock) and clock.ros_time_is_active:
            simulated_s = (clock.now().nanoseconds - self._heard_ns) * 1e-9 if self.ever_heard else 0.0
            silent_s = simulated_s if simulated_s > self._timeout_s else passed_s if passed_s >= CLOCK_S else None
        else:
            silent_s = passed_s if passed_s >= self._timeout_s else None
        new = self.for_s is None
        self.for_s = silent_s
        if silent_s is not None and (new or self._ticks % max(round(REPEAT_S / self._period_s), 1) == 0):
            self._report()
