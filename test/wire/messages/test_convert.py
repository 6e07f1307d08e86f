# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Messages to values and back: round trips, through rosbags' messages as well, and every refusal by its text."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import messages
import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped, TwistWithCovarianceStamped
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import FluidPressure
from trajectory_msgs.msg import JointTrajectory

from adhesion_node.core.physics import braking
from adhesion_node.core.physics.train import CRH3
from adhesion_node.wire import topics
from adhesion_node.wire.line import Line
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.topic import Topic

T_NS = 12_000_000_034
ROS = get_typestore(Stores.ROS2_JAZZY)


def as_rosbags(message: Any, name: str) -> Any:
    """Return the message as rosbags reads it from a file; rclpy's buffer may be longer than the message."""
    definition = ROS.get_msgdef(name)
    read, _length = definition.deserialize_cdr_le(bytes(serialize_message(message))[4:], 0, definition.cls, ROS)
    return read


def make_position(x: float = 1234.5, variance: float = 0.25, frame: str = "track") -> PoseWithCovarianceStamped:
    message = PoseWithCovarianceStamped(header=messages.header(T_NS))
    message.header.frame_id = frame
    message.pose.pose.position.x = x
    message.pose.covariance[0] = variance
    return message


def make_pressure(pa: float = 511_325.0, frame: str = "track") -> FluidPressure:
    message = FluidPressure(header=messages.header(T_NS), fluid_pressure=pa)
    message.header.frame_id = frame
    return message


def make_speed(mps: float = 83.3, frame: str = "track") -> TwistWithCovarianceStamped:
    message = TwistWithCovarianceStamped(header=messages.header(T_NS))
    message.header.frame_id = frame
    message.twist.twist.linear.x = mps
    return message


@pytest.mark.parametrize("view", [lambda message, _name: message, as_rosbags], ids=["rclpy", "rosbags"])
def test_sensor_messages_are_read(view: Callable[[Any, str], Any]) -> None:
    position = topics.POSITION.read(view(make_position(), "geometry_msgs/msg/PoseWithCovarianceStamped"))
    assert position == (12_000_000_034, 1234.5, 0.25)
    pressure = topics.BRAKE_PRESSURE.read(view(make_pressure(), "sensor_msgs/msg/FluidPressure"))
    assert pressure == (12_000_000_034, 410_000.0)
    speed = topics.SPEED.read(view(make_speed(), "geometry_msgs/msg/TwistWithCovarianceStamped"))
    assert speed == (12_000_000_034, 83.3, None)
    assert {type(value) for value in (*position, *pressure, *speed[:2])} == {int, float}


def test_a_variance_of_0_is_an_unknown_one() -> None:
    assert topics.POSITION.read(make_position(variance=0.0)).variance_m2 == 9.0
    assert topics.POSITION.read(make_position(variance=0.0), Line(position_std_m=0.5)).variance_m2 == 0.25


def test_what_is_no_place_may_have_any_frame() -> None:
    assert topics.BRAKE_PRESSURE.read(make_pressure(511e3, frame="brake_cylinder_1")).pressure_pa == 511e3 - 101_325.0
    assert topics.SPEED.read(make_speed(30.0, frame="base_link")).speed_mps == 30.0


def test_a_released_brake_never_pulls() -> None:
    assert topics.BRAKE_PRESSURE.read(make_pressure(101_000.0)).pressure_pa == 0.0


@pytest.mark.parametrize(
    ("topic", "message", "reason", "text"),
    [
        (topics.POSITION, make_position(frame="map"), "WRONG_FRAME", r"header\.frame_id = 'map', frame = 'track': set"),
        (topics.POSITION, make_position(frame=""), "WRONG_FRAME", r"header\.frame_id = ''"),
        (topics.POSITION, make_position(math.nan), "NOT_FINITE", r"position x = nan: give a finite number"),
        (topics.POSITION, make_position(-math.inf), "NOT_FINITE", r"position x = -inf"),
        (topics.POSITION, make_position(1e308), "IMPLAUSIBLE_POSITION", r"position x = 1e\+308: position is in m"),
        (
            topics.POSITION,
            make_position(variance=-1.0),
            "BAD_VARIANCE",
            r"= -1: give .* 0 where unknown",
        ),
        (topics.POSITION, make_position(variance=1e308), "BAD_VARIANCE", r"covariance\[0\] = 1e\+308"),
        (topics.POSITION, make_position(variance=5e-324), "BAD_VARIANCE", r"covariance\[0\]"),
        (topics.POSITION, make_position(variance=math.nan), "NOT_FINITE", r"covariance\[0\] = nan"),
        (
            topics.BRAKE_PRESSURE,
            make_pressure(0.0),
            "IMPLAUSIBLE_PRESSURE",
            r"= 0: .* add 101325 Pa .*set ambient_pressure_pa",
        ),
        (topics.BRAKE_PRESSURE, make_pressure(511.3), "IMPLAUSIBLE_PRESSURE", r"= 511\.3: .*multiply kPa by 1000"),
        (topics.BRAKE_PRESSURE, make_pressure(1e308), "IMPLAUSIBLE_PRESSURE", r"1e\+308"),
        (topics.BRAKE_PRESSURE, make_pressure(math.nan), "NOT_FINITE", r"fluid_pressure = nan"),
        (topics.SPEED, make_speed(300.0), "IMPLAUSIBLE_SPEED", r"speed x = 300: speed is in m/s, not km/h"),
        (topics.SPEED, make_speed(math.inf), "NOT_FINITE", r"speed x = inf"),
    ],
)
def test_bad_messages_are_refused_with_value_and_remedy(topic: Topic, message: Any, reason: str, text: str) -> None:
    with pytest.raises(Rejected, match=text) as refusal:
        topic.read(message)
    assert refusal.value.reason == reason


def test_results_hold_hand_computed_numbers() -> None:
    assert messages.mu_message(0.0726).data == 0.0726
    message = messages.deceleration_message(T_NS, 0.1, 0.01)
    assert message.accel.accel.linear.x == pytest.approx(-0.98)
    assert message.accel.covariance[0] == pytest.approx(0.009604)
    assert (message.header.stamp.sec, message.header.stamp.nanosec, message.header.frame_id) == (12, 34, "track")


def test_the_state_goes_round() -> None:
    message = messages.state_message(T_NS, 1500.0, 0.04, 70.0, 0.01)
    assert (message.child_frame_id, message.pose.pose.orientation.w) == ("train", 1.0)
    assert (message.pose.covariance[0], message.twist.covariance[0]) == (0.04, 0.01)
    assert topics.STATE.read(message) == (T_NS, 1500.0, 70.0, 0.2, 0.1)
    assert topics.STATE.read(as_rosbags(message, "nav_msgs/msg/Odometry")) == (T_NS, 1500.0, 70.0, 0.2, 0.1)
    assert topics.STATE.read(messages.state_message(T_NS, 1500.0, 0.04, -7.0, 0.01)).speed_mps == -7.0


@pytest.mark.parametrize("part", ["pose", "twist"])
@pytest.mark.parametrize(
    ("variance", "reason"), [(0.0, "BAD_VARIANCE"), (-1.0, "BAD_VARIANCE"), (math.nan, "NOT_FINITE")]
)
def test_an_estimated_state_tells_how_sure_it_is(part: str, variance: float, reason: str) -> None:
    message = messages.state_message(T_NS, 1500.0, 0.04, 70.0, 0.01)
    getattr(message, part).covariance[0] = variance
    with pytest.raises(Rejected, match=r"(position|speed) covariance\[0\] = ") as refusal:
        topics.STATE.read(message)
    assert refusal.value.reason == reason
    assert "or 0 where unknown" not in str(refusal.value), "0 is what is refused here"
    if variance == 0.0:  # what a simulator knows is exact
        assert topics.TRUTH_STATE.read(message).speed_mps == 70.0


CURVE = braking.curve(CRH3, 80.0, 0.08, target_mps=10.0)
MESSAGE = messages.curve_message(T_NS, CURVE, 2000.0)


def test_a_curve_is_told_in_track_positions() -> None:
    first, last = MESSAGE.points[0], MESSAGE.points[-1]
    assert (MESSAGE.header.frame_id, list(MESSAGE.joint_names), len(MESSAGE.points)) == ("track", ["train"], 64)
    assert (first.positions[0], first.velocities[0], first.time_from_start.sec) == (2000.0, 80.0, 0)
    assert last.positions[0] == 2000.0 + CURVE.distance_m[-1]
    assert first.accelerations[0] == -CURVE.deceleration_mps2[0]
    assert last.time_from_start.sec + last.time_from_start.nanosec * 1e-9 == pytest.approx(CURVE.time_s[-1], abs=1e-8)


@pytest.mark.parametrize(
    "carry",
    [
        lambda message: message,
        lambda message: deserialize_message(serialize_message(message), JointTrajectory),
        lambda message: as_rosbags(message, "trajectory_msgs/msg/JointTrajectory"),
    ],
    ids=["built", "rclpy", "rosbags"],
)
def test_a_curve_goes_round(carry: Callable[[Any], Any]) -> None:
    t_ns, place_m, read, _ = topics.BRAKING_CURVE.read(carry(MESSAGE))
    assert (t_ns, place_m) == (T_NS, 2000.0)
    np.testing.assert_allclose(read.distance_m, CURVE.distance_m, atol=1e-9)
    np.testing.assert_array_equal(read.speed_mps, CURVE.speed_mps)
    np.testing.assert_array_equal(read.deceleration_mps2, CURVE.deceleration_mps2)
    np.testing.assert_allclose(read.time_s, CURVE.time_s, atol=1e-8)


def test_a_curve_without_length_goes_round() -> None:
    standing = braking.curve(CRH3, 5.0, 0.08, target_mps=10.0)
    read = topics.BRAKING_CURVE.read(messages.curve_message(T_NS, standing, 0.0)).curve
    assert read.distance_m[-1] == 0.0
    assert set(read.speed_mps) == {10.0}


SHAPES = (0.01, 0.2, lambda v: 0.05 + 3.0 / (v + 20.0), lambda v: 0.05 + 0.1 * (v < 33.0))


@pytest.mark.parametrize("speed_mps", [0.0, 0.5, 20.0, 100.0])
@pytest.mark.parametrize("mu", SHAPES)
def test_every_curve_of_ours_is_plausible(speed_mps: float, mu: Any) -> None:
    made = braking.curve(CRH3, speed_mps, mu)
    assert topics.BRAKING_CURVE.read(messages.curve_message(T_NS, made, 1e6)).position_m == 1e6


def _scaled(positions: float = 1.0, velocities: float = 1.0, accelerations: float = 1.0) -> Callable[[Any], None]:
    def spoil(message: Any) -> None:
        for point in message.points:
            point.positions = [point.positions[0] * positions]
            point.velocities = [point.velocities[0] * velocities]
            point.accelerations = [point.accelerations[0] * accelerations]

    return spoil


def _set(name: str, index: int, value: float) -> Callable[[Any], None]:
    return lambda message: setattr(message.points[index], name, [value])


@pytest.mark.parametrize(
    ("spoil", "reason", "text"),
    [
        (lambda m: setattr(m.header, "frame_id", "map"), "WRONG_FRAME", r"'map'"),
        (lambda m: setattr(m, "joint_names", ["wheel"]), "BAD_CURVE", r"joints = \['wheel'\], points = 64: give one"),
        (lambda m: setattr(m, "points", []), "BAD_CURVE", r"points = 0"),
        (lambda m: setattr(m.points[3], "velocities", []), "BAD_CURVE", r"without exactly one value of each kind"),
        (
            _scaled(positions=1e-3),
            "IMPLAUSIBLE_CURVE",
            r"v\^2 falls by .* from point 0 to 1, on 0\.\d+ m at .*: give .* in m,",
        ),
        (_scaled(positions=0.0), "IMPLAUSIBLE_CURVE", r"on 0 m at"),
        (_scaled(velocities=3.6), "IMPLAUSIBLE_CURVE", r"from point 0 to 1"),
        (_scaled(accelerations=3.6), "IMPLAUSIBLE_CURVE", r"from point 0 to 1"),
        (_scaled(positions=0.93), "IMPLAUSIBLE_CURVE", r"from point 0 to 1"),
        (_set("velocities", 40, 35.0), "IMPLAUSIBLE_CURVE", r"from point (39|40)"),
        (_set("positions", 3, math.nan), "NOT_FINITE", r"braking curve point 3 = \[nan"),
        (_set("velocities", 0, math.inf), "NOT_FINITE", r"braking curve point 0"),
        (_set("positions", 0, -1e308), "NOT_FINITE", r"braking curve point 0"),
        (_set("positions", 9, 0.0), "BAD_CURVE", r"position turns at point 9"),
        (_set("velocities", 9, 99.0), "BAD_CURVE", r"speed turns at point 9"),
        (_set("velocities", 63, -1.0), "BAD_CURVE", r"a negative speed or no deceleration"),
        (_set("accelerations", 9, 0.1), "BAD_CURVE", r"a negative speed or no deceleration"),
        (lambda m: setattr(m.points[9].time_from_start, "sec", 0), "BAD_CURVE", r"time turns at point 9"),
    ],
)
def test_a_curve_that_cannot_be_braked_along_is_refused(spoil: Callable[[Any], None], reason: str, text: str) -> None:
    message = deepcopy(MESSAGE)
    spoil(message)
    with pytest.raises(Rejected, match=text) as refusal:
        topics.BRAKING_CURVE.read(message)
    assert refusal.value.reason == reason


def test_a_curve_is_built_and_read_well_within_its_budget() -> None:
    def cost_s() -> float:
        start = time.thread_time()
        topics.BRAKING_CURVE.read(messages.curve_message(T_NS, CURVE, 2000.0))
        return time.thread_time() - start

    assert min(cost_s() for _ in range(20)) < 6e-3
