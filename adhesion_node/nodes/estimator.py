"""The estimator: position and brake pressure in, adhesion with its bound and the braking curves out.

::

    position, brake_pressure, speed, wheel_speed  ->  adhesion/*, /diagnostics

Every message goes through `Pipeline`, as in an offline replay; stamps drive the work, no timer does.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from rclpy.node import Node

from adhesion_node import reading, topics
from adhesion_node.core import Config, Estimate
from adhesion_node.core.align import Sample
from adhesion_node.core.prediction import Prediction
from adhesion_node.pipeline import Pipeline
from adhesion_node.settings import SETTINGS, setup_of

from . import convert, qos, runtime
from .diagnostics import diagnostics_message
from .params import declare, spec_of

PARAMETERS = tuple(map(spec_of, SETTINGS))

EXAMPLES = (
    "estimator",
    "estimator --ros-args -p train.mass_kg:=450000.0 -p track:='tunnel 3000 9000'",
    "estimator --ros-args --params-file my_train.yaml -r __ns:=/train1",
)


OUTPUTS = {
    topics.MU: qos.RESULT,
    topics.MU_LOWER: qos.RESULT,
    topics.DECELERATION: qos.RESULT,
    topics.STATE: qos.RESULT,
    topics.BRAKING_CURVE: qos.LATCHED,
    topics.BRAKING_CURVE_NOMINAL: qos.LATCHED,
    topics.DIAGNOSTICS: qos.RESULT,
}
"""What the node publishes, in the order of publishing."""


SAID_EVERY = 10
"""Of the messages refused for one reason, the first and then every tenth is said."""


class Estimator(Node):
    """Identifies the adhesion while the train brakes and publishes the braking curve that follows from it.

    `heard` counts the messages received by topic, refused ones included; `published` those sent.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("estimator", automatically_declare_parameters_from_overrides=True, **kwargs)
        setup = setup_of(declare(self, PARAMETERS))
        self._frame = setup.frame
        self._pipeline = Pipeline(setup.config, setup.seed)
        self._newest_ns = 0
        self.heard: Counter[topics.Topic] = Counter()
        self.published: Counter[topics.Topic] = Counter()
        self._outputs = {topic: qos.advertise(self, topic, profile) for topic, profile in OUTPUTS.items()}
        for topic, read in (
            (topics.BRAKE_PRESSURE, reading.brake_pressure),
            (topics.SPEED, reading.speed),
            (topics.WHEEL_SPEED, reading.wheel_speed),
            (topics.POSITION, reading.position),
        ):
            qos.subscribe(self, topic, self._receiver(topic, read), qos.SENSOR_SUBSCRIPTION)
        self.get_logger().info(f"ready: waiting for {self.resolve_topic_name(topics.POSITION.name)}")

    @property
    def config(self) -> Config:
        """The configuration that the parameters gave."""
        return self._pipeline.config

    @property
    def latest(self) -> Estimate | None:
        """The estimate published last."""
        return self._pipeline.last

    @property
    def digest(self) -> str:
        """SHA-256 over every number published so far, the same as that of an offline replay."""
        return self._pipeline.digest

    def close(self) -> None:
        """Evaluate the last, short window and publish it."""
        self._publish(self._pipeline.finish())
        self.get_logger().info(
            f"{self._pipeline.measurements} measurements, {self._pipeline.windows} windows, "
            f"dropped {self._pipeline.dropped or 'none'}, digest {self.digest}"
        )

    def _receiver(self, topic: topics.Topic, read: Callable[[Any, str], Sample]) -> Callable[[Any], None]:
        def receive(message: Any) -> None:
            self.heard[topic] += 1
            try:
                sample = read(message, self._frame)
            except reading.Rejected as refusal:
                self._refuse(topic, refusal)
            else:
                self._newest_ns = max(self._newest_ns, sample.t_ns)
                self._publish(self._pipeline.push(sample))

        return receive

    def _refuse(self, topic: topics.Topic, refusal: reading.Rejected) -> None:
        """Count a refused message; the first of its kind and then some reach the operator."""
        self._pipeline.refuse(topic.name, refusal.reason)
        count = self._pipeline.refused[refusal.reason]
        if count % SAID_EVERY == 1:
            self.get_logger().warning(f"{topic.name}: {refusal} ({count} so far)")
            self._send(topics.DIAGNOSTICS, diagnostics_message(self._newest_ns, self._pipeline, str(refusal)))

    def _publish(self, predictions: list[Prediction]) -> None:
        for prediction in predictions:
            estimate = prediction.estimate
            t_ns, place = estimate.t_ns, estimate.position_m
            self._send(topics.MU, convert.mu_message(estimate.mu))
            self._send(topics.MU_LOWER, convert.mu_message(estimate.mu_lower))
            self._send(topics.DECELERATION, convert.deceleration_message(t_ns, estimate.mu, estimate.mu_std))
            variances = estimate.position_std_m**2, estimate.speed_std_mps**2
            self._send(topics.STATE, convert.state_message(t_ns, place, variances[0], estimate.speed_mps, variances[1]))
            for topic, curve in (
                (topics.BRAKING_CURVE, prediction.safe),
                (topics.BRAKING_CURVE_NOMINAL, prediction.nominal),
            ):
                if curve is not None:
                    self._send(topic, convert.curve_message(t_ns, curve, place))
            self._send(topics.DIAGNOSTICS, diagnostics_message(t_ns, self._pipeline))

    def _send(self, topic: topics.Topic, message: Any) -> None:
        self._outputs[topic].publish(message)
        self.published[topic] += 1


def main(args: Sequence[str] | None = None) -> int:
    """Run the node as a program."""
    return runtime.run(Estimator, args, PARAMETERS, EXAMPLES)
