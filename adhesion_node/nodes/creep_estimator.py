"""The creep estimator: wheel speeds, train speed and traction force in, the peak of the creep curve out.

::

    wheel_speed, speed, traction_force  ->  creep/mu_max, creep/lambda_m, /diagnostics

Nothing is published on creep/* while the data cannot tell the peak; /diagnostics says why. Every message goes through
`CreepPipeline`, as in an offline replay; stamps drive the work, no timer does.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from adhesion_node import reading, topics
from adhesion_node.core.creep import CreepEstimate
from adhesion_node.core.creep_config import CreepOutcome
from adhesion_node.creep_pipeline import READERS, SETTINGS, CreepPipeline, setup_of

from . import convert, qos, runtime
from .params import declare, spec_of

REPORT_EVERY = 10
"""The first refused message of its kind and then every tenth reach the operator."""

PARAMETERS = tuple(map(spec_of, SETTINGS))

INPUTS = (topics.SPEED, topics.TRACTION_FORCE, topics.WHEEL_SPEED)

EXAMPLES = ("creep_estimator", "creep_estimator --ros-args -p axles:=4 -p wheel_radius_m:=0.46")

OUTPUTS = (*topics.CREEP_RESULTS, topics.DIAGNOSTICS)


class CreepEstimator(Node):
    """Identifies the creep curve while the train pulls and publishes its peak as soon as the data tell it.

    `heard` counts the messages received by topic, refused ones included; `published` those sent.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("creep_estimator", automatically_declare_parameters_from_overrides=True, **kwargs)
        setup = setup_of(declare(self, PARAMETERS))
        self._frame = setup.frame
        self._pipeline = CreepPipeline(setup.config, setup.vehicle)
        self._newest_ns = 0
        self.heard: Counter[topics.Topic] = Counter()
        self.published: Counter[topics.Topic] = Counter()
        self._outputs = {topic: qos.advertise(self, topic, qos.RESULT) for topic in OUTPUTS}
        for topic in INPUTS:
            qos.subscribe(self, topic, self._receiver(topic), qos.SENSOR_SUBSCRIPTION)
        self.get_logger().info(f"ready: waiting for {self.resolve_topic_name(topics.WHEEL_SPEED.name)}")

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

    def _receiver(self, topic: topics.Topic) -> Callable[[Any], None]:
        def receive(message: Any) -> None:
            self.heard[topic] += 1
            try:
                sample = READERS[topic.name](message, self._frame)
            except reading.Rejected as refusal:
                self._refuse(topic, refusal)
            else:
                self._newest_ns = max(self._newest_ns, sample.t_ns)
                self._publish(self._pipeline.push(sample))

        return receive

    def _refuse(self, topic: topics.Topic, refusal: reading.Rejected) -> None:
        self._pipeline.refuse(refusal.reason)
        count = self._pipeline.dropped_early[refusal.reason]
        if count % REPORT_EVERY == 1:
            self.get_logger().warning(f"{topic.name}: {refusal} ({count} so far)")
            self._send(topics.DIAGNOSTICS, diagnostics_message(self._newest_ns, self._pipeline, str(refusal)))

    def _publish(self, estimates: list[CreepEstimate]) -> None:
        for estimate in estimates:
            if estimate.known:
                self._send(topics.CREEP_MU_MAX, convert.mu_message(estimate.mu_max))
                self._send(topics.CREEP_LAMBDA_M, convert.mu_message(estimate.lambda_m))
            self._send(topics.DIAGNOSTICS, diagnostics_message(estimate.t_ns, self._pipeline))

    def _send(self, topic: topics.Topic, message: Any) -> None:
        self._outputs[topic].publish(message)
        self.published[topic] += 1


def diagnostics_message(t_ns: int, pipeline: CreepPipeline, refusal: str = "") -> DiagnosticArray:
    """Build the status at `t_ns`; `refusal` says why a message has just been refused."""
    last = pipeline.last
    level, message = DiagnosticStatus.OK, "no estimate yet"
    if refusal:
        level, message = DiagnosticStatus.WARN, f"message refused: {refusal}"
    elif last is not None:
        level, message = (DiagnosticStatus.OK if last.known else DiagnosticStatus.WARN), last.status.value
    values = [KeyValue(key=key, value=value) for key, value in _values(pipeline).items()]
    status = DiagnosticStatus(level=level, name="creep_estimator/peak", message=message, values=values)
    return DiagnosticArray(header=convert.header(t_ns), status=[status])


def _values(pipeline: CreepPipeline) -> dict[str, str]:
    last = pipeline.last
    numbers = {} if last is None else {"peak": last.status.name, "withheld": str(not last.known).lower()}
    if last is not None:
        items = last._asdict().items()
        numbers |= {name: f"{value:.6g}" for name, value in items if isinstance(value, float)}
    counts = {"samples": str(pipeline.accepted), "resets": str(pipeline.state.counts[CreepOutcome.RESET])}
    drops = {f"dropped.{reason}": str(count) for reason, count in pipeline.dropped.items()}
    return {**numbers, **counts, **drops, "digest": pipeline.digest}


def main(args: Sequence[str] | None = None) -> int:
    """Run the node as a program."""
    return runtime.run(CreepEstimator, args, PARAMETERS, EXAMPLES)
