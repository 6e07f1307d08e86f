# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The node behind the live page: subscribes to what the other nodes say and keeps a `View` of it.

::

    position, brake_pressure, speed, adhesion/*, atp/status, /diagnostics, truth/mu  ->  a page in the browser
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from ..core.intake.samples import MAX_POSITION_M
from ..nodes.ros import messages as convert
from ..nodes.ros import qos
from ..wire import codecs as reading
from ..wire import topics
from .view import View

PERIOD_S = 0.1
"""Time between two looks of a page at the view."""


class Live(Node):
    """Shows the run in a browser: speed against its limits, adhesion with its bound, health of the inputs.

    `--host` and `--port` say where the page is served; by default only this machine sees it.
    """

    def __init__(self, host: str, port: int, **kwargs: Any) -> None:
        """Serve at once. Raises OSError when the address is taken, ValueError when aiohttp is missing."""
        super().__init__("live", **kwargs)
        self.view = View()
        for topic, (take, profile) in self._inputs().items():
            qos.subscribe(self, topic, self._receiver(topic, take), profile)
        self.server = _server(host, port, lambda: self.view.parts(time.monotonic()))
        self.get_logger().info(f"open {self.server.url}")

    def close(self) -> None:
        """End the pages and give the address back."""
        self.server.close()

    def _inputs(self) -> dict[topics.Topic, tuple[Callable[[Any], None], Any]]:
        """How each topic is taken, in the order in which the estimator publishes."""
        view = self.view
        return {
            topics.BRAKE_PRESSURE: (lambda message: None, qos.SENSOR_SUBSCRIPTION),
            topics.SPEED: (lambda message: None, qos.SENSOR_SUBSCRIPTION),
            topics.POSITION: (self._on_position, qos.SENSOR_SUBSCRIPTION),
            topics.TRUTH_MU: (self._adhesion("true_mu"), qos.SENSOR_SUBSCRIPTION),
            topics.MU: (self._adhesion("mu"), qos.RESULT),
            topics.MU_LOWER: (self._adhesion("mu_lower"), qos.RESULT),
            topics.STATE: (lambda message: view.train(convert.state(message)), qos.RESULT),
            topics.BRAKING_CURVE: (self._curve("safe"), qos.LATCHED),
            topics.BRAKING_CURVE_NOMINAL: (self._curve("nominal"), qos.LATCHED),
            topics.DIAGNOSTICS: (self._on_diagnostics, qos.RESULT),
            topics.ATP_STATUS: (self._on_status, qos.RESULT),
        }

    def _receiver(self, topic: topics.Topic, take: Callable[[Any], None]) -> Callable[[Any], None]:
        def receive(message: Any) -> None:
            refusal = ""
            try:
                take(message)
            except reading.Rejected as refused:
                refusal = str(refused)
            self.view.heard(topic, time.monotonic(), refusal)

        return receive

    def _adhesion(self, name: str) -> Callable[[Any], None]:
        return lambda message: self.view.adhesion(name, reading.finite(name, message.data))

    def _curve(self, name: str) -> Callable[[Any], None]:
        def take(message: Any) -> None:
            _, braking = convert.curve(message)
            self.view.curve(name, message.points[0].positions[0], braking)

        return take

    def _on_position(self, message: Any) -> None:
        place = message.pose.pose.position.x
        self.view.place(reading.plausible("position x", place, MAX_POSITION_M, reading.Reason.IMPLAUSIBLE_POSITION))

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            if "regime" in values:  # /diagnostics is shared with everybody
                self.view.estimated(values, status.message)

    def _on_status(self, message: Any) -> None:
        for status in message.status:
            self.view.supervised({pair.key: pair.value for pair in status.values}, status.message)


def _server(host: str, port: int, parts: Callable[[], dict[str, Any]]) -> Any:
    try:
        from .server import Server
    except ModuleNotFoundError as error:
        raise ValueError(f"{error.name} is missing: pip install '.[live]'") from error
    return Server(host, port, parts, PERIOD_S)
