# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Ten trains in one network: namespaces keep them apart. And who asks for security gets it or nothing."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticArray
from estimator_line import FAST
from faulty import READERS, S
from messages import message_of
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from start_stop import PRIVATE

from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.ros import qos
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire import topics
from adhesion_node.wire.settings.setup import setup_of
from sim_node.faults.plan import Plan, faulty_run
from sim_node.train.scenario import find
from sim_node.train.sensors import SensorMessage, SensorSettings

TRAINS = range(1, 11)


def ride(train: int) -> list[SensorMessage]:
    """Each train makes its own run, seen with its own noise."""
    run = faulty_run(Plan(), find("tunnel_entry"), 0.1, train, SensorSettings())
    return [message for truth, sent in run if 16 * S <= truth.t_ns < 24 * S for message in sent]


def alone(run: list[SensorMessage]) -> str:
    """Digest of the run without any other train."""
    pipeline = Pipeline(setup_of(FAST).config, 1)
    for message in run:
        pipeline.push(READERS[message.topic](message_of(message)))
    return pipeline.digest


def test_ten_trains_do_not_hear_each_other(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    overrides = [Parameter(name, value=value) for name, value in FAST.items()]
    driver, said = Node("driver", context=context), set[str]()

    def hear(message: DiagnosticArray) -> None:
        said.update(status.name for status in message.status)

    qos.subscribe(driver, topics.DIAGNOSTICS, hear, qos.RESULT)
    estimators = {n: Estimator(context=context, namespace=f"/train{n}", parameter_overrides=overrides) for n in TRAINS}
    outputs = {
        (n, topic): qos.advertise(driver, topic._replace(name=f"/train{n}/{topic.name}"), qos.SENSOR_PUBLISHER)
        for n in TRAINS
        for topic in (topics.POSITION, topics.BRAKE_PRESSURE)
    }
    for node in (driver, *estimators.values()):
        executor.add_node(node)
    spin_until(executor, lambda: all(output.get_subscription_count() == 1 for output in outputs.values()))
    runs = {n: ride(n) for n in TRAINS}
    for sent, together in enumerate(zip(*runs.values(), strict=True), start=1):
        for n, message in zip(TRAINS, together, strict=True):
            outputs[n, message.topic].publish(message_of(message))
        spin_until(executor, Heard(estimators, sent))
    assert {n: estimator.digest for n, estimator in estimators.items()} == {n: alone(run) for n, run in runs.items()}
    assert len({estimator.digest for estimator in estimators.values()}) == len(TRAINS)
    spin_until(executor, lambda: said == {f"train{n}/estimator/adhesion" for n in TRAINS})


class Heard:
    """Whether every estimator has heard so many messages."""

    def __init__(self, estimators: dict[int, Estimator], count: int) -> None:
        self._estimators, self._count = estimators, count

    def __call__(self) -> bool:
        return all(sum(estimator.heard.values()) == self._count for estimator in self._estimators.values())


def test_security_that_cannot_be_had_ends_the_node(tmp_path: Path) -> None:
    wanted: dict[str, Any] = {"ENABLE": "true", "STRATEGY": "Enforce", "KEYSTORE": str(tmp_path)}
    environment = {name: value for name, value in os.environ.items() if name not in PRIVATE}
    environment |= {f"ROS_SECURITY_{name}": value for name, value in wanted.items()}
    code = "import sys; from adhesion_node.main import estimator; sys.exit(estimator())"
    ended = subprocess.run(
        [sys.executable, "-c", code, "--ros-args", "--enclave", "/train1/estimator"],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert ended.returncode == 2
    assert "SECURITY ERROR" in ended.stderr
    assert "Traceback" not in ended.stderr
