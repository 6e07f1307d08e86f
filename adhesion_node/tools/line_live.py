# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The line at real time with a page in the browser, until Ctrl-C."""

import time
from collections.abc import Callable

from rclpy.executors import SingleThreadedExecutor

from ..command.signals import StopRequest
from ..live.node import Live

SAMPLE_S = 0.1
"""Time between two samples of the simulator."""

POLL_S = 0.05
"""Longest time until a signal is seen."""


class LivePage:
    """The page of a line. Raises OSError when the address is taken, ValueError when aiohttp is missing."""

    def __init__(self, executor: SingleThreadedExecutor, host: str, port: int, stop: StopRequest) -> None:
        self._executor = executor
        self._stop = stop
        self._started_s: float | None = None
        self._node = Live(host, port, context=executor.context)
        executor.add_node(self._node)

    @property
    def url(self) -> str:
        """Where the page is."""
        return str(self._node.server.url)

    def wait_for_viewer(self) -> bool:
        """Wait until the page is open somewhere; False when a signal came first."""
        return self._spin(lambda: bool(self._node.server.viewers))

    def pace(self, samples: int) -> bool:
        """Wait until the sample after so many is due, the first at once; False when a signal has come."""
        if self._started_s is None:
            self._started_s = time.monotonic()
        due_s = self._started_s + SAMPLE_S * samples
        return self._spin(lambda: time.monotonic() >= due_s)

    def freeze(self) -> None:
        """The run has ended: show it as it is now."""
        self._node.view.end(time.monotonic())

    def hold(self) -> None:
        """Keep the page until a signal comes."""
        while not self._stop.requested:  # without spinning: the nodes would complain that the clock stands still
            time.sleep(POLL_S)

    def close(self) -> None:
        """Close the page."""
        self._node.close()

    def _spin(self, done: Callable[[], bool]) -> bool:
        while not done():
            if self._stop.requested:
                return False
            self._executor.spin_once(timeout_sec=POLL_S)
        return not self._stop.requested
