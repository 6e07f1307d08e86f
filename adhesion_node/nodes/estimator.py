# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The estimator: position and brake pressure in, adhesion with its bound and the braking curves out.

::

    position, brake_pressure, speed, wheel_speed  ->  adhesion/*, /diagnostics
    ~/reset, ~/set_enabled                            services

Every message goes through `Pipeline`, as in an offline replay; stamps drive the work. The one timer watches for
silence and speaks in /diagnostics alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from adhesion_node.core import Config, Estimate, Event
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire import codecs as reading
from adhesion_node.wire import topics
from adhesion_node.wire.settings import SETTINGS, setup_of
from adhesion_node.wire.topics import Topic

from .health import findings, values
from .ros import qos, runtime
from .ros.diagnostics import next_stamp, status_message
from .ros.intake import Intake
from .ros.params import declare, spec_of
from .ros.types import new

PARAMETERS = tuple(map(spec_of, SETTINGS))

EXAMPLES = (
    "estimator",
    "estimator --ros-args -p train.mass_kg:=450000.0 -p track:='tunnel 3000 9000'",
    "estimator --ros-args --params-file my_train.yaml -r __ns:=/train1",
)

OUTPUTS = (*topics.RESULTS, topics.DIAGNOSTICS)


class Estimator(Node):
    """Identifies the adhesion while the train brakes and publishes the braking curve that follows from it.

    `heard` counts the messages received by topic, refused ones included; `published` those sent.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("estimator", automatically_declare_parameters_from_overrides=True, **kwargs)
        setup = setup_of(declare(self, PARAMETERS))
        self._pipeline = Pipeline(setup.config, setup.seed)
        self._reported_ns = 0
        self._entry = f"{self.get_fully_qualified_name().lstrip('/')}/adhesion"
        self.published: Counter[Topic] = Counter()
        self._intake = Intake(self, self, topics.ADHESION_INPUTS, setup.line, setup.sensor_timeout_s)
        self._outputs = {topic: qos.advertise(self, topic, tell=self._intake.tell) for topic in OUTPUTS}
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_service(SetBool, "~/set_enabled", self._on_set_enabled)

    @property
    def heard(self) -> Counter[Topic]:
        """Messages received by topic."""
        return self._intake.heard

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

    def take(self, sample: Any) -> tuple[Event, ...]:
        """Use a sample and publish what it completes."""
        predictions = self._pipeline.push(sample)
        events = self._pipeline.events
        self._publish(predictions)
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
        found = [*self._intake.findings(), *findings(self._pipeline)]
        self._send(topics.DIAGNOSTICS, status_message(self._reported_ns, self._entry, found, values(self._pipeline)))

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._publish(self._pipeline.reset())
        response.success, response.message = True, "started anew"
        self.get_logger().info(f"~/reset: {response.message}")
        self.report()
        return response

    def _on_set_enabled(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        if self._intake.enabled and not request.data:
            self._publish(self._pipeline.reset())
        self._intake.enabled = request.data
        response.success, response.message = True, "enabled" if request.data else "disabled: nothing is identified"
        self.get_logger().info(f"~/set_enabled: {response.message}")
        self.report()
        return response

    def _publish(self, predictions: list[Prediction]) -> None:
        for prediction in predictions:
            for topic in topics.RESULTS:
                message = topic.build(new, prediction)
                if message is not None:
                    self._send(topic, message)
            self._report(prediction.estimate.t_ns)

    def _send(self, topic: Topic, message: Any) -> None:
        self._outputs[topic].publish(message)
        self.published[topic] += 1


def main(args: Sequence[str] | None = None) -> int:
    """Run the node as a program."""
    return runtime.run(Estimator, args, PARAMETERS, EXAMPLES)
