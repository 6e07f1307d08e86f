# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What both simulators share: a node that publishes the samples of a run as simulated time asks for.

It paces itself by the monotonic clock: with use_sim_time the node's own clock would stand still until this node
moves it.
"""

import math
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType

from adhesion_node.core.atp.supervision import Severity
from adhesion_node.core.setting import Setting
from adhesion_node.nodes.ros.diagnostics import Diagnostics, Finding, Told
from adhesion_node.nodes.ros.discovery import PERIOD_S, Subscribers
from adhesion_node.nodes.ros.params import SettingsNode, declare
from adhesion_node.nodes.ros.qos import advertise
from adhesion_node.nodes.ros.types import new
from adhesion_node.wire.messages.parts import NS
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import CLOCK

from ..settings import SLOWEST

MAX_BURST = 10
"""Samples that one timer callback publishes at most, so that the node stays responsive while it catches up."""

SHORTEST_TIMER_S = 1e-3


class RunNode(SettingsNode, ABC):
    """Publishes the samples of a simulated run in time until it ends; logs its beginning, what changes, and its end."""

    def __init__(self, name: str, specs: Sequence[Setting], **kwargs: Any) -> None:
        """Read the parameters; ValueError when one is out of range."""
        super().__init__(name, automatically_declare_parameters_from_overrides=True, **kwargs)
        self.values = declare(self, specs)
        factor = self.values["real_time_factor"]
        if 0.0 < factor < SLOWEST:
            raise ValueError(f"real_time_factor = {factor!r}: give 0 (any speed) or at least {SLOWEST:g}")
        self.finished = False
        self.samples = 0
        """Number of samples published."""
        self.sent: Counter[Topic] = Counter()
        """Messages published by topic."""
        self.now_ns = 0
        """Time of the newest one, as on /clock."""
        self.truth: Any = None
        """The newest one."""
        self._start_ns = round(self.values["start_time_s"] * 1e9)
        self.changes: list[tuple[int, Any]] = []
        """When, as on /clock, what `news` tells began to be so."""
        self._ended = False
        self._monotonic = Clock(clock_type=ClockType.STEADY_TIME)
        self._begun_ns = 0

    def begin(self, run: Iterator[tuple[Any, Any]], topics: Sequence[Topic], period_s: float, *, paced: bool) -> None:
        """Take up a run of truths, with their `t_ns`, and what was measured; begin when the last topic is subscribed.

        Its samples come about every `period_s`. Unless `paced` there is no timer: the node's owner asks for every
        sample by `tick`.
        """
        self._run, self._period_s, self._awaited = run, period_s, topics[-1]
        self._ahead = next(run, None)
        self._outputs = {topic: advertise(self, topic) for topic in (CLOCK, *topics)}
        if paced:
            self._diagnostics = Diagnostics(self, "run", self.values, self.told, self.sent)
            if self.values["wait_for"]:
                self.log(f"waiting for {self.values['wait_for']} subscriber(s) to {self._awaited.name}")
            self._subscribers = Subscribers(
                self._outputs.values(), self._outputs[self._awaited], self.values["wait_for"]
            )
            self._timer = self.create_timer(PERIOD_S, self._on_wait, clock=self._monotonic)

    @property
    def ahead_s(self) -> float:
        """Time of the run at which the next sample comes; infinite at the end."""
        return math.inf if self._ahead is None else float(self._ahead[0].t_ns / NS)

    def tick(self) -> bool:
        """Publish the next sample; False when the scenario has ended and nothing was published."""
        scenario, sample = f"scenario {self.values['scenario']}", self._ahead
        if sample is None:
            if not self._ended:
                self._ended, self.finished = True, self.values["exit_at_end"]
                self.log(f"{scenario}: ended after {self.samples} samples")
            return False
        if not self.samples:
            self.log(f"{scenario}: started at {self._start_ns / 1e9:.1f} s")
        truth, measured = sample
        self.truth = truth
        self._ahead = next(self._run, None)
        self.now_ns = self._start_ns + truth.t_ns
        state, news = self.news(truth)
        if not self.changes or state != self.changes[-1][1]:
            self.changes.append((self.now_ns, state))
            self.log(f"{truth.t_ns / 1e9:.1f} s: {news}")
        self.send(CLOCK, self.now_ns)
        self.publish(truth, measured)
        self.samples += 1
        return True

    def told(self) -> Told:
        """What there is to tell in /diagnostics."""
        waits = f"waiting for {self.values['wait_for']} subscriber(s) to {self._awaited.name}"
        state = "ended" if self._ended else "running" if self.samples else waits
        scenario = str(self.values["scenario"])
        numbers = {"samples": str(self.samples), "simulated_s": f"{self.now_ns / NS:.1f}"}
        return [Finding(Severity.OK, f"scenario {scenario}: {state}")], {"scenario": scenario, **numbers}

    @abstractmethod
    def news(self, truth: Any) -> tuple[Any, str]:
        """Return what is logged when it changes, and the words for it."""

    @abstractmethod
    def publish(self, truth: Any, measured: Any) -> None:
        """Publish a sample at `now_ns`."""

    def send(self, topic: Topic, *values: Any) -> None:
        """Publish what the topic's codec takes."""
        self._outputs[topic].publish(topic.build(new, *values))
        self.sent[topic] += 1

    def log(self, text: str) -> None:
        """Tell people."""
        self.get_logger().info(text)

    def _on_wait(self) -> None:
        """Begin as soon as the subscribers are there."""
        if self._subscribers.found():
            self._timer.cancel()
            self._begun_ns = self._monotonic.now().nanoseconds
            factor = self.values["real_time_factor"]
            fitting_s = self._period_s / factor if factor else 0.0
            self._timer = self.create_timer(max(fitting_s, SHORTEST_TIMER_S), self._on_timer, clock=self._monotonic)

    def _on_timer(self) -> None:
        elapsed_ns = self._monotonic.now().nanoseconds - self._begun_ns
        until_s = due_s(elapsed_ns, self.values["real_time_factor"], self._period_s)
        for _ in range(MAX_BURST):
            if self._ahead is not None and self.ahead_s > until_s:
                return
            if not self.tick():
                self._timer.cancel()
                return


def due_s(elapsed_ns: int, factor: float, period_s: float) -> float:
    """Time of the run up to which samples are to be published now.

    Half a period ahead, so that a timer that fires a little early does not put two samples into the next call.

    >>> due_s(0, 1.0, 0.1), due_s(10_000_000_000, 2.0, 0.1), due_s(0, 0.0, 0.1)
    (0.05, 20.05, inf)
    """
    return elapsed_ns / NS * factor + 0.5 * period_s if factor else math.inf
