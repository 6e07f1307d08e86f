# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the codecs of all topics share: stamps, headers, the line's frame and air, and why a message is refused.

A message is read from any object with its fields: rclpy's, what rosbags reads from a file, a plain one. It is made by
a `New`: of rclpy's classes (nodes/ros/types.py), of those of rosbags (bag/types.py), or as a `plain` object.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from ..core.intake.outcome import text_of
from ..core.intake.samples import (
    MAX_ACCELERATION_MPS2,
    MAX_POSITION_M,
    MAX_SPEED_MPS,
    MAX_VARIANCE_M2,
    MIN_VARIANCE_M2,
)
from ..core.physics.train import Array
from ..core.setting import check_settings, setting

if TYPE_CHECKING:  # it needs a geodesy library, and that only where there is a track line
    from .track_line import TrackLine

NS = 1_000_000_000

FRAME = "track"
"""Frame of places: x is the chainage of the track."""

TRAIN = "train"
"""Moving frame of the state and joint of the braking curve."""

UP, DOWN = "up", "down"
"""The chainage rises along the run, or falls."""

ATMOSPHERE_PA = 101_325.0
"""Standard atmosphere at sea level."""

MIN_ABSOLUTE_PA, MAX_ABSOLUTE_PA = 45e3, 5e6
"""Air on the highest railway (5072 m) is 53 kPa, less in bad weather; no brake works above 5 MPa."""

MAX_AMBIENT_PA = 110e3
"""No air pressure has been seen above."""

MAX_WHEEL_RADPS = 1e3
"""No wheel of a train turns faster: 500 km/h on a wheel of 0.3 m are 463 rad/s."""

MOST_AXLES = 400
"""A train of 1500 m has no more: axles are kept for seconds, and nobody is to fill the memory with them."""

MOST_POINTS = 2000
"""Of a braking curve: one in 0.07 m/s from 500 km/h on."""

MAX_FORCE_N = 1e7
"""No train pulls harder; the strongest locomotives reach 2 MN."""


@dataclass(frozen=True, slots=True)
class Line:
    """What a reader or writer knows of the line beyond the message. Raises ValueError naming what is out of range."""

    frame: str = setting(FRAME, "frame_id that positions must have and that results get", group="intake")
    ambient_pressure_pa: float = setting(
        ATMOSPHERE_PA,
        "Pressure of the air, by which an absolute brake pressure is above the gauge one; some 54 kPa at 5000 m",
        "Pa",
        MIN_ABSOLUTE_PA,
        MAX_AMBIENT_PA,
        group="intake",
    )
    position_source: str = setting(
        "auto",
        "Topic of the positions; auto: fix where there is a track_line, else position, else odometry",
        choices=("auto", "position", "fix", "odometry"),
        group="intake",
    )
    position_std_m: float = setting(
        3.0,
        "Standard deviation of a position whose message gives none (covariance 0 or of type unknown)",
        "m",
        1e-3,
        1e4,
        group="intake",
    )
    max_cross_track_m: float = setting(
        25.0, "Distance from track_line beyond which a fix is refused", "m", 0.1, 1e4, group="intake"
    )
    child_frame: str = setting(TRAIN, "Frame of the train in results: child_frame_id, x forward", group="intake")
    direction: str = setting(
        UP, "Whether the chainage rises along the run (up) or falls (down)", choices=(UP, DOWN), group="intake"
    )
    track: "TrackLine | None" = None
    """The track's centre line, on which a `fix` is projected."""
    unused: frozenset[str] = frozenset()
    """Names of the topics that are switched off."""
    latency_s: dict[str, float] = field(default_factory=dict, hash=False)
    """By how much stamps are late, by the name of the topic; what is not named is not."""

    def __post_init__(self) -> None:
        check_settings(self, "")
        if self.position_source == "fix" and self.track is None:
            raise ValueError("position_source = 'fix': set track_line, too, on which a fix is projected")

    @property
    def sign(self) -> int:
        """What a chainage is multiplied by so that it grows along the run, and the other way round."""
        return -1 if self.direction == DOWN else 1


NOMINAL = Line()

Fields = dict[str, Any]
"""The fields of a message by name."""


class New(Protocol):
    """Makes a message or a part of one of a type in ROS spelling.

    Every field of the type is given: numbers in a row as a tuple or an array, a byte as `bytes`.
    """

    def __call__(self, type_name: str, /, **fields: Any) -> Any: ...


class Codec(NamedTuple):
    """How the messages of a topic are read, whatever their frame (raises Rejected), and how their fields are written.

    A writer takes a `New` and what it says; it returns None where there is nothing to publish.
    """

    read: Callable[[Any, Line], Any]
    write: Callable[..., Fields | None]
    together: Callable[[Any, Line], Any] | None = None
    """Reads one message that stands for many, its numbers being arrays: NaN for those that `read` refuses."""


def plain(type_name: str, /, **fields: Any) -> SimpleNamespace:
    """Make a plain object with the fields of a message: no ROS, no bag."""
    del type_name
    return SimpleNamespace(**fields)


class Reason(Enum):
    """Why a message was refused; the value is the remedy."""

    WRONG_FRAME = "set header.frame_id, or the reader's parameter frame, so that both agree"
    NOT_FINITE = "give a finite number, or publish nothing while there is none"
    BAD_VARIANCE = (
        f"give covariance[0] in SI units squared, {MIN_VARIANCE_M2:g} to {MAX_VARIANCE_M2:g}, or 0 where unknown"
    )
    IMPLAUSIBLE_POSITION = f"position is in m along the track, within +-{MAX_POSITION_M:g}"
    NO_FIX = "the receiver has no fix: nothing is used until it has one"
    IMPLAUSIBLE_FIX = "latitude is in degrees, within +-90, longitude within +-180"
    NO_TRACK_LINE = "set track_line to a GeoJSON or CSV file with the centre line of the track"
    OFF_TRACK = (
        "is track_line that of this way, does it reach beyond the ends of the way, are latitude and longitude "
        "exchanged? Raise max_cross_track_m only if the line or the receiver is that poor"
    )
    AMBIGUOUS = "the line comes by twice: nothing is used here; give each way or direction a track_line of its own"
    SWITCHED_OFF = "set it to true to use this sensor"
    OTHER_SOURCE = "another topic gives the positions: name the one that shall in position_source"
    IMPLAUSIBLE_PRESSURE = (
        f"fluid_pressure is absolute, in Pa, {MIN_ABSOLUTE_PA:g} to {MAX_ABSOLUTE_PA:g}: "
        f"add {ATMOSPHERE_PA:g} Pa to a gauge pressure, or the pressure of your air, and set ambient_pressure_pa "
        "to that; multiply kPa by 1000 and bar by 100000"
    )
    IMPLAUSIBLE_SPEED = f"speed is in m/s, not km/h, within +-{MAX_SPEED_MPS:g}"
    NO_ACCELERATION = "linear_acceleration_covariance[0] = -1 says that none is measured: give it, or publish no imu"
    IMPLAUSIBLE_ACCELERATION = (
        f"linear_acceleration.x is in m/s^2 along the track, not in g, within +-{MAX_ACCELERATION_MPS2:g}"
    )
    NO_AXLE = "give one velocity, rad/s, for every driven axle in name"
    MANY_AXLES = f"give at most {MOST_AXLES}, of the axles that have a sensor"
    IMPLAUSIBLE_WHEEL_SPEED = f"velocity is in rad/s, not rpm, within +-{MAX_WHEEL_RADPS:g}"
    IMPLAUSIBLE_FORCE = f"force.x is in N, within +-{MAX_FORCE_N:g}"
    UNDECODABLE = "leave it out of the recording, as `recover --drop-undecodable` does"
    DISABLED = "call ~/set_enabled with true to go on"
    BAD_CURVE = (
        f"give one joint '{TRAIN}', 2 to {MOST_POINTS} points, each with one position, velocity and acceleration; "
        "positions and times rise, speeds fall and are not negative, accelerations are below 0"
    )
    BAD_TARGET = f"give one joint '{TRAIN}' and one point with one position, m, and one velocity, m/s"
    IMPLAUSIBLE_CURVE = (
        "between two points v^2 falls by 2 a ds: give positions in m, velocities in m/s, accelerations in m/s^2"
    )


class Rejected(ValueError):
    """A message that must not be used: `reason` is the name of a `Reason`, the text says what = value: remedy."""

    def __init__(self, reason: Reason, what: str) -> None:
        super().__init__(f"{text_of(what)}: {reason.value}")
        self.reason = reason.name


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


def finite(what: str, value: Any) -> float:
    """Return a finite number; raises Rejected."""
    number = float(value)
    if not math.isfinite(number):
        raise Rejected(Reason.NOT_FINITE, f"{what} = {number}")
    return number


def plausible(what: str, value: Any, reason: Reason, most: float, least: float | None = None) -> float:
    """Return a finite number from `least`, else -`most`, to `most`; raises Rejected."""
    number = finite(what, value)
    if not (-most if least is None else least) <= number <= most:
        raise Rejected(reason, f"{what} = {number:g}")
    return number


def within(values: Array, most: float, least: float | None = None) -> Any:
    """Return those numbers that `plausible` returns, NaN in the place of others."""
    return np.where((values >= (-most if least is None else least)) & (values <= most), values, np.nan)


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
