# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Results to ROS messages, and back for those who consume them; sensor messages are read by `reading`."""

from __future__ import annotations

from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import AccelWithCovarianceStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float64, Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from adhesion_node.core.atp.supervision import TrainState
from adhesion_node.core.intake.samples import MAX_POSITION_M, MAX_SPEED_MPS
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.core.physics.train import GRAVITY, Array
from adhesion_node.wire.codecs import NS, Reason, Rejected, check_frame, plausible, stamp_ns
from adhesion_node.wire.topics import FRAME, TRAIN


def state(message: Any) -> TrainState:
    """Read the train's state, m and m/s, from an Odometry; raises Rejected."""
    check_frame(message)
    return TrainState(
        stamp_ns(message.header),
        plausible("position x", message.pose.pose.position.x, MAX_POSITION_M, Reason.IMPLAUSIBLE_POSITION),
        plausible("speed x", message.twist.twist.linear.x, MAX_SPEED_MPS, Reason.IMPLAUSIBLE_SPEED),
    )


def curve(message: Any) -> tuple[int, BrakingCurve]:
    """Read stamp and braking curve, its distance from 0 on, from a JointTrajectory; raises Rejected."""
    check_frame(message)
    points = message.points
    if list(message.joint_names) != [TRAIN] or len(points) < 2:
        raise Rejected(Reason.BAD_CURVE, f"braking curve joints = {list(message.joint_names)}, points = {len(points)}")
    if any(not len(p.positions) == len(p.velocities) == len(p.accelerations) == 1 for p in points):
        raise Rejected(Reason.BAD_CURVE, "braking curve: a point without exactly one value of each kind")
    rows = np.array(
        [
            (
                p.positions[0],
                p.velocities[0],
                p.accelerations[0],
                p.time_from_start.sec + p.time_from_start.nanosec / NS,
            )
            for p in points
        ]
    )
    usable = (np.abs(rows) <= 10 * MAX_POSITION_M).all(axis=1)  # False for NaN
    if not usable.all():
        index = int(np.argmin(usable))
        raise Rejected(Reason.NOT_FINITE, f"braking curve point {index} = {rows[index].tolist()}")
    place, velocity, acceleration, time = np.ascontiguousarray(rows.T)
    read = BrakingCurve(place - place[0], velocity, -acceleration, time)
    _check_course(read)
    return stamp_ns(message.header), read


def mu_message(mu: float) -> Float64:
    """Build the message of an adhesion coefficient."""
    return Float64(data=mu)


def deceleration_message(t_ns: int, mu: float, mu_std: float) -> AccelWithCovarianceStamped:
    """Build the message of the largest deceleration, -mu g along x, m/s^2, and its variance (g mu_std)^2."""
    message = AccelWithCovarianceStamped(header=header(t_ns))
    message.accel.accel.linear.x = -mu * GRAVITY
    message.accel.covariance[0] = (GRAVITY * mu_std) ** 2
    return message


def state_message(t_ns: int, position_m: float, position_var: float, speed_mps: float, speed_var: float) -> Odometry:
    """Build the message of position and speed along the track with their variances, m^2 and (m/s)^2."""
    message = Odometry(header=header(t_ns), child_frame_id=TRAIN)
    message.pose.pose.position.x = position_m
    message.pose.pose.orientation.w = 1.0
    message.pose.covariance[0] = position_var
    message.twist.twist.linear.x = speed_mps
    message.twist.covariance[0] = speed_var
    return message


def curve_message(t_ns: int, braking: BrakingCurve, position_m: float) -> JointTrajectory:
    """Build the message of a braking curve that begins at `position_m`: where the train will be, how fast, when."""
    columns = (
        (position_m + braking.distance_m).tolist(),
        braking.speed_mps.tolist(),
        (-braking.deceleration_mps2).tolist(),
        np.rint(braking.time_s * NS).astype(np.int64).tolist(),
    )
    points = [
        JointTrajectoryPoint(
            positions=(place,), velocities=(velocity,), accelerations=(acceleration,), time_from_start=_duration(time)
        )
        for place, velocity, acceleration, time in zip(*columns, strict=True)
    ]
    return JointTrajectory(header=header(t_ns), joint_names=[TRAIN], points=points)


def header(t_ns: int) -> Header:
    """Build the header of everything along the track."""
    seconds, nanoseconds = divmod(t_ns, NS)
    return Header(stamp=Time(sec=seconds, nanosec=nanoseconds), frame_id=FRAME)


def _duration(t_ns: int) -> Duration:
    seconds, nanoseconds = divmod(t_ns, NS)
    return Duration(sec=seconds, nanosec=nanoseconds)


def _check_course(braking: BrakingCurve) -> None:
    courses: tuple[tuple[str, Array], ...] = (
        ("position", np.diff(braking.distance_m)),
        ("time", np.diff(braking.time_s)),
        ("speed", -np.diff(braking.speed_mps)),
    )
    for what, steps in courses:
        if steps.min() < 0:
            raise Rejected(Reason.BAD_CURVE, f"braking curve: {what} turns at point {int(np.argmin(steps)) + 1}")
    if braking.speed_mps[-1] < 0 or braking.deceleration_mps2.min() <= 0:
        raise Rejected(Reason.BAD_CURVE, "braking curve: a negative speed or no deceleration")
