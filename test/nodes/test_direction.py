# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Frames and direction of a line, through DDS: a train whose chainage falls, in frames of other names."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import messages
import numpy as np
import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticStatus
from estimator_line import Line, samples
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from test_faults_monitor import QUIET, Train, known

from adhesion_node.core.atp.supervision import Level
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.wire import topics
from adhesion_node.wire.frames import placed
from adhesion_node.wire.line import DOWN
from adhesion_node.wire.line import Line as OfTrack

MakeLine = Callable[..., Line]
TRACK = "grade 1000 5000 -20; tunnel 2000 3000"
MIRRORED = "grade -5000 -1000 20; tunnel -3000 -2000"


def given(**values: Any) -> list[Parameter]:
    return [Parameter(name, value=value) for name, value in values.items()]


@pytest.fixture
def make_line(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> MakeLine:
    def make(**values: Any) -> Line:
        node = Estimator(context=context, parameter_overrides=given(**values))
        return Line(executor, spin_until, node, Node("driver", context=context))

    return make


def play(line: Line, sign: int, frame: str = "track", begin_s: float = 15.0, end_s: float = 26.0) -> None:
    for _, reading in samples("tunnel_entry", begin_s, end_s):
        assert reading.position_m is not None
        pressure = messages.brake_pressure(reading.t_ns, reading.pressure_pa, 0.0)
        pressure.header.frame_id = "brake_cylinder_1"
        position = messages.position(reading.t_ns, sign * reading.position_m, 0.5)
        position.header.frame_id = frame
        line.send(topics.BRAKE_PRESSURE, pressure)
        line.send(topics.POSITION, position)
    line.hear_all()


def test_a_falling_chainage_gives_the_same_numbers_and_goes_out_as_it_came(make_line: MakeLine) -> None:
    up = make_line(track=TRACK)
    play(up, 1)
    for node in (up.estimator, up.driver):
        up.executor.remove_node(node)
        node.destroy_node()
    down = make_line(direction=DOWN, track=MIRRORED, frame="line_42", child_frame="train_7")
    play(down, -1, "line_42")
    assert down.estimator.digest == up.estimator.digest
    assert down.estimator.latest.position_m > 0.0
    (there, here), (rising, falling) = (
        [line.heard[topic][-1] for line in (up, down)] for topic in (topics.STATE, topics.BRAKING_CURVE)
    )
    assert here.pose.pose.position.x == -there.pose.pose.position.x < 0.0
    assert (here.pose.pose.orientation.z, here.pose.pose.orientation.w) == (1.0, 0.0), "the train faces the other way"
    assert here.twist == there.twist, "in the frame of the train"
    assert (here.header.frame_id, here.child_frame_id) == ("line_42", "train_7")
    for one, other in zip(falling.points, rising.points, strict=True):
        assert (one.positions[0], one.velocities[0]) == (-other.positions[0], -other.velocities[0])
        assert (one.accelerations[0], one.time_from_start) == (-other.accelerations[0], other.time_from_start)
    deceleration = down.heard[topics.DECELERATION][-1]
    assert deceleration.accel.accel.linear.x < 0.0
    assert deceleration.header.frame_id == "train_7", "it is against the train, not against x of the track"


def test_results_are_read_along_the_run_or_as_chainage(make_line: MakeLine) -> None:
    line = make_line(direction=DOWN)
    play(line, -1)
    estimate, falling = line.estimator.latest, OfTrack(direction=DOWN)
    state, curve = line.heard[topics.STATE][-1], line.heard[topics.BRAKING_CURVE][-1]
    assert topics.STATE.read(state, falling).position_m == estimate.position_m
    assert topics.STATE.read(state).position_m == -estimate.position_m
    along, against = topics.BRAKING_CURVE.read(curve, falling), topics.BRAKING_CURVE.read(curve)
    assert (along.sign, along.position_m) == (1, estimate.position_m)
    assert against.places_m == pytest.approx(-along.places_m)
    assert against.curve.speed_mps[0] > 0.0


def test_the_curve_of_a_train_that_stands_is_read_in_either_direction() -> None:
    standing = BrakingCurve(np.zeros(9), np.zeros(9), np.full(9, 0.5), np.zeros(9))
    for direction in ("up", DOWN):
        line = OfTrack(direction=direction)
        read = topics.BRAKING_CURVE.read(placed(messages.curve_message(5, standing, 700.0), line), line)
        assert (read.position_m, read.sign) == (700.0, 1)
        assert topics.BRAKING_CURVE.read(placed(messages.curve_message(5, standing, 700.0), line)).sign == line.sign


def test_a_chainage_that_falls_unannounced_is_an_error_with_the_remedy(make_line: MakeLine) -> None:
    line = make_line()
    play(line, -1)
    (status,) = line.heard[topics.DIAGNOSTICS][-1].status
    assert status.level == DiagnosticStatus.ERROR
    assert status.message.startswith("positions fall while the train runs: set direction to what the chainage does")


def test_a_train_that_rolls_back_some_metres_is_no_error(make_line: MakeLine) -> None:
    """At 1 m/s for 20 s, and a jerk of 5 m at 5 m/s."""
    line = make_line()
    places = [-0.1 * step for step in range(200)] + [-20.0 - 0.5 * step for step in range(10)] + [-25.0] * 20
    for step, place in enumerate(places):
        line.send(topics.POSITION, messages.position(10**9 + step * 10**8, place, 0.1))
    line.hear_all()
    assert len(line.heard[topics.STATE]) > 20
    assert not any(array.status[0].level == DiagnosticStatus.ERROR for array in line.heard[topics.DIAGNOSTICS])


def supervised(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil, estimator: str, monitor: str
) -> Train:
    common = {**QUIET, "frame": "line_42"}
    nodes = (
        Estimator(
            context=context,
            parameter_overrides=given(**common, sensor_timeout_s=3600.0, direction=estimator, child_frame="train_7"),
        ),
        AtpMonitor(
            context=context,
            parameter_overrides=given(**common, target_position_m=1000.0, target_speed_kmh=0.0, direction=monitor),
        ),
        Node("driver", context=context),
    )
    for node in nodes:
        executor.add_node(node)
    return Train(executor, spin_until, *nodes, "line_42")


def test_a_falling_chainage_is_supervised_as_a_rising_one(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    train = supervised(context, executor, spin_until, DOWN, DOWN)
    told = train.run(lambda t: 22000.0 - 70.0 * t, 6.0)
    assert {one.level for one in told if one.t_s >= 0.7} == {Level.NORMAL}
    assert min(known(told)) <= 0.7
    (target, distance) = (float(train.values[key]) for key in ("target_position_m", "distance_to_target_m"))
    assert target == 1000.0
    assert distance == pytest.approx(21000.0 - 70.0 * 5.9, abs=50.0)


@pytest.mark.parametrize(("estimator", "monitor"), [("up", DOWN), (DOWN, "up")])
def test_a_monitor_and_an_estimator_of_two_minds_brake(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil, estimator: str, monitor: str
) -> None:
    train = supervised(context, executor, spin_until, estimator, monitor)
    told = train.run(lambda t: 22000.0 - 70.0 * t, 4.0)
    assert told[-1].level is Level.EMERGENCY_BRAKE
    assert any(words in told[-1].why for words in ("direction = ", "set direction", "is direction that"))
