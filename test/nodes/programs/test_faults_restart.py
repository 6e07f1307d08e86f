# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Processes that are killed: a sensor is missed, an estimator inherits nothing and works again within one window.

One that is stopped counts what it has lost.
"""

from __future__ import annotations

import signal
from functools import partial

import messages
from conftest import PATIENCE_S, SpinUntil
from diagnostic_msgs.msg import DiagnosticStatus
from faulty import S
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from start_stop import start
from test_faults_estimator import flat, offline_digest, ticks
from test_offline import FAST
from test_two_processes import LOSSLESS, QUICK, START_S, Operator, Program

from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.ros import qos
from adhesion_node.run.reader import Reader
from adhesion_node.wire import topics
from adhesion_node.wire.line import NOMINAL
from sim_node.train.sensors import Tick


def test_a_sensor_whose_process_is_killed_is_stale(
    started: list[Program], context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """A killed process says no goodbye: DDS itself misses it after 20 s, and what it sends it until then is lost."""
    operator, estimator = Operator(context), Estimator(context=context)
    executor.add_node(operator)
    executor.add_node(estimator)
    simulator = start("simulator", "--ros-args", "-p", "rate_hz:=50", "-p", "scenario:=cruise", "-p", "wait_for:=1")
    started.append(simulator)
    spin_until(executor, lambda: estimator.heard[topics.POSITION] > 50, START_S)
    spin_until(executor, lambda: operator.levels[-1] != DiagnosticStatus.STALE)
    simulator.send_signal(signal.SIGKILL)
    spin_until(executor, lambda: operator.levels[-1] == DiagnosticStatus.STALE)
    spin_until(executor, lambda: estimator.count_publishers(topics.POSITION.name) == 0, PATIENCE_S)


def test_what_a_stopped_estimator_has_lost_is_counted_by_topic(
    started: list[Program], context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """Of thousands of messages its queue keeps the last 100; that some are missing shows by the next one that comes."""
    operator, driver = Operator(context), Node("driver", context=context)
    for node in (operator, driver):
        executor.add_node(node)
    position = qos.advertise(driver, topics.POSITION)
    estimator = start("estimator", "--ros-args", "-p", "diagnostics_period_s:=0.1")
    started.append(estimator)
    spin_until(executor, lambda: position.get_subscription_count() and operator.heard, START_S)
    assert not [name for name in operator.heard[-1] if name.startswith("lost.")]
    sent = 0

    def send() -> None:
        nonlocal sent
        sent += 1
        position.publish(messages.position(S + sent * S // 100, 0.3 * sent, 0.5))

    def lost() -> bool:
        send()
        return "lost.position" in operator.heard[-1]

    def met() -> bool:  # of what is lost before the first message nothing tells
        send()
        return measured(operator, 0)

    spin_until(executor, met)
    estimator.send_signal(signal.SIGSTOP)
    for _ in range(5000):
        send()
    estimator.send_signal(signal.SIGCONT)
    spin_until(executor, lost)
    told = len(operator.heard)
    spin_until(executor, lambda: len(operator.heard) > told + 5)  # it is told for good
    values = operator.heard[-1]
    assert 1 <= int(values["lost.position"]) <= sent - int(values["measurements"])
    assert [name for name in values if name.startswith("lost.")] == ["lost.position"]
    estimator.send_signal(signal.SIGINT)  # killed it would leave its part of the shared memory locked
    spin_until(executor, lambda: estimator.poll() is not None)


def measured(operator: Operator, count: int) -> bool:
    return int(operator.heard[-1]["measurements"]) > count


def test_a_killed_estimator_is_replaced_by_one_that_inherits_nothing(
    started: list[Program], context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    operator, driver = Operator(context), Node("driver", context=context)
    executor.add_node(operator)
    executor.add_node(driver)
    inputs = Reader(topics.ADHESION_INPUTS, NOMINAL).inputs
    outputs = {topic: qos.advertise(driver, topic, qos.SENSOR_PUBLISHER) for topic in inputs}

    def run_one(run: list[Tick]) -> Program:
        operator.heard.clear()
        program = start("estimator", "--ros-args", *QUICK, *LOSSLESS)
        started.append(program)
        spin_until(executor, lambda: all(o.get_subscription_count() == 1 for o in outputs.values()), START_S)
        spin_until(executor, lambda: operator.heard, PATIENCE_S)  # it says that it waits: both sides know each other
        for index, sent in enumerate(flat(run)):
            outputs[sent.topic].publish(messages.message_of(sent))
            if index % 60 == 59:  # its queue holds 100
                spin_until(executor, partial(measured, operator, index // 3 - 12), PATIENCE_S)
        return program

    first = run_one(ticks("none", 15.0, 22.0))
    first.send_signal(signal.SIGKILL)
    first.wait()
    spin_until(executor, lambda: operator.count_publishers(topics.DIAGNOSTICS.name) == 0, PATIENCE_S)

    later = ticks("none", 22.0, 30.0)
    second = run_one(later)
    spin_until(executor, lambda: operator.heard[-1]["windows"] not in ("0", ""), PATIENCE_S)
    assert int(operator.heard[-1]["measurements"]) <= 80
    second.send_signal(signal.SIGINT)
    spin_until(executor, lambda: second.poll() is not None, PATIENCE_S)
    assert second.returncode == 0
    assert offline_digest(later, **FAST) in (second.stderr.read() if second.stderr else "")
