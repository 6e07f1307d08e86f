# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The creep estimator: wheel speeds, train speed and traction force in, the peak of the creep curve out.

::

    wheel_speed, speed, traction_force  ->  creep/mu_max, creep/lambda_m, /diagnostics

Nothing is published on creep/* while the data cannot tell the peak; /diagnostics says why. Every message goes through
`CreepPipeline`, as in an offline replay; stamps drive the work, no timer does.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from rclpy.node import Node

from adhesion_node.core import Event
from adhesion_node.core.atp.supervision import Severity
from adhesion_node.core.creep.estimator import CreepEstimate
from adhesion_node.run.creep_pipeline import SETTINGS, CreepPipeline, setup_of
from adhesion_node.wire import codecs as reading
from adhesion_node.wire import topics
from adhesion_node.wire.topics import Topic

from .ros import qos, runtime
from .ros.diagnostics import Finding, next_stamp, status_message
from .ros.intake import Intake
from .ros.params import declare, spec_of
from .ros.types import new

PARAMETERS = tuple(map(spec_of, SETTINGS))

EXAMPLES = ("creep_estimator", "creep_estimator --ros-args -p axles:=4 -p wheel_radius_m:=0.46")

OUTPUTS = (*topics.CREEP_RESULTS, topics.DIAGNOSTICS)


class CreepEstimator(Node):
    """Identifies the creep curve while the train pulls and publishes its peak as soon as the data tell it.

    `heard` counts the messages received by topic, refused ones included; `published` those sent.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("creep_estimator", automatically_declare_parameters_from_overrides=True, **kwargs)
        setup = setup_of(declare(self, PARAMETERS))
        self._pipeline = CreepPipeline(setup.config)
        self._reported_ns = 0
        self._entry = f"{self.get_fully_qualified_name().lstrip('/')}/peak"
        self.published: Counter[Topic] = Counter()
        self._intake = Intake(self, self, topics.CREEP_INPUTS, setup.line, setup.sensor_timeout_s)
        self._outputs = {topic: qos.advertise(self, topic, tell=self._intake.tell) for topic in OUTPUTS}

    @property
    def heard(self) -> Counter[Topic]:
        """Messages received by topic."""
        return self._intake.heard

    @property
    def latest(self) -> CreepEstimate | None:
        """The newest estimate, withheld or not."""
        return self._pipeline.last

    @property
    def digest(self) -> str:
        """SHA-256 over every number so far, the same as that of an offline replay."""
        return self._pipeline.digest

    def close(self) -> None:
        """Use what still waits for its pair."""
        self._publish(self._pipeline.finish())
        self.get_logger().info(
            f"{self._pipeline.accepted} samples, dropped {self._pipeline.dropped or 'none'}, digest {self.digest}"
        )

    def take(self, sample: Any) -> tuple[Event, ...]:
        """Use a sample and publish what it completes."""
        estimates = self._pipeline.push(sample)
        events = self._pipeline.events
        self._publish(estimates)
        return events

    def settle(self) -> None:
        """Silence: publish what has waited for others of its time."""
        self._publish(self._pipeline.settle())

    def refuse(self, topic: Topic, refusal: reading.Rejected) -> None:
        """Count a refused message."""
        self._pipeline.refuse(topic.name, refusal.reason)

    def report(self) -> None:
        """Publish the state of affairs in /diagnostics."""
        self._report(self._intake.now_ns)

    def _report(self, t_ns: int) -> None:
        self._reported_ns = next_stamp(t_ns, self._reported_ns)
        found = [*self._intake.findings(), _finding(self._pipeline.last)]
        self._send(topics.DIAGNOSTICS, status_message(self._reported_ns, self._entry, found, _values(self._pipeline)))

    def _publish(self, estimates: list[CreepEstimate]) -> None:
        for estimate in estimates:
            for topic in topics.CREEP_RESULTS:
                message = topic.build(new, estimate)
                if message is not None:
                    self._send(topic, message)
            self._report(estimate.t_ns)

    def _send(self, topic: Topic, message: Any) -> None:
        self._outputs[topic].publish(message)
        self.published[topic] += 1


def _finding(last: CreepEstimate | None) -> Finding:
    if last is None:
        return Finding(Severity.OK, "no estimate yet")
    return Finding(Severity.OK if last.known else Severity.WARN, last.status.value)


def _values(pipeline: CreepPipeline) -> dict[str, str]:
    last = pipeline.last
    numbers = {} if last is None else {"peak": last.status.name, "withheld": str(not last.known).lower()}
    if last is not None:
        items = last._asdict().items()
        numbers |= {name: f"{value:.6g}" for name, value in items if isinstance(value, float)}
    counts = {"samples": str(pipeline.accepted), "resets": str(pipeline.resets)}
    drops = {f"dropped.{reason}": str(count) for reason, count in pipeline.dropped.items()}
    return {**numbers, **counts, **drops, "digest": pipeline.digest}


def main(args: Sequence[str] | None = None) -> int:
    """Run the node as a program."""
    return runtime.run(CreepEstimator, args, PARAMETERS, EXAMPLES)
