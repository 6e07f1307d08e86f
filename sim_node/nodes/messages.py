# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Truth and readings as ROS messages: SI, frame `track`, one stamp for all sensors of a sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseWithCovarianceStamped, TwistWithCovarianceStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64, Header

from adhesion_node.wire import topics
from adhesion_node.wire.topics import FRAME

from ..train.messages import SensorMessage
from ..train.plant import Truth

TRAIN_FRAME = "train"
"""Moving frame of the truth's velocity."""


def message_of(sent: SensorMessage) -> Any:
    """Build the message of a sensor, with all that a fault has made of it."""
    built = _BUILDERS[sent.topic](sent.t_ns, sent.values)
    built.header.frame_id = sent.frame
    if sent.topic == topics.POSITION:
        built.pose.covariance[0] = sent.variance
    elif sent.topic == topics.SPEED:
        built.twist.covariance[0] = sent.variance
    elif sent.topic == topics.BRAKE_PRESSURE:
        built.variance = sent.variance
    return built


def clock(t_ns: int) -> Clock:
    """The simulated time."""
    return Clock(clock=_time(t_ns))


def truth_state(t_ns: int, truth: Truth) -> Odometry:
    """True position and speed; the covariances are 0 because they are exact."""
    message = Odometry(header=_header(t_ns), child_frame_id=TRAIN_FRAME)
    message.pose.pose.position.x = truth.position_m
    message.pose.pose.orientation.w = 1.0
    message.twist.twist.linear.x = truth.speed_mps
    return message


def truth_mu(truth: Truth) -> Float64:
    """True adhesion coefficient at the present place and speed."""
    return Float64(data=truth.mu)


def brake_pressure(t_ns: int, absolute_pa: float, std_pa: float) -> FluidPressure:
    """Brake-cylinder pressure, absolute; a variance of 0 stands for unknown."""
    return FluidPressure(header=_header(t_ns), fluid_pressure=absolute_pa, variance=std_pa**2)


def speed(t_ns: int, speed_mps: float, std_mps: float) -> TwistWithCovarianceStamped:
    """Odometer speed."""
    message = TwistWithCovarianceStamped(header=_header(t_ns))
    message.twist.twist.linear.x = speed_mps
    message.twist.covariance[0] = std_mps**2
    return message


def wheel_speed(t_ns: int, speeds_radps: Sequence[float]) -> JointState:
    """Angular speeds of the axles or axle groups, axle_1 first."""
    names = [f"axle_{number}" for number in range(1, len(speeds_radps) + 1)]
    return JointState(header=_header(t_ns), name=names, velocity=speeds_radps)


def traction_force(t_ns: int, force_n: float) -> WrenchStamped:
    """Traction force of all driven axles at the rim."""
    message = WrenchStamped(header=_header(t_ns))
    message.wrench.force.x = force_n
    return message


def position(t_ns: int, position_m: float, std_m: float) -> PoseWithCovarianceStamped:
    """Measured position along the track."""
    message = PoseWithCovarianceStamped(header=_header(t_ns))
    message.pose.pose.position.x = position_m
    message.pose.pose.orientation.w = 1.0
    message.pose.covariance[0] = std_m**2
    return message


_BUILDERS: Mapping[topics.Topic, Callable[[int, Sequence[float]], Any]] = {
    topics.BRAKE_PRESSURE: lambda t_ns, values: brake_pressure(t_ns, values[0], 0.0),
    topics.SPEED: lambda t_ns, values: speed(t_ns, values[0], 0.0),
    topics.WHEEL_SPEED: wheel_speed,
    topics.POSITION: lambda t_ns, values: position(t_ns, values[0], 0.0),
}


def _header(t_ns: int) -> Header:
    return Header(stamp=_time(t_ns), frame_id=FRAME)


def _time(t_ns: int) -> Time:
    seconds, nanoseconds = divmod(t_ns, 1_000_000_000)
    return Time(sec=seconds, nanosec=nanoseconds)
