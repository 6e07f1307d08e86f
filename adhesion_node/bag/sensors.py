# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The sensor messages as CDR, built without ROS: what a simulator or a converter puts into a recording."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..wire.topics import BRAKE_PRESSURE, FRAME, POSITION, SPEED
from .types import serialize, typestore

NS = 1_000_000_000


def position(t_ns: int, position_m: float, variance_m2: float) -> bytes:
    """Return a measured position along the track, m, and its variance, m^2."""
    place = _new("geometry_msgs/msg/Point", x=position_m, y=0.0, z=0.0)
    level = _new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    pose = _new("geometry_msgs/msg/Pose", position=place, orientation=level)
    covariance = np.zeros(36)
    covariance[0] = variance_m2
    measured = _new("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=covariance)
    return serialize(_new(POSITION.type, header=_header(t_ns), pose=measured), POSITION.type)


def brake_pressure(t_ns: int, absolute_pa: float) -> bytes:
    """Return a brake-cylinder pressure, absolute Pa; variance 0 means unknown."""
    message = _new(BRAKE_PRESSURE.type, header=_header(t_ns), fluid_pressure=absolute_pa, variance=0.0)
    return serialize(message, BRAKE_PRESSURE.type)


def speed(t_ns: int, speed_mps: float) -> bytes:
    """Return an odometer speed, m/s; covariance 0 means unknown."""
    along = _new("geometry_msgs/msg/Vector3", x=speed_mps, y=0.0, z=0.0)
    turn = _new("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    twist = _new("geometry_msgs/msg/Twist", linear=along, angular=turn)
    measured = _new("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36))
    return serialize(_new(SPEED.type, header=_header(t_ns), twist=measured), SPEED.type)


def _header(t_ns: int) -> Any:
    seconds, nanoseconds = divmod(t_ns, NS)
    stamp = _new("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
    return _new("std_msgs/msg/Header", stamp=stamp, frame_id=FRAME)


def _new(type_name: str, **values: Any) -> Any:
    return typestore().types[type_name](**values)
