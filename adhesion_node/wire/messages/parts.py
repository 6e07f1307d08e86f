# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Parts that messages of several topics have: stamps, headers, places and speeds along the track, covariances."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...core.intake.samples import MAX_POSITION_M, MAX_SPEED_MPS, MAX_VARIANCE_M2, MIN_VARIANCE_M2
from ...core.physics.train import Array
from ..line import FRAME, Line
from .codec import Fields, New
from .refused import Reason, plausible

NS = 1_000_000_000


def nanoseconds(time: Any) -> int:
    """Return a Time in nanoseconds."""
    return int(time.sec) * NS + int(time.nanosec)


def stamp_ns(header: Any) -> int:
    """Return the stamp of a header in nanoseconds."""
    return nanoseconds(header.stamp)


def stamps_ns(header: Any) -> Any:
    """Return the stamps of messages that are one, in nanoseconds; shape (k,)."""
    return header.stamp.sec.astype(np.int64) * NS + header.stamp.nanosec


def header(new: New, t_ns: int, frame: str = FRAME) -> Any:
    """Build a header."""
    return new("std_msgs/msg/Header", stamp=moment(new, t_ns), frame_id=frame)


def writer(written: Callable[[New, Sequence[float], float], Fields]) -> Callable[..., Fields]:
    """Put the header before what is `written` of a sensor's numbers and their variance."""

    def write(new: New, t_ns: int, numbers: Sequence[float], variance: float = 0.0, frame: str = FRAME) -> Fields:
        return {"header": header(new, t_ns, frame), **written(new, numbers, variance)}

    return write


def moment(new: New, t_ns: int) -> Any:
    """Build a Time."""
    seconds, rest = divmod(t_ns, NS)
    return new("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)


def vector(new: New, x: float, kind: str = "Vector3") -> Any:
    """Build a Vector3 or a Point along the track."""
    return new(f"geometry_msgs/msg/{kind}", x=x, y=0.0, z=0.0)


def upright(new: New) -> Any:
    """Build the Quaternion of no rotation."""
    return new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)


def covariance(first: float) -> Array:
    """Return a covariance of which only the variance along the track is known; shape (36,)."""
    filled = np.zeros(36)
    filled[0] = first
    return filled


def pose(new: New, x: float, variance: float) -> Any:
    """Build a PoseWithCovariance of a place on the track, m and m^2."""
    place = new("geometry_msgs/msg/Pose", position=vector(new, x, "Point"), orientation=upright(new))
    return new("geometry_msgs/msg/PoseWithCovariance", pose=place, covariance=covariance(variance))


def twist(new: New, speed_mps: float, variance: float) -> Any:
    """Build a TwistWithCovariance of a speed along the track, m/s and (m/s)^2."""
    rates = new("geometry_msgs/msg/Twist", linear=vector(new, speed_mps), angular=vector(new, 0.0))
    return new("geometry_msgs/msg/TwistWithCovariance", twist=rates, covariance=covariance(variance))


def variance_of(covariance: Sequence[float]) -> float | None:
    """Return the first variance of a covariance; None where that is unknown: 0, negative or not a possible one."""
    variance = float(covariance[0])
    return variance if MIN_VARIANCE_M2 <= variance <= MAX_VARIANCE_M2 else None


def place_of(message: Any, line: Line) -> float:
    """Return the place along the run, m, of a message with a `pose`; raises Rejected."""
    place = plausible("position x", message.pose.pose.position.x, Reason.IMPLAUSIBLE_POSITION, MAX_POSITION_M)
    return line.sign * place


def speed_of(message: Any) -> float:
    """Return the speed along the track, m/s, of a message with a `twist`; raises Rejected."""
    return plausible("speed x", message.twist.twist.linear.x, Reason.IMPLAUSIBLE_SPEED, MAX_SPEED_MPS)
