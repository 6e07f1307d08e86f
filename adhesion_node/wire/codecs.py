# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Sensor messages to samples: the one place that knows fields, frames, units and what is plausible.

Takes any object with the fields of the message, so it serves rclpy's messages and those that rosbags reads from a
file, and needs no ROS.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import Any

from ..core.intake.samples import (
    MAX_POSITION_M,
    MAX_SPEED_MPS,
    MAX_VARIANCE_M2,
    MIN_VARIANCE_M2,
    ForceSample,
    PositionSample,
    PressureSample,
    SpeedSample,
    WheelSample,
)
from .topics import FRAME, TRAIN

ATMOSPHERE_PA = 101_325.0
"""Standard atmosphere: absolute less gauge pressure."""

MIN_ABSOLUTE_PA, MAX_ABSOLUTE_PA = 50e3, 5e6
"""No place on earth that has a railway is below 50 kPa; no brake works above 5 MPa."""

MAX_WHEEL_RADPS = 1e3
"""No wheel of a train turns faster: 500 km/h on a wheel of 0.3 m are 463 rad/s."""

MAX_FORCE_N = 1e7
"""No train pulls harder; the strongest locomotives reach 2 MN."""

NS = 1_000_000_000


class Reason(Enum):
    """Why a message was refused; the value is the remedy."""

    WRONG_FRAME = f"set header.frame_id to '{FRAME}', or the reader's parameter frame to what it is"
    NOT_FINITE = "give a finite number, or publish nothing while there is none"
    BAD_VARIANCE = f"give covariance[0] in SI units squared, {MIN_VARIANCE_M2:g} to {MAX_VARIANCE_M2:g}"
    IMPLAUSIBLE_POSITION = f"position is in m along the track, within +-{MAX_POSITION_M:g}"
    IMPLAUSIBLE_PRESSURE = (
        f"fluid_pressure is absolute, in Pa, {MIN_ABSOLUTE_PA:g} to {MAX_ABSOLUTE_PA:g}: "
        f"add {ATMOSPHERE_PA:g} Pa to a gauge pressure, multiply kPa by 1000 and bar by 100000"
    )
    IMPLAUSIBLE_SPEED = f"speed is in m/s, not km/h, within +-{MAX_SPEED_MPS:g}"
    NO_AXLE = "give one velocity, rad/s, for every driven axle in name"
    IMPLAUSIBLE_WHEEL_SPEED = f"velocity is in rad/s, not rpm, within +-{MAX_WHEEL_RADPS:g}"
    IMPLAUSIBLE_FORCE = f"force.x is in N, within +-{MAX_FORCE_N:g}"
    SPEED_IN_KMH = "speed is in m/s: divide km/h by 3.6"
    STUCK = "the same to the bit although the train must have moved on: check the sensor"
    TOO_OFTEN = "publish at most 200 messages a second: no more are used"
    DISABLED = "call ~/set_enabled with true to go on"
    BAD_CURVE = (
        f"give one joint '{TRAIN}', at least two points, each with one position, velocity and acceleration; "
        "positions and times rise, speeds fall and are not negative, accelerations are below 0"
    )


class Rejected(ValueError):
    """A message that must not be used: `reason` is the name of a `Reason`, the text says what = value: remedy."""

    def __init__(self, reason: Reason, what: str) -> None:
        super().__init__(f"{what}: {reason.value}")
        self.reason = reason.name


def stamp_ns(header: Any) -> int:
    """Return the stamp of a header in nanoseconds."""
    return int(header.stamp.sec) * NS + int(header.stamp.nanosec)


def position(message: Any, frame: str = FRAME) -> PositionSample:
    """Read a measured position, m and m^2, from a PoseWithCovarianceStamped; raises Rejected."""
    check_frame(message, frame)
    return PositionSample(
        stamp_ns(message.header),
        plausible("position x", message.pose.pose.position.x, MAX_POSITION_M, Reason.IMPLAUSIBLE_POSITION),
        _variance("position covariance[0]", message.pose.covariance[0]),
    )


def brake_pressure(message: Any, frame: str = FRAME) -> PressureSample:
    """Read a brake-cylinder pressure, gauge Pa, from a FluidPressure (absolute Pa); raises Rejected.

    A released brake whose noise falls below the atmosphere reads 0: a cylinder only pushes.
    """
    check_frame(message, frame)
    absolute = finite("fluid_pressure", message.fluid_pressure)
    if not MIN_ABSOLUTE_PA <= absolute <= MAX_ABSOLUTE_PA:
        raise Rejected(Reason.IMPLAUSIBLE_PRESSURE, f"fluid_pressure = {absolute:g}")
    return PressureSample(stamp_ns(message.header), max(absolute - ATMOSPHERE_PA, 0.0))


def speed(message: Any, frame: str = FRAME) -> SpeedSample:
    """Read an odometer speed, m/s, from a TwistWithCovarianceStamped; raises Rejected."""
    check_frame(message, frame)
    value = plausible("speed x", message.twist.twist.linear.x, MAX_SPEED_MPS, Reason.IMPLAUSIBLE_SPEED)
    return SpeedSample(stamp_ns(message.header), value)


def wheel_speed(message: Any, frame: str = FRAME) -> WheelSample:
    """Read the speeds of the driven axles, rad/s, from a JointState; raises Rejected."""
    check_frame(message, frame)
    names, velocities = list(message.name), list(message.velocity)
    if not names or len(names) != len(velocities):
        raise Rejected(Reason.NO_AXLE, f"wheel speed names = {names}, velocities = {len(velocities)}")
    speeds = (
        plausible(f"wheel speed of {name}", velocity, MAX_WHEEL_RADPS, Reason.IMPLAUSIBLE_WHEEL_SPEED)
        for name, velocity in zip(names, velocities, strict=True)
    )
    return WheelSample(stamp_ns(message.header), tuple(speeds))


def traction_force(message: Any, frame: str = FRAME) -> ForceSample:
    """Read the traction force of all driven axles, N at the rim, from a WrenchStamped; raises Rejected."""
    check_frame(message, frame)
    force = plausible("traction force x", message.wrench.force.x, MAX_FORCE_N, Reason.IMPLAUSIBLE_FORCE)
    return ForceSample(stamp_ns(message.header), force)


def check_frame(message: Any, frame: str = FRAME) -> None:
    """Refuse a message of another frame."""
    if message.header.frame_id != frame:
        raise Rejected(Reason.WRONG_FRAME, f"header.frame_id = {message.header.frame_id!r}")


def finite(what: str, value: Any) -> float:
    """Return a finite number; raises Rejected."""
    number = float(value)
    if not math.isfinite(number):
        raise Rejected(Reason.NOT_FINITE, f"{what} = {number}")
    return number


def plausible(what: str, value: Any, limit: float, reason: Reason) -> float:
    """Return a finite number of at most `limit` in size; raises Rejected."""
    number = finite(what, value)
    if abs(number) > limit:
        raise Rejected(reason, f"{what} = {number:g}")
    return number


def _variance(what: str, value: Any) -> float:
    number = finite(what, value)
    if not MIN_VARIANCE_M2 <= number <= MAX_VARIANCE_M2:
        raise Rejected(Reason.BAD_VARIANCE, f"{what} = {number:g}")
    return number
