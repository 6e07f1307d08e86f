# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The codecs of the braking curves and of their target."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.atp.received import StampedCurve
from ...core.intake.samples import MAX_POSITION_M, MAX_SPEED_MPS
from ...core.physics.braking import BrakingCurve
from ...core.physics.train import Array
from ..line import FRAME, TRAIN, Line
from .codec import Codec, Fields, New
from .parts import NS, header, stamp_ns, stamps_ns
from .refused import MOST_POINTS, Reason, Rejected, plausible

if TYPE_CHECKING:  # see results.py
    from ...core.estimate import Estimate


STEP_TOLERANCE, ROUNDING_M2_PER_S2 = 0.05, 1e-6
"""Share by which the way between two points may differ from what their decelerations and speeds give,
and of v^2 what rounding makes of it."""


def read_curve(message: Any, line: Line) -> StampedCurve:
    """Read a braking curve, its distance from 0 on, from a JointTrajectory; raises Rejected.

    Where the chainage falls along it, its velocities are below 0 and its accelerations above, on a standing train too.
    """
    _check_form(message.joint_names, len(message.points))
    rows = _rows(message.points)
    usable = _usable(rows)
    if not usable.all():
        index = int(np.argmin(usable))
        raise Rejected(Reason.NOT_FINITE, f"braking curve point {index} = {rows[index].tolist()}")
    sign = -1 if rows[0, 2] > 0 else 1
    curve = _along(rows, sign)
    for reason, wrong, told in _faults(curve):
        if wrong.any():
            raise Rejected(reason, f"braking curve: {told(int(np.argmax(wrong)))}")
    return StampedCurve(stamp_ns(message.header), float(line.sign * rows[0, 0]), curve, line.sign * sign)


def _read_curves(message: Any, line: Line) -> StampedCurve:
    """Read many at once, those that are not refused: stamps of (k,), places and signs of (k, 1), curves of (k, n)."""
    _check_form(message.joint_names, message.points.shape[1])
    usable = _usable(message.points).all(axis=1)
    rows, stamps = message.points[usable], stamps_ns(message.header)[usable]
    sign = np.where(rows[:, :1, 2] > 0, -1, 1)
    curve = _along(rows, sign)
    fine = ~np.any([wrong.any(axis=1) for _, wrong, _ in _faults(curve)], axis=0)
    kept = BrakingCurve(*(getattr(curve, field.name)[fine] for field in fields(BrakingCurve)))
    places: Any = line.sign * rows[fine, :1, 0]
    signs: Any = line.sign * sign[fine]
    return StampedCurve(stamps[fine], places, kept, signs)


def _check_form(joints: Sequence[str], points: int) -> None:
    if list(joints) != [TRAIN] or not 2 <= points <= MOST_POINTS:
        raise Rejected(Reason.BAD_CURVE, f"braking curve joints = {list(joints)}, points = {points}")


def _usable(rows: Array) -> NDArray[np.bool_]:
    """Whether every number of a point is finite, and not beyond all."""
    return np.asarray((np.abs(rows) <= 10 * MAX_POSITION_M).all(axis=-1))  # False for NaN


def _along(rows: Array, sign: Any) -> BrakingCurve:
    """The curve of points, of (..., 4), as the train runs."""
    place, velocity, acceleration, time = np.moveaxis(rows, -1, 0)
    return BrakingCurve(sign * (place - place[..., :1]), sign * velocity, -sign * acceleration, time)


def write_curve(new: New, t_ns: int, position_m: float, curve: BrakingCurve) -> Fields:
    """Write a braking curve that begins at a place: where the train will be, how fast, when."""
    columns = (
        (position_m + curve.distance_m).tolist(),
        curve.speed_mps.tolist(),
        (-curve.deceleration_mps2).tolist(),
        *(part.tolist() for part in np.divmod(np.rint(curve.time_s * NS).astype(np.int64), NS)),
    )
    points = [
        new(
            "trajectory_msgs/msg/JointTrajectoryPoint",
            positions=(place,),
            velocities=(velocity,),
            accelerations=(acceleration,),
            effort=(),
            time_from_start=new("builtin_interfaces/msg/Duration", sec=seconds, nanosec=rest),
        )
        for place, velocity, acceleration, seconds, rest in zip(*columns, strict=True)
    ]
    return {"header": header(new, t_ns), "joint_names": [TRAIN], "points": points}


class Target(NamedTuple):
    """Where a train may be how fast at most: m along the run, m/s."""

    position_m: float
    speed_mps: float


def read_target(message: Any, line: Line) -> Target:
    """Read a target from a JointTrajectory of one point; raises Rejected. A speed has no sign here."""
    points = message.points
    if list(message.joint_names) != [TRAIN] or len(points) != 1:
        raise Rejected(Reason.BAD_TARGET, f"target joints = {list(message.joint_names)}, points = {len(points)}")
    (point,) = points
    if not len(point.positions) == len(point.velocities) == 1:
        raise Rejected(
            Reason.BAD_TARGET, f"target positions = {len(point.positions)}, velocities = {len(point.velocities)}"
        )
    place = plausible("target position", point.positions[0], Reason.IMPLAUSIBLE_POSITION, MAX_POSITION_M)
    speed = plausible("target speed", point.velocities[0], Reason.IMPLAUSIBLE_SPEED, MAX_SPEED_MPS)
    return Target(line.sign * place, abs(speed))


def write_target(new: New, t_ns: int, target: Target, frame: str = FRAME) -> Fields:
    """Write a target where the chainage rises along the run."""
    point = new(
        "trajectory_msgs/msg/JointTrajectoryPoint",
        positions=(target.position_m,),
        velocities=(target.speed_mps,),
        accelerations=(),
        effort=(),
        time_from_start=new("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
    )
    return {"header": header(new, t_ns, frame), "joint_names": [TRAIN], "points": [point]}


def _predicted(new: New, estimate: Estimate, curve: BrakingCurve | None) -> Fields | None:
    return None if curve is None else write_curve(new, estimate.t_ns, estimate.position_m, curve)


def _rows(points: Sequence[Any]) -> Array:
    if any(not len(p.positions) == len(p.velocities) == len(p.accelerations) == 1 for p in points):
        raise Rejected(Reason.BAD_CURVE, "braking curve: a point without exactly one value of each kind")
    return np.array([_row(point) for point in points])


def _row(point: Any) -> tuple[float, float, float, float]:
    after = point.time_from_start
    return point.positions[0], point.velocities[0], point.accelerations[0], after.sec + after.nanosec / NS


def _turn(what: str, at: int) -> str:
    return f"{what} turns at point {at + 1}"


def _faults(curve: BrakingCurve) -> Iterator[tuple[Reason, NDArray[np.bool_], Callable[[int], str]]]:
    """Why a course is impossible, at which of its points, and in words of one; arrays of (..., n)."""
    way, slowing, lost = np.diff(curve.distance_m), curve.deceleration_mps2, -np.diff(np.square(curve.speed_mps))
    for what, steps in (("position", way), ("time", np.diff(curve.time_s)), ("speed", -np.diff(curve.speed_mps))):
        yield Reason.BAD_CURVE, steps < 0, partial(_turn, what)
    wrong = (curve.speed_mps[..., -1:] < 0) | (slowing.min(axis=-1, keepdims=True) <= 0)
    yield Reason.BAD_CURVE, wrong, lambda _: "a negative speed or no deceleration"
    # between two points v^2 falls by 2 a ds, with a between their decelerations
    weaker, stronger = np.minimum(slowing[..., :-1], slowing[..., 1:]), np.maximum(slowing[..., :-1], slowing[..., 1:])
    least, most = 2.0 * weaker * way * (1.0 - STEP_TOLERANCE), 2.0 * stronger * way * (1.0 + STEP_TOLERANCE)
    wrong = (lost < least - ROUNDING_M2_PER_S2) | (lost > most + ROUNDING_M2_PER_S2)
    yield (
        Reason.IMPLAUSIBLE_CURVE,
        wrong,
        lambda at: (
            f"v^2 falls by {lost[at]:.4g} m^2/s^2 from point {at} to {at + 1}, "
            f"on {way[at]:.4g} m at {weaker[at]:.4g} to {stronger[at]:.4g} m/s^2"
        ),
    )


TARGET = Codec(read_target, write_target)
SAFE = Codec(read_curve, lambda new, made: _predicted(new, made.estimate, made.safe), _read_curves)
NOMINAL = SAFE._replace(write=lambda new, made: _predicted(new, made.estimate, made.nominal))
