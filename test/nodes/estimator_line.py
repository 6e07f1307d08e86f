# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""An estimator as a node, and who publishes for it and listens."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import messages
from conftest import SpinUntil
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core.intake.samples import PositionSample, PressureSample
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.ros import qos
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire import topics
from adhesion_node.wire.line import ATMOSPHERE_PA
from adhesion_node.wire.settings.setup import setup_of
from adhesion_node.wire.topic import Topic
from sim_node.train import scenario
from sim_node.train.plant import Truth
from sim_node.train.run import run
from sim_node.train.sensors import Reading

S = 10**9
FAST = {"iterations": 3, "particles": 10}
"""EM that is quick rather than good: these tests compare runs, not accuracy."""

Sample = tuple[Truth, Reading]


@dataclass
class Line:
    """An estimator, a driver that publishes sensors and listens to everything."""

    executor: SingleThreadedExecutor
    spin_until: SpinUntil
    estimator: Estimator
    driver: Node
    heard: dict[Topic, list[Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.outputs = {topic: qos.advertise(self.driver, topic) for topic in self.estimator.inputs}
        for topic in (*topics.RESULTS, topics.DIAGNOSTICS):
            self.heard[topic] = []
            qos.subscribe(self.driver, topic, self.heard[topic].append, qos.RESULT)
        self.executor.add_node(self.estimator)
        self.executor.add_node(self.driver)
        self.spin_until(self.executor, self._matched)

    def _matched(self) -> bool:
        listening = all(output.get_subscription_count() for output in self.outputs.values())
        return listening and all(self.estimator.count_subscribers(topic.name) for topic in self.heard)

    def send(self, topic: Topic, message: Any) -> None:
        before = self.estimator.heard[topic]
        self.outputs[topic].publish(message)
        self.spin_until(self.executor, lambda: self.estimator.heard[topic] > before)

    def send_sample(self, reading: Reading) -> None:
        self.send(topics.BRAKE_PRESSURE, messages.brake_pressure(reading.t_ns, reading.pressure_pa, 0.0))
        if reading.position_m is not None:
            self.send(topics.POSITION, messages.position(reading.t_ns, reading.position_m, 0.5))

    def hear_all(self) -> None:
        sent = self.estimator.published
        self.spin_until(self.executor, lambda: all(len(heard) == sent[topic] for topic, heard in self.heard.items()))

    def values(self) -> dict[str, str]:
        status = self.heard[topics.DIAGNOSTICS][-1].status[0]
        return {pair.key: pair.value for pair in status.values}


def estimating(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Line:
    """Return a line whose estimator is quick."""
    overrides = [Parameter(name, value=value) for name, value in FAST.items()]
    return Line(
        executor,
        spin_until,
        Estimator(context=context, parameter_overrides=overrides),
        Node("driver", context=context),
    )


def samples(name: str, begin_s: float, end_s: float) -> Iterator[Sample]:
    found = scenario.find(name)
    return (sample for sample in run(found, 0.1, 1) if begin_s * 1e9 <= sample[0].t_ns < end_s * 1e9)


def offline_digest(readings: list[Reading]) -> str:
    pipeline = Pipeline(setup_of(FAST).config, 1)
    for reading in readings:
        pipeline.push(PressureSample(reading.t_ns, reading.pressure_pa - ATMOSPHERE_PA))
        if reading.position_m is not None:
            pipeline.push(PositionSample(reading.t_ns, reading.position_m, 0.25))
    pipeline.finish()
    return pipeline.digest
