# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The codecs of the sensors: messages to samples, and numbers to the fields of messages.

The writers are alike: stamp, the sensor's numbers in the unit of the message, their variance (0 = unknown), frame.
"""

from collections.abc import Sequence
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
from .codecs import (
    FRAME,
    MAX_ABSOLUTE_PA,
    MAX_FORCE_N,
    MAX_WHEEL_RADPS,
    MIN_ABSOLUTE_PA,
    Codec,
    Fields,
    Line,
    New,
    Reason,
    Rejected,
    finite,
    header,
    plausible,
    pose,
    stamp_ns,
    twist,
    vector,
)


def read_position(message: Any, _line: Line) -> PositionSample:
    """Read a measured position, m and m^2, from a PoseWithCovarianceStamped; raises Rejected."""
    place = plausible("position x", message.pose.pose.position.x, MAX_POSITION_M, Reason.IMPLAUSIBLE_POSITION)
    variance = finite("position covariance[0]", message.pose.covariance[0])
    if not MIN_VARIANCE_M2 <= variance <= MAX_VARIANCE_M2:
        raise Rejected(Reason.BAD_VARIANCE, f"position covariance[0] = {variance:g}")
    return PositionSample(stamp_ns(message.header), place, variance)


def write_position(
    new: New, t_ns: int, position_m: Sequence[float], variance: float = 0.0, frame: str = FRAME
) -> Fields:
    """Write a position along the track."""
    return {
        "header": header(new, t_ns, frame),
        "pose": pose(new, position_m[0], variance),
    }


def read_brake_pressure(message: Any, line: Line) -> PressureSample:
    """Read a brake-cylinder pressure, gauge Pa, from a FluidPressure (absolute Pa); raises Rejected.

    A released brake whose noise falls below the air's pressure reads 0: a cylinder only pushes.
    """
    absolute = finite("fluid_pressure", message.fluid_pressure)
    if not MIN_ABSOLUTE_PA <= absolute <= MAX_ABSOLUTE_PA:
        raise Rejected(Reason.IMPLAUSIBLE_PRESSURE, f"fluid_pressure = {absolute:g}")
    return PressureSample(stamp_ns(message.header), max(absolute - line.ambient_pressure_pa, 0.0))


def write_brake_pressure(
    new: New, t_ns: int, absolute_pa: Sequence[float], variance: float = 0.0, frame: str = FRAME
) -> Fields:
    """Write an absolute brake-cylinder pressure."""
    return {
        "header": header(new, t_ns, frame),
        "fluid_pressure": absolute_pa[0],
        "variance": variance,
    }


def read_speed(message: Any, _line: Line) -> SpeedSample:
    """Read an odometer speed, m/s, from a TwistWithCovarianceStamped; raises Rejected."""
    value = plausible("speed x", message.twist.twist.linear.x, MAX_SPEED_MPS, Reason.IMPLAUSIBLE_SPEED)
    return SpeedSample(stamp_ns(message.header), value)


def write_speed(new: New, t_ns: int, speed_mps: Sequence[float], variance: float = 0.0, frame: str = FRAME) -> Fields:
    """Write an odometer speed."""
    return {
        "header": header(new, t_ns, frame),
        "twist": twist(new, speed_mps[0], variance),
    }


def read_wheel_speed(message: Any, _line: Line) -> WheelSample:
    """Read the speeds of the axles, rad/s, from a JointState; raises Rejected."""
    names, velocities = list(message.name), list(message.velocity)
    if not names or len(names) != len(velocities):
        raise Rejected(Reason.NO_AXLE, f"wheel speed names = {names}, velocities = {len(velocities)}")
    speeds = (
        plausible(f"wheel speed of {name}", velocity, MAX_WHEEL_RADPS, Reason.IMPLAUSIBLE_WHEEL_SPEED)
        for name, velocity in zip(names, velocities, strict=True)
    )
    return WheelSample(stamp_ns(message.header), tuple(speeds))


def write_wheel_speed(
    new: New, t_ns: int, speeds_radps: Sequence[float], _variance: float = 0.0, frame: str = FRAME
) -> Fields:
    """Write the angular speeds of axles or axle groups, axle_1 first; it has no room for a variance."""
    return {
        "header": header(new, t_ns, frame),
        "name": [f"axle_{number}" for number in range(1, len(speeds_radps) + 1)],
        "position": (),
        "velocity": speeds_radps,
        "effort": (),
    }


def read_traction_force(message: Any, _line: Line) -> ForceSample:
    """Read the traction force of all driven axles, N at the rim, from a WrenchStamped; raises Rejected."""
    force = plausible("traction force x", message.wrench.force.x, MAX_FORCE_N, Reason.IMPLAUSIBLE_FORCE)
    return ForceSample(stamp_ns(message.header), force)


def write_traction_force(
    new: New, t_ns: int, force_n: Sequence[float], _variance: float = 0.0, frame: str = FRAME
) -> Fields:
    """Write the traction force of all driven axles; it has no room for a variance."""
    wrench = new("geometry_msgs/msg/Wrench", force=vector(new, force_n[0]), torque=vector(new, 0.0))
    return {"header": header(new, t_ns, frame), "wrench": wrench}


POSITION = Codec(read_position, write_position)
BRAKE_PRESSURE = Codec(read_brake_pressure, write_brake_pressure)
SPEED = Codec(read_speed, write_speed)
WHEEL_SPEED = Codec(read_wheel_speed, write_wheel_speed)
TRACTION_FORCE = Codec(read_traction_force, write_traction_force)
