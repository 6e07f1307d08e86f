# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A sensor that falls silent, or might as well, is told by its name, also where the train is followed all the same."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from typing import Any

import messages
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String
from std_srvs.srv import Trigger
from told_line import Line, S, make_line

from adhesion_node.nodes.creep_estimator import CreepEstimator
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.ros import qos
from adhesion_node.nodes.ros.types import new
from adhesion_node.wire import topics

__all__ = ["make_line"]

QUICK = {"diagnostics_period_s": 0.1, "sensor_timeout_s": 0.2}
Sending = Callable[[int], object]


def while_sending(line: Line, send: Sending, *words: str, level: bytes | None = None, without: str = "\n") -> None:
    """Send, by and by, until all of the words are told at once, at that level, and others are not."""
    line.told.clear()
    steps = count()

    def said() -> bool:
        send(next(steps))
        told = [one for array in line.told if level in (None, (one := array.status[0]).level)]
        return any(all(word in one.message for word in words) and without not in one.message for one in told)

    line.wait(said, 20.0)


def positions(line: Line, from_s: int = 1) -> Sending:
    output = line.outlet(topics.POSITION)
    return lambda k: output.publish(messages.position(from_s * S + k * S // 20, 1.5 * k, 0.5))


@pytest.mark.parametrize("by", [topics.SPEED, topics.WHEEL_SPEED])
def test_what_a_train_is_followed_by_without_a_position_may_die(make_line: Callable[..., Line], by: Any) -> None:
    line = make_line(Estimator, **QUICK)
    output, number = line.outlet(by), count()

    def send(_: int) -> None:
        t_ns = S + next(number) * S // 20
        speed = messages.speed(t_ns, 30.0, 0.1) if by == topics.SPEED else messages.wheel_speed(t_ns, [65.0])
        output.publish(speed)

    for _ in range(2):
        while_sending(line, send, "the train is followed by its speed or its wheels", level=DiagnosticStatus.WARN)
        silent = f"/position or /odometry or /{by.name}: nothing for ", "is the sensor alive?"
        while_sending(line, lambda _: None, *silent, level=DiagnosticStatus.STALE)


@pytest.mark.parametrize(
    ("topic", "given", "missing"),
    [(topics.FIX, {}, "track_line"), (topics.ODOMETRY, {"position_source": "position"}, "position_source")],
)
def test_another_source_that_is_published_is_told_with_what_it_lacks(
    make_line: Callable[..., Line], topic: Any, given: dict[str, Any], missing: str
) -> None:
    line = make_line(Estimator, **QUICK, **given)
    output = qos.advertise(line.driver, topic)
    line.wait_until_said(f"remapped? /{topic.name} is published but not used: set {missing}")
    assert line.last.level == DiagnosticStatus.STALE
    assert output.get_subscription_count() == 0


def test_a_position_that_is_switched_off_is_silent(make_line: Callable[..., Line]) -> None:
    line = make_line(Estimator, **QUICK)
    place, speed = positions(line), line.outlet(topics.SPEED)
    while_sending(line, place, "no brake pressure", level=DiagnosticStatus.WARN)
    assert line.node.set_parameters_atomically([Parameter("use_position", value=False)]).successful
    off = "nothing that can be used for ", "use_position = false: set it to true"
    while_sending(line, place, *off, level=DiagnosticStatus.STALE)

    def both(k: int) -> None:
        place(k)
        speed.publish(messages.speed(9 * S + k * S // 20, 30.0, 0.1))

    while_sending(line, both, "the train is followed by its speed or its wheels", level=DiagnosticStatus.WARN)


@pytest.mark.parametrize(
    ("step_ns", "why"),
    [(0, "same stamp: dropped; does its clock stand still, or header.stamp stay 0?"), (-S // 20, "max_lag_s: dropped")],
)
def test_positions_whose_stamps_stand_or_go_back_are_silent(
    make_line: Callable[..., Line], step_ns: int, why: str
) -> None:
    line = make_line(Estimator, **QUICK)
    output = line.outlet(topics.POSITION)
    stale = "/position: nothing that can be used for ", why
    while_sending(
        line,
        lambda k: output.publish(messages.position(9 * S + k * step_ns, 1.5 * k, 0.5)),
        *stale,
        level=DiagnosticStatus.STALE,
    )
    while_sending(line, positions(line, 10), "no brake pressure", level=DiagnosticStatus.WARN)


def test_another_sensor_that_falls_silent_is_told_until_it_is_heard_again(make_line: Callable[..., Line]) -> None:
    line = make_line(Estimator, **QUICK)
    place, imu, speed, number = *map(line.outlet, (topics.POSITION, topics.IMU, topics.SPEED)), count()

    def send(sensors: Any) -> Sending:
        def sent(_: int) -> None:
            k = next(number)
            place.publish(messages.position(S + k * S // 20, 1.5 * k, 0.5))
            if sensors:
                speed.publish(messages.speed(S + k * S // 20, 30.0, 0.1))
                imu.publish(topics.IMU.build(new, S + k * S // 20, (0.0,), 0.01))

        return sent

    while_sending(line, send(True), "no brake pressure")
    while_sending(line, send(False), "/speed: nothing for ", "/imu: nothing for ", level=DiagnosticStatus.WARN)
    assert line.last.message.count("is the sensor alive?") == 1
    while_sending(line, send(True), "no brake pressure", without="nothing for ")
    while_sending(line, send(False), "/imu: nothing for ")


def test_the_creep_estimator_misses_its_speed(make_line: Callable[..., Line]) -> None:
    line = make_line(CreepEstimator, **QUICK)
    wheels, speed, number = line.outlet(topics.WHEEL_SPEED), line.outlet(topics.SPEED), count()

    def send(k: int) -> None:
        t_ns = S + next(number) * S // 20
        wheels.publish(messages.wheel_speed(t_ns, [65.0] * 4))
        if k < 10:
            speed.publish(messages.speed(t_ns, 30.0, 0.1))

    while_sending(line, send, "/speed: nothing for ", level=DiagnosticStatus.WARN)


def test_a_sensor_that_comes_seldom_is_silent_once_that_is_not_usual(make_line: Callable[..., Line]) -> None:
    """Pressures once a second, positions ten times, by a simulated clock; the timeout is half a second."""
    line = make_line(Estimator, use_sim_time=True, diagnostics_period_s=0.1, sensor_timeout_s=0.5)
    clock, place, brake = map(line.outlet, (topics.CLOCK, topics.POSITION, topics.BRAKE_PRESSURE))

    def told_at(step: int, *, brakes: bool) -> str:
        t_ns = 100 * S + step * S // 10
        clock.publish(messages.clock(t_ns))
        line.wait(lambda: line.node.get_clock().now().nanoseconds == t_ns)
        before = line.node.heard.total()
        place.publish(messages.position(t_ns, 3.0 * step, 0.5))
        if brakes:
            brake.publish(messages.brake_pressure(t_ns, 101325.0, 0.0))
        line.wait(lambda: line.node.heard.total() == before + 1 + brakes)
        line.told.clear()
        line.node.report()
        line.wait(lambda: line.told)
        return str(line.last.message)

    usual = [told_at(step, brakes=step % 10 == 0) for step in range(90)]
    assert not any("/brake_pressure: nothing" in text for text in usual[:81])
    missed = [told_at(step, brakes=False) for step in range(90, 140)]
    assert not any("/brake_pressure: nothing" in text for text in (*usual, *missed[:40]))
    assert "/brake_pressure: nothing for 5" in missed[-1]
    assert "/position" not in missed[-1]


def test_topics_that_go_on_as_another_type_are_told(make_line: Callable[..., Line]) -> None:
    line, context = make_line(Estimator, **QUICK), Context()
    outputs = line.outlet(topics.POSITION), line.outlet(topics.BRAKE_PRESSURE)
    for k in range(5):
        outputs[0].publish(messages.position(S + k * S // 20, 1.5 * k, 0.5))
        outputs[1].publish(messages.brake_pressure(S + k * S // 20, 101325.0, 0.0))
    line.wait(lambda: line.node.heard.total() == 10)
    for output in outputs:
        line.driver.destroy_publisher(output)
    rclpy.init(context=context)
    stranger = Node("stranger", context=context)
    others = [stranger.create_publisher(String, name, 1) for name in ("position", "brake_pressure")]
    told = [f"/{name} is published as std_msgs/msg/String: give it as " for name in ("position", "brake_pressure")]
    while_sending(line, lambda _: None, *told, level=DiagnosticStatus.STALE)
    assert len(others) == 2
    stranger.destroy_node()
    context.try_shutdown()


@pytest.mark.parametrize("remedy", ["use_position", "reset"])
def test_a_stray_position_shuts_odometry_out_until_what_is_told_is_done(
    make_line: Callable[..., Line], remedy: str
) -> None:
    line = make_line(Estimator, **QUICK)
    output, number = line.outlet(topics.ODOMETRY), count()

    def odometry(_: int) -> None:
        k = next(number)
        output.publish(topics.ODOMETRY.build(new, S + k * S // 20, (1.5 * k,), 0.25))

    while_sending(line, odometry, "no brake pressure")
    line.outlet(topics.POSITION).publish(messages.position(2 * S, 30.0, 0.5))
    shut_out = "; odometry comes but is not used: set use_position to false, or call ~/reset"
    while_sending(line, odometry, "/position: nothing for ", shut_out, level=DiagnosticStatus.STALE)
    if remedy == "reset":
        client = line.driver.create_client(Trigger, "estimator/reset")
        line.wait(client.service_is_ready)
        answer = client.call_async(Trigger.Request())
        line.wait(answer.done)
    else:
        assert line.node.set_parameters_atomically([Parameter("use_position", value=False)]).successful
    while_sending(line, odometry, "no brake pressure", level=DiagnosticStatus.WARN)
    assert line.values["position_source"] == "odometry"
