# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The node behind the live page: subscribes to what the other nodes say and keeps a `View` of it.

::

    position, fix, odometry, brake_pressure, speed, adhesion/*, atp/status, /diagnostics, truth/mu  ->  a page
"""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from ..core.atp.supervision import Severity
from ..nodes.ros import qos
from ..nodes.ros.diagnostics import Diagnostics, Finding, Told
from ..nodes.ros.params import SettingsNode, declare
from ..wire import topics
from ..wire.messages.refused import Rejected
from ..wire.messages.results import Statuses
from ..wire.settings.telling import TELLING
from ..wire.topic import Frame, Topic
from .view import View

PERIOD_S = 0.1
"""Time between two looks of a page at the view."""


class Live(SettingsNode):
    """Shows the run in a browser: speed against its limits, adhesion with its bound, health of the inputs.

    `--host` and `--port` say where the page is served; by default only this machine sees it.
    """

    def __init__(self, host: str, port: int, **kwargs: Any) -> None:
        """Serve at once. Raises ValueError when the address is taken, or aiohttp is missing."""
        super().__init__("live", automatically_declare_parameters_from_overrides=True, **kwargs)
        values = declare(self, TELLING, quiet=True)
        self.view = View()
        for topic, take in self._inputs().items():
            qos.subscribe(self, topic, self._receiver(topic, take))
        for topic in topics.POSITIONS:  # one as good as the other; where the train is the estimator says
            if topic is not topics.POSITION:
                qos.subscribe(self, topic, lambda _: self.view.heard(topics.POSITION, time.monotonic()))
        try:
            from .guard import exposure
            from .server import Server
        except ModuleNotFoundError as error:
            raise ValueError(f"{error.name} is missing: pip install '.[live]'") from error
        self.server = Server(host, port, lambda: self.view.parts(time.monotonic()), PERIOD_S)
        self.warning = exposure(host)
        """Who else sees the page; empty: nobody."""
        if self.warning:
            self.get_logger().warning(self.warning)
        self._diagnostics = Diagnostics(self, "page", values, self._told)
        self.get_logger().info(f"open {self.server.url}")

    def close(self) -> None:
        """End the pages and give the address back."""
        self.server.close()

    def _told(self) -> Told:
        found = [Finding(Severity.OK, f"open {self.server.url}")]
        if self.warning:
            found.append(Finding(Severity.WARN, self.warning))
        now_s, heard = time.monotonic(), self.view.last_heard()
        ages = {f"age_s.{name}": f"{now_s - at_s:.1f}" for name, at_s in heard.items()}
        return found, {"viewers": str(self.server.viewers), **ages}

    def _inputs(self) -> dict[Topic, Callable[[Any], None]]:
        """How what is read of each topic is taken, in the order in which the estimator publishes."""
        view = self.view
        return {
            topics.BRAKE_PRESSURE: lambda sample: None,
            topics.SPEED: lambda sample: None,
            topics.POSITION: lambda sample: view.place(sample.position_m),
            topics.TRUTH_MU: partial(view.adhesion, "true_mu"),
            topics.MU: partial(view.adhesion, "mu"),
            topics.MU_LOWER: partial(view.adhesion, "mu_lower"),
            topics.STATE: view.train,
            topics.BRAKING_CURVE: partial(view.curve, "safe"),
            topics.BRAKING_CURVE_NOMINAL: partial(view.curve, "nominal"),
            topics.DIAGNOSTICS: self._on_diagnostics,
            topics.ATP_STATUS: self._on_status,
        }

    def _receiver(self, topic: Topic, take: Callable[[Any], None]) -> Callable[[Any], None]:
        # Which frame places are to have is a parameter of the estimator, which says so if it is another.
        read = topic._replace(frame=Frame.ANY).read

        def receive(message: Any) -> None:
            refusal = ""
            try:
                take(read(message))
            except Rejected as refused:
                refusal = str(refused)
            self.view.heard(topic, time.monotonic(), refusal)

        return receive

    def _on_diagnostics(self, read: Statuses) -> None:
        own = self.get_namespace().strip("/")
        for status in read.entries:  # /diagnostics is shared with everybody
            if status.namespace != own:
                continue
            if "regime" in status.values:
                self.view.estimated(status.values, status.message, status.level > 0)
            elif "lambda_m" in status.values:
                self.view.creep(status.values, status.message, time.monotonic())

    def _on_status(self, read: Statuses) -> None:
        for status in read.entries:
            self.view.supervised(status.values, status.message)
