# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The codecs of what the nodes find out, of the simulator's truth and of the clock; `curves` has the braking curves.

A writer returns None where there is nothing to publish.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core.atp.received import TrainState
from ...core.intake.samples import MAX_POSITION_M, MAX_SPEED_MPS, MIN_VARIANCE_M2
from ...core.physics.train import GRAVITY
from ..line import TRAIN, Line
from . import parts
from .codec import Codec, Fields, New
from .parts import header, stamp_ns, stamps_ns
from .refused import Reason, Rejected, finite, whole, within

if TYPE_CHECKING:  # the simulator uses these codecs, too, and must not know the estimators
    from ...core.prediction import Prediction

MOST = float(np.finfo(np.float64).max)
"""Every number that is one."""


class Deceleration(NamedTuple):
    """An acceleration along the track, below 0 for a braking train, m/s^2, and its variance."""

    t_ns: int
    acceleration_mps2: float
    variance: float


class Status(NamedTuple):
    """One entry of a diagnostics message; `level` as in DiagnosticStatus, 0 is OK."""

    name: str
    level: int
    message: str
    values: Mapping[str, str]
    hardware_id: str = ""
    """The train."""

    @property
    def namespace(self) -> str:
        """Of the node that tells it, without slashes around; the name is node and part behind it.

        >>> [Status(name, 0, "", {}).namespace for name in ("line1/train1/estimator/adhesion", "estimator/adhesion")]
        ['line1/train1', '']
        """
        return "/".join(self.name.split("/")[:-2])


class Statuses(NamedTuple):
    """A diagnostics message."""

    t_ns: int
    entries: tuple[Status, ...]


def read_number(message: Any, _line: Line) -> float:
    """Read a Float64; raises Rejected."""
    return finite("data", message.data)


def _numbers(message: Any, _line: Line) -> Any:
    """Read many at once."""
    return within(message.data, MOST)


def read_deceleration(message: Any, _line: Line) -> Deceleration:
    """Read an acceleration along the track from an AccelWithCovarianceStamped; raises Rejected."""
    accel = message.accel
    along, variance = finite("accel x", accel.accel.linear.x), finite("accel covariance[0]", accel.covariance[0])
    return Deceleration(stamp_ns(message.header), along, variance)


def _decelerations(message: Any, _line: Line) -> Deceleration:
    """Read many at once."""
    return Deceleration(stamps_ns(message.header), *whole(message.accel.accel.linear.x, message.accel.covariance[0]))


def write_deceleration(new: New, prediction: Prediction, *, lower: bool = False) -> Fields | None:
    """Write the largest deceleration, -mu g along x, or of its bound, and its variance (g mu_std)^2."""
    if prediction.estimate.withheld:
        return None
    estimate = prediction.estimate
    mu = estimate.mu_lower if lower else estimate.mu
    along = new("geometry_msgs/msg/Accel", linear=parts.vector(new, -mu * GRAVITY), angular=parts.vector(new, 0.0))
    spread = parts.covariance((GRAVITY * estimate.mu_std) ** 2)
    accel = new("geometry_msgs/msg/AccelWithCovariance", accel=along, covariance=spread)
    return {"header": header(new, estimate.t_ns), "accel": accel}


def read_state(message: Any, line: Line, least: float = 0.0) -> TrainState:
    """Read the train's state along the run, m and m/s, with standard deviations, from an Odometry; raises Rejected.

    No variance may be below `least`.
    """
    place, speed = parts.place_of(message, line), parts.speed_of(message)
    deviations = []
    for what, part in (("position", message.pose), ("speed", message.twist)):
        variance = finite(f"{what} covariance[0]", part.covariance[0])
        if variance < least:
            raise Rejected(Reason.BAD_VARIANCE, f"{what} covariance[0] = {variance:g}")
        deviations.append(math.sqrt(variance))
    return TrainState(stamp_ns(message.header), place, speed, *deviations)


def _states(message: Any, line: Line, least: float = 0.0) -> TrainState:
    """Read many states at once."""
    place = line.sign * within(message.pose.pose.position.x, MAX_POSITION_M)
    speed = within(message.twist.twist.linear.x, MAX_SPEED_MPS)
    variances = within(np.array([message.pose.covariance[0], message.twist.covariance[0]]), MOST, least)
    return TrainState(stamps_ns(message.header), *whole(place, speed, *np.sqrt(variances)))


def read_estimated_state(message: Any, line: Line) -> TrainState:
    """Read a state that was estimated: none is exact, a variance of 0 was left out. Raises Rejected."""
    return read_state(message, line, MIN_VARIANCE_M2)


def write_state(
    new: New, t_ns: int, position_m: float, speed_mps: float, position_var: float = 0.0, speed_var: float = 0.0
) -> Fields:
    """Write position and speed along the track with their variances, m^2 and (m/s)^2; 0 is exact."""
    return {
        "header": header(new, t_ns),
        "child_frame_id": TRAIN,
        "pose": parts.pose(new, position_m, position_var),
        "twist": parts.twist(new, speed_mps, speed_var),
    }


def write_estimated_state(new: New, prediction: Prediction) -> Fields:
    """Write the state that an estimate found."""
    e = prediction.estimate
    return write_state(new, e.t_ns, e.position_m, e.speed_mps, e.position_std_m**2, e.speed_std_mps**2)


def read_statuses(message: Any, _line: Line) -> Statuses:
    """Read all entries of a DiagnosticArray, whose values may be decoded as a dict."""
    entries = (
        Status(
            entry.name,
            entry.level[0] if isinstance(entry.level, bytes) else int(entry.level),
            entry.message,
            entry.values if isinstance(entry.values, dict) else {pair.key: pair.value for pair in entry.values},
            entry.hardware_id,
        )
        for entry in message.status
    )
    return Statuses(stamp_ns(message.header), tuple(entries))


def write_status(new: New, t_ns: int, status: Status) -> Fields:
    """Write a DiagnosticArray of one entry."""
    values = [new("diagnostic_msgs/msg/KeyValue", key=key, value=value) for key, value in status.values.items()]
    fields = {**status._asdict(), "level": bytes([status.level]), "values": values}
    return {"header": header(new, t_ns), "status": [new("diagnostic_msgs/msg/DiagnosticStatus", **fields)]}


NUMBER = Codec(read_number, lambda _, value: {"data": value}, _numbers)
FLAG = Codec(lambda message, _: bool(message.data), lambda _, value: {"data": value})
MU = NUMBER._replace(write=lambda _, made: None if made.estimate.withheld else {"data": made.estimate.mu})
MU_LOWER = NUMBER._replace(write=lambda _, made: None if made.estimate.withheld else {"data": made.estimate.mu_lower})
CREEP_MU_MAX = Codec(read_number, lambda _, found: {"data": found.mu_max} if found.known else None)
CREEP_LAMBDA_M = Codec(read_number, lambda _, found: {"data": found.lambda_m} if found.known else None)
DECELERATION = Codec(read_deceleration, write_deceleration, _decelerations)
DECELERATION_LOWER = DECELERATION._replace(write=partial(write_deceleration, lower=True))
STATE = Codec(read_state, write_state, _states)
ESTIMATED_STATE = Codec(read_estimated_state, write_estimated_state, partial(_states, least=MIN_VARIANCE_M2))
STATUS = Codec(read_statuses, write_status)
CLOCK = Codec(lambda message, _: parts.nanoseconds(message.clock), lambda new, t_ns: {"clock": parts.moment(new, t_ns)})
