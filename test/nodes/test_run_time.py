# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What changes while nodes run, through DDS: parameters by their services, the target by its topic, stamped bounds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import messages
import pytest
import yaml
from conftest import SpinUntil
from estimator_line import Line, samples
from monitor_line import NAMESPACE, SETTINGS
from monitor_line import Line as Supervised
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from test_faults_estimator import call

from adhesion_node.core.physics.train import GRAVITY
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.ros import qos
from adhesion_node.nodes.ros.types import new
from adhesion_node.wire import topics
from adhesion_node.wire.messages.curves import Target


def given(**values: Any) -> list[Parameter]:
    return [Parameter(name, value=value) for name, value in values.items()]


@pytest.fixture
def line(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Line:
    return Line(executor, spin_until, Estimator(context=context), Node("driver", context=context))


@pytest.fixture
def supervised(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Supervised:
    monitor = AtpMonitor(context=context, namespace=NAMESPACE, parameter_overrides=given(**SETTINGS))
    driver = Node("driver", context=context, namespace=NAMESPACE)
    for node in (monitor, driver):
        executor.add_node(node)
    return Supervised(executor, spin_until, monitor, driver)


def play(line: Line, begin_s: float, end_s: float) -> None:
    for _, reading in samples("tunnel_entry", begin_s, end_s):
        line.send_sample(reading)
    line.hear_all()


def ask(line: Any, node: str, **values: Any) -> Any:
    request = SetParametersAtomically.Request(parameters=[one.to_parameter_msg() for one in given(**values)])
    return call(line, SetParametersAtomically, f"{node}/set_parameters_atomically", request).result


def test_the_bound_may_be_asked_with_more_confidence_while_the_train_brakes(line: Line) -> None:
    play(line, 15.0, 31.0)
    known, narrow = line.estimator.latest, line.estimator.latest
    accepted = line.estimator.pipeline.accepted
    assert ask(line, "/estimator", confidence=0.999, sensor_timeout_s=1).successful
    assert line.estimator.config.confidence == 0.999
    play(line, 31.0, 32.0)
    wide = line.estimator.latest
    assert line.estimator.pipeline.accepted == accepted + 10, "what was known stays"
    assert wide.window > narrow.window
    assert wide.mu == pytest.approx(known.mu, abs=0.01)
    assert wide.mu - wide.mu_lower > 1.3 * (narrow.mu - narrow.mu_lower)
    assert line.values()["confidence"] == "0.999"


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"confidence": 0.9, "window": 60}, "window = 60: fixed at start; restart the node to change it"),
        ({"confidence": 0.9, "sensor_timeout_s": -1.0}, "sensor_timeout_s"),
        ({"confidence": "much"}, "confidence = 'much': give a value of type float"),
        ({"confidence": 0.9, "sensor_timout_s": 1.0}, "no such parameter; did you mean sensor_timeout_s?"),
    ],
)
def test_a_change_that_does_not_fit_changes_nothing(line: Line, values: dict[str, Any], reason: str) -> None:
    result = ask(line, "/estimator", **values)
    assert not result.successful
    assert reason in result.reason
    assert line.estimator.config.confidence == line.estimator.get_parameter("confidence").value == 0.95


def test_the_air_of_a_mountain_line_may_be_told_on_the_way(line: Line) -> None:
    assert ask(line, "/estimator", ambient_pressure_pa=54e3).successful
    line.send(topics.BRAKE_PRESSURE, messages.brake_pressure(10**9, 454e3, 0.0))
    assert line.estimator._reader.line.ambient_pressure_pa == 54e3


def test_a_sensor_is_switched_off_and_on_while_the_train_brakes(line: Line) -> None:
    def speeds(from_s: int) -> None:
        for step in range(5):
            line.send(topics.SPEED, messages.speed(from_s * 10**9 + step * 10**8, 80.0, 0.1))

    speeds(1)
    assert ask(line, "/estimator", use_speed=False).successful
    speeds(2)
    line.estimator.report()
    line.hear_all()
    values = line.values()
    assert (values["dropped.SWITCHED_OFF"], values["switched_off"]) == ("5", "speed")
    assert "switched" not in line.heard[topics.DIAGNOSTICS][-1].status[0].message, "it is as it was asked for"
    assert ask(line, "/estimator", **{"use_speed": True, "latency_s.speed": 0.2}).successful
    speeds(3)
    line.estimator.report()
    line.hear_all()
    assert line.values()["dropped.SWITCHED_OFF"] == "5"
    assert "switched_off" not in line.values()
    assert line.estimator.pipeline.state.inbox.now_ns == 3_200_000_000, "0.2 s before its newest stamp"


def test_its_own_dump_is_loaded_without_a_complaint(line: Line) -> None:
    """As `ros2 param load` does, parameter by parameter, through YAML: 1e-06 becomes a text by that."""
    names = line.estimator.list_parameters([], 0).names
    loaded = {one.name: yaml.safe_load(str(one.value)) or one.value for one in line.estimator.get_parameters(names)}
    assert loaded["tolerance"] == "1e-06"
    dump = [parameter.to_parameter_msg() for parameter in given(**loaded)]
    assert {"use_sim_time", "window", "qos_overrides./position.subscription.depth"} <= set(names)
    answer = call(line, SetParameters, "/estimator/set_parameters", SetParameters.Request(parameters=dump))
    assert [result.reason for result in answer.results if not result.successful] == []


def test_bound_and_standard_deviation_have_a_stamp(line: Line) -> None:
    play(line, 15.0, 26.0)
    estimate = line.estimator.latest
    heard = line.heard[topics.DECELERATION_LOWER][-1]
    bound = topics.DECELERATION_LOWER.read(heard)
    assert bound.t_ns == estimate.t_ns
    assert bound.acceleration_mps2 == pytest.approx(-GRAVITY * estimate.mu_lower)
    assert bound.variance == pytest.approx((GRAVITY * estimate.mu_std) ** 2)
    assert heard.header.frame_id == "track"


def levels(line: Supervised) -> tuple[str, str]:
    line.send_pair(0.0)
    values = {pair.key: pair.value for pair in line.heard[-1].status[0].values}
    return values["level"], values["target_position_m"]


def test_a_new_target_holds_at_once_by_service(supervised: Supervised) -> None:
    supervised.next_status(lambda: supervised.set_time(1000.0))
    assert levels(supervised) == ("NORMAL", "5000.000")
    result = ask(supervised, f"{NAMESPACE}/atp_monitor", target_position_m=900, target_speed_kmh=0.0)
    assert result.successful
    assert levels(supervised) == ("EMERGENCY_BRAKE", "900.000")
    refused = ask(supervised, f"{NAMESPACE}/atp_monitor", target_position_m=8000.0, target_speed_kmh=400.0)
    assert "line_speed_kmh = 350.0: give at least target_speed_kmh = 400.0" in refused.reason
    assert levels(supervised)[1] == "900.000"


def test_a_new_target_holds_at_once_by_topic(supervised: Supervised) -> None:
    line, topic = supervised, topics.ATP_TARGET
    output = qos.advertise(line.driver, topic)
    line.spin_until(line.executor, output.get_subscription_count)
    line.next_status(lambda: line.set_time(1000.0))
    assert levels(line) == ("NORMAL", "5000.000")

    def send(message: Any) -> None:
        before = line.monitor.heard[topic]
        output.publish(message)
        line.spin_until(line.executor, lambda: line.monitor.heard[topic] > before)

    send(topic.build(new, 0, Target(900.0, 0.0)))
    assert levels(line) == ("EMERGENCY_BRAKE", "900.000")
    assert line.monitor.get_parameter("target_position_m").value == 900.0
    send(topic.build(new, 0, Target(7000.0, 50.0 / 3.6)))
    assert line.monitor.get_parameter("target_speed_kmh").value == pytest.approx(50.0)
    assert levels(line) == ("NORMAL", "7000.000")


def spoilt(spoil: Callable[[Any], None]) -> Any:
    message = topics.ATP_TARGET.build(new, 0, Target(7000.0, 0.0))
    spoil(message)
    return message


@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (lambda m: setattr(m, "points", []), "target joints = ['train'], points = 0: give one joint 'train'"),
        (lambda m: setattr(m.points[0], "velocities", []), "target positions = 1, velocities = 0: give one"),
        (lambda m: setattr(m.points[0], "positions", [float("nan")]), "target position = nan"),
        (lambda m: setattr(m.points[0], "velocities", [150.0]), "target_speed_kmh"),
        (lambda m: setattr(m.header, "frame_id", "map"), "header.frame_id = 'map', frame = 'track'"),
    ],
)
def test_a_target_that_is_not_understood_is_an_emergency_until_one_is(
    supervised: Supervised, spoil: Callable[[Any], None], why: str
) -> None:
    line = supervised
    output = qos.advertise(line.driver, topics.ATP_TARGET)
    line.spin_until(line.executor, output.get_subscription_count)
    line.next_status(lambda: line.set_time(1000.0))
    assert levels(line) == ("NORMAL", "5000.000")
    status = line.next_status(lambda: output.publish(spoilt(spoil)))
    assert status.message.startswith("no safe distance is known, emergency brake: target: refused: ")
    assert why in status.message
    assert levels(line) == ("EMERGENCY_BRAKE", "5000.000")
    assert ask(line, f"{NAMESPACE}/atp_monitor", service_build_up_s=2.5).successful
    assert levels(line)[0] == "EMERGENCY_BRAKE", "another parameter is no target"
    line.next_status(lambda: output.publish(topics.ATP_TARGET.build(new, 0, Target(5000.0, 0.0))))
    assert levels(line)[0] == "NORMAL"
    line.next_status(lambda: output.publish(spoilt(spoil)))
    assert ask(line, f"{NAMESPACE}/atp_monitor", target_position_m=5000.0).successful
    assert levels(line)[0] == "NORMAL", "the parameter's target holds, which is the same"
