# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""What both simulators share: the parameters of a run, and a timer that calls for samples as simulated time asks for.

It paces itself by the monotonic clock: with use_sim_time the node's own clock would stand still until this node
moves it.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

MAX_BURST = 10
"""Samples that one timer callback publishes at most, so that the node stays responsive while it catches up."""

SHORTEST_TIMER_S = 1e-3


class Pace:
    """Calls `tick`, which publishes a sample and returns False at the end of the run, in time; begins once `ready`."""

    def __init__(
        self, node: Node, period_s: float, factor: float, ready: Callable[[], bool], tick: Callable[[], bool]
    ) -> None:
        """Begin with the node's spinning; `factor` 0 is as fast as possible."""
        self._period_s, self._factor = period_s, factor
        self._ready, self._tick = ready, tick
        self._monotonic = Clock(clock_type=ClockType.STEADY_TIME)
        self._begun_ns: int | None = None
        self._ticked = 0
        fitting_s = period_s / factor if factor else 0.0
        self._timer = node.create_timer(max(fitting_s, SHORTEST_TIMER_S), self._on_timer, clock=self._monotonic)

    def _on_timer(self) -> None:
        now_ns = self._monotonic.now().nanoseconds
        if self._begun_ns is None:
            if not self._ready():
                return
            self._begun_ns = now_ns
        for _ in range(due(now_ns - self._begun_ns, self._factor, self._period_s, self._ticked)):
            if not self._tick():
                self._timer.cancel()
                return
            self._ticked += 1


def due(elapsed_ns: int, factor: float, period_s: float, published: int) -> int:
    """Samples to publish now, 0 to `MAX_BURST`.

    Rounded to the nearest sample, so that a timer that fires a little early does not put two into the next call.

    >>> due(0, 1.0, 0.1, 0), due(99_000_000, 1.0, 0.1, 1), due(10_000_000_000, 1.0, 0.1, 5), due(0, 0.0, 0.1, 50)
    (1, 1, 10, 10)
    """
    if factor == 0.0:
        return MAX_BURST
    total = math.floor(elapsed_ns / 1e9 * factor / period_s + 0.5) + 1
    return min(max(total - published, 0), MAX_BURST)
