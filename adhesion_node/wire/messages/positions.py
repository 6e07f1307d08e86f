# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The codecs of what can give the positions: along the track, by satellite, by odometry."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.intake.samples import MAX_POSITION_M, MAX_VARIANCE_M2, MIN_VARIANCE_M2, PositionSample
from ..line import TRAIN, Line
from . import parts
from .codec import Codec, Fields, New
from .parts import stamp_ns, stamps_ns, writer
from .refused import Reason, Rejected, plausible, whole, within

NO_FIX = -1
"""NavSatStatus: no position. -2, a status never set, is taken for one."""

UNKNOWN, DIAGONAL_KNOWN = 0, 2
"""Types of a NavSatFix's covariance; 1 is approximated, 3 known."""


def read_position(message: Any, line: Line) -> PositionSample:
    """Read a position along the run, m and m^2, from a message with a `pose`; raises Rejected."""
    place = parts.place_of(message, line)
    return PositionSample(stamp_ns(message.header), place, _variance(message.pose.covariance[0], line))


def _positions_together(message: Any, line: Line) -> PositionSample:
    """Read many of them at once."""
    place = line.sign * within(message.pose.pose.position.x, MAX_POSITION_M)
    given = message.pose.covariance[0]
    variance = np.where(given == 0.0, line.position_std_m**2, within(given, MAX_VARIANCE_M2, MIN_VARIANCE_M2))
    return PositionSample(stamps_ns(message.header), *whole(place, variance))


def read_fix(message: Any, line: Line) -> PositionSample:
    """Read a position along the run, m and m^2, from a NavSatFix; raises Rejected.

    Of its covariance, east-north-up, that along the track counts.
    """
    if line.track is None:
        raise Rejected(Reason.NO_TRACK_LINE, "track_line = ''")
    if message.status.status == NO_FIX:
        raise Rejected(Reason.NO_FIX, f"status = {message.status.status}")
    latitude = plausible("latitude", message.latitude, Reason.IMPLAUSIBLE_FIX, 90.0)
    longitude = plausible("longitude", message.longitude, Reason.IMPLAUSIBLE_FIX, 180.0)
    if latitude == longitude == 0.0:  # as written for none; no railway is there
        raise Rejected(Reason.NO_FIX, "latitude = longitude = 0")
    known = message.position_covariance_type != UNKNOWN
    east, mixed, _, mixed_too, north, *_ = map(float, message.position_covariance) if known else [0.0] * 9
    widest = max(_variance(spread, line) for spread in (east, north))
    place = line.track.place(latitude, longitude, widest**0.5, line.max_cross_track_m)
    along = place.east**2 * east + place.east * place.north * (mixed + mixed_too) + place.north**2 * north
    return PositionSample(stamp_ns(message.header), line.sign * place.along_m, _variance(along, line))


def _variance(given: float, line: Line) -> float:
    """The variance, m^2, of a position; 0 is unknown, as in ROS."""
    if given == 0.0:
        return line.position_std_m**2
    return plausible("position covariance[0]", given, Reason.BAD_VARIANCE, MAX_VARIANCE_M2, MIN_VARIANCE_M2)


def _fix(new: New, place: Sequence[float], variance: float) -> Fields:
    """A fix at latitude and longitude, degrees, and height, m or NaN where it is not known."""
    latitude, longitude, altitude = place
    spread = (variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, 4.0 * variance)  # GNSS: twice as wide in height
    return {
        "status": new("sensor_msgs/msg/NavSatStatus", status=0, service=1),
        "latitude": latitude,
        "longitude": longitude,
        "altitude": altitude,
        "position_covariance": spread,
        "position_covariance_type": DIAGONAL_KNOWN if variance else UNKNOWN,
    }


def _odometry(new: New, x: Sequence[float], variance: float) -> Fields:
    still = parts.twist(new, 0.0, 0.0)
    return {"child_frame_id": TRAIN, "pose": parts.pose(new, x[0], variance), "twist": still}


POSITION = Codec(
    read_position,
    writer(lambda new, x, variance: {"pose": parts.pose(new, x[0], variance)}),
    _positions_together,
)
FIX = Codec(read_fix, writer(_fix))
ODOMETRY = Codec(read_position, writer(_odometry), _positions_together)
