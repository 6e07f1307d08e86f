# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The codecs of the sensors: messages to samples, and numbers to the fields of messages.

The writers are alike: stamp, the sensor's numbers in the unit of the message, their variance (0 = unknown), frame.
"""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np

from ...core.intake import samples
from ..line import MAX_ABSOLUTE_PA, MIN_ABSOLUTE_PA, Line
from . import parts
from .codec import Codec, Fields, New
from .parts import stamp_ns, stamps_ns, writer
from .refused import MAX_FORCE_N, MAX_WHEEL_RADPS, MOST_AXLES, Reason, Rejected, plausible, within

Pressure = TypeVar("Pressure", samples.PressureSample, samples.DemandSample)


def read_brake_pressure(message: Any, line: Line) -> samples.PressureSample:
    """Read a brake-cylinder pressure, gauge Pa, from a FluidPressure (absolute Pa); raises Rejected."""
    return samples.PressureSample(stamp_ns(message.header), _gauge_pa(message, line))


def read_brake_demand(message: Any, line: Line) -> samples.DemandSample:
    """Read the brake-cylinder pressure that is demanded, gauge Pa, from a FluidPressure, as `read_brake_pressure`."""
    return samples.DemandSample(stamp_ns(message.header), _gauge_pa(message, line))


def _gauge_pa(message: Any, line: Line) -> float:
    """A released brake whose noise falls below the air's pressure reads 0: a cylinder only pushes."""
    limits = MAX_ABSOLUTE_PA, MIN_ABSOLUTE_PA
    absolute = plausible("fluid_pressure", message.fluid_pressure, Reason.IMPLAUSIBLE_PRESSURE, *limits)
    return max(absolute - line.ambient_pressure_pa, 0.0)


def _gauge_together(kind: type[Pressure], message: Any, line: Line) -> Pressure:
    """Read many of either at once."""
    absolute = within(message.fluid_pressure, MAX_ABSOLUTE_PA, MIN_ABSOLUTE_PA)
    gauge: Any = np.maximum(absolute - line.ambient_pressure_pa, 0.0)
    return kind(stamps_ns(message.header), gauge)


def read_speed(message: Any, _line: Line) -> samples.SpeedSample:
    """Read a speed, m/s, and its variance from a TwistWithCovarianceStamped; raises Rejected."""
    variance = parts.variance_of(message.twist.covariance)
    return samples.SpeedSample(stamp_ns(message.header), parts.speed_of(message), variance)


def read_imu(message: Any, _line: Line) -> samples.ImuSample:
    """Read the acceleration along the track, m/s^2, and its variance from an Imu; raises Rejected."""
    spread, most = message.linear_acceleration_covariance, samples.MAX_ACCELERATION_MPS2
    if spread[0] == -1.0:  # the message's own convention
        raise Rejected(Reason.NO_ACCELERATION, f"imu linear_acceleration_covariance[0] = {spread[0]:g}")
    along = plausible("imu linear_acceleration x", message.linear_acceleration.x, Reason.IMPLAUSIBLE_ACCELERATION, most)
    return samples.ImuSample(stamp_ns(message.header), along, parts.variance_of(spread))


def read_wheel_speed(message: Any, _line: Line) -> samples.WheelSample:
    """Read the speeds of the axles, rad/s, NaN where one has none, from a JointState; raises Rejected."""
    if len(message.name) > MOST_AXLES:
        raise Rejected(Reason.MANY_AXLES, f"wheel speed names = {len(message.name)}")
    names, velocities = list(message.name), list(message.velocity)
    if not names or len(names) != len(velocities):
        raise Rejected(Reason.NO_AXLE, f"wheel speed names = {names}, velocities = {len(velocities)}")
    known = any(not math.isnan(velocity) for velocity in velocities)
    speeds = (
        math.nan
        if known and math.isnan(velocity)
        else plausible(f"wheel speed of {name}", velocity, Reason.IMPLAUSIBLE_WHEEL_SPEED, MAX_WHEEL_RADPS)
        for name, velocity in zip(names, velocities, strict=True)
    )
    return samples.WheelSample(stamp_ns(message.header), tuple(speeds))


def read_traction_force(message: Any, _line: Line) -> samples.ForceSample:
    """Read the traction force of all driven axles, N at the rim, from a WrenchStamped; raises Rejected."""
    force = plausible("traction force x", message.wrench.force.x, Reason.IMPLAUSIBLE_FORCE, MAX_FORCE_N)
    return samples.ForceSample(stamp_ns(message.header), force)


def _wheels(_new: New, speeds_radps: Sequence[float], _variance: float) -> Fields:
    """The angular speeds of axles or axle groups, axle_1 first; the message has no room for a variance."""
    names = [f"axle_{number}" for number in range(1, len(speeds_radps) + 1)]
    return {"name": names, "position": (), "velocity": speeds_radps, "effort": ()}


def _imu(new: New, along_mps2: Sequence[float], variance: float) -> Fields:
    """Neither orientation nor rates are measured."""
    spread, none = np.zeros(9), np.zeros(9)
    spread[0], none[0] = variance, -1.0
    return {
        "orientation": parts.upright(new),
        "orientation_covariance": none,
        "angular_velocity": parts.vector(new, 0.0),
        "angular_velocity_covariance": none,
        "linear_acceleration": parts.vector(new, along_mps2[0]),
        "linear_acceleration_covariance": spread,
    }


def _pressure(_new: New, absolute_pa: Sequence[float], variance: float) -> Fields:
    return {"fluid_pressure": absolute_pa[0], "variance": variance}


def _force(new: New, force_n: Sequence[float], _variance: float) -> Fields:
    wrench = {"force": parts.vector(new, force_n[0]), "torque": parts.vector(new, 0.0)}
    return {"wrench": new("geometry_msgs/msg/Wrench", **wrench)}


BRAKE_PRESSURE = Codec(read_brake_pressure, writer(_pressure), partial(_gauge_together, samples.PressureSample))
BRAKE_DEMAND = Codec(read_brake_demand, writer(_pressure), partial(_gauge_together, samples.DemandSample))
SPEED = Codec(read_speed, writer(lambda new, speed, variance: {"twist": parts.twist(new, speed[0], variance)}))
IMU = Codec(read_imu, writer(_imu))
WHEEL_SPEED = Codec(read_wheel_speed, writer(_wheels))
TRACTION_FORCE = Codec(read_traction_force, writer(_force))
