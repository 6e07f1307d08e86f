# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is decoded and read together, or by our own decoder, is what the library and the codecs make of each message."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as some

from adhesion_node.bag import Record
from adhesion_node.bag.read.statuses import TYPE as DIAGNOSTICS
from adhesion_node.bag.read.statuses import statuses
from adhesion_node.bag.read.together import MOST_TOGETHER, TRAJECTORY, read_together, together
from adhesion_node.bag.types import deserialize, encode, new, serialize, typestore
from adhesion_node.core.physics import braking
from adhesion_node.core.physics.train import CRH3
from adhesion_node.wire import topics
from adhesion_node.wire.line import NOMINAL, Line
from adhesion_node.wire.messages.curves import write_curve
from adhesion_node.wire.messages.refused import Rejected
from adhesion_node.wire.messages.results import Status
from adhesion_node.wire.topic import Frame, Topic

STAMP_NS = 1_700_000_000_123_456_789
CURVE = braking.curve(CRH3, 80.0, 0.07)
MESSAGE = new(TRAJECTORY, **write_curve(new, STAMP_NS, 1e5, CURVE))
ANY = some.floats() | some.floats(-500.0, 500.0) | some.floats(9e4, 6e6)


def numbers(message: Any) -> dict[str, Any]:
    """Every number and text of a message by its path; several together give arrays of (.., k)."""
    found: dict[str, Any] = {}
    for name, value in vars(message).items():
        if name.startswith("__"):
            continue
        if hasattr(value, "__dict__") and not isinstance(value, np.ndarray):
            found |= {f"{name}.{path}": inner for path, inner in numbers(value).items()}
        else:
            found[name] = value
    return found


@pytest.mark.parametrize("kind", ["nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu", "sensor_msgs/msg/NavSatFix"])
@pytest.mark.parametrize("frame", ["", "t", "tr", "tra", "trac"])
def test_every_number_is_that_of_the_library_however_it_is_aligned(kind: str, frame: str) -> None:
    rng = np.random.default_rng(1)
    each = [_filled(kind, rng, frame) for _ in range(5)]
    ours = numbers(together([serialize(message, kind) for message in each], kind))
    for path, values in ours.items():
        theirs = [numbers(message)[path] for message in each]
        assert values == frame if isinstance(values, str) else np.array_equal(values.T, theirs), path


def _filled(kind: Any, rng: np.random.Generator, frame: str) -> Any:
    """A message of random numbers."""
    fields = {}
    defined: Any = typestore().fielddefs[kind][1]
    for name, (node, what) in defined:
        if node.name == "NAME":
            fields[name] = _filled(what, rng, frame)
        elif node.name == "ARRAY":
            fields[name] = rng.normal(size=what[1])
        elif what[0] == "string":
            fields[name] = frame
        else:
            fields[name] = float(rng.normal()) if what[0] == "float64" else int(rng.integers(0, 100))
    return typestore().types[kind](**fields)


def as_one(topic: Topic, messages: list[Any]) -> Any:
    message = together([serialize(each, topic.type) for each in messages], topic.type)
    assert message is not None
    return topic._replace(frame=Frame.ANY).together(message, Line(direction="down"))


def one_by_one(topic: Topic, messages: list[Any]) -> list[Any]:
    """What the codec reads, None where it refuses."""
    found = []
    for message in messages:
        try:
            found.append(topic._replace(frame=Frame.ANY).read(message, Line(direction="down")))
        except Rejected:
            found.append(None)
    return found


@given(some.lists(some.tuples(ANY, ANY, ANY, ANY), min_size=2, max_size=6))
@example([(0.0, 0.0, 0.0, 0.0), (math.nan, 1.0, 1.0, 1.0), (1.0, 200.0, 1e-12, 1.0), (3e9, 1.0, 1.0, 1.0)])
@pytest.mark.parametrize(
    "topic",
    [
        *(topics.STATE, topics.TRUTH_STATE, topics.DECELERATION),
        *(topics.BRAKE_PRESSURE, topics.BRAKE_DEMAND, topics.ODOMETRY),
    ],
)
def test_many_messages_are_read_as_each_is(topic: Topic, rows: list[tuple[float, float, float, float]]) -> None:
    blank = _filled(topic.type, np.random.default_rng(1), "track")
    messages = [_with(blank, topic, row) for row in rows]
    ours, theirs = as_one(topic, messages), one_by_one(topic, messages)
    assert {type(one) for one in theirs} <= {type(ours), type(None)}
    for name in ours._fields:
        expected = [math.nan if one is None and name != "t_ns" else getattr(one, name, ours.t_ns[0]) for one in theirs]
        assert np.array_equal(getattr(ours, name), expected, equal_nan=True), name


def _with(blank: Any, topic: Topic, row: tuple[float, float, float, float]) -> Any:
    if topic in (topics.BRAKE_PRESSURE, topics.BRAKE_DEMAND):
        return replace(blank, fluid_pressure=row[0])
    if topic is topics.DECELERATION:
        along = replace(blank.accel.accel.linear, x=row[0])
        accel = replace(blank.accel, accel=replace(blank.accel.accel, linear=along), covariance=np.full(36, row[1]))
        return replace(blank, accel=accel)
    place, speed = (replace(part, x=x) for part, x in ((blank.pose.pose.position, row[0]), (_linear(blank), row[1])))
    pose = replace(blank.pose, pose=replace(blank.pose.pose, position=place), covariance=np.full(36, row[2]))
    twist = replace(blank.twist, twist=replace(blank.twist.twist, linear=speed), covariance=np.full(36, row[3]))
    return replace(blank, pose=pose, twist=twist)


def _linear(blank: Any) -> Any:
    return blank.twist.twist.linear


def test_records_come_in_their_order_with_what_can_be_read_together() -> None:
    def position(k: int, frame: str = "track", place_m: float = 1.0) -> Record:
        cdr = encode(topics.POSITION, k, (place_m,), 0.25 if k % 3 else 0.0, frame)
        return Record("/train1/position", topics.POSITION.type, cdr, k)

    def pressure(k: int, absolute_pa: float = 2e5) -> Record:
        return Record("brake", topics.BRAKE_PRESSURE.type, encode(topics.BRAKE_PRESSURE, k, (absolute_pa,)), k)

    taken = {"/train1/position": topics.POSITION, "brake": topics.BRAKE_PRESSURE, "speed": topics.SPEED}
    records = [make(k) for k in range(3 * MOST_TOGETHER // 2) for make in (position, pressure)]
    records[10] = Record("speed", topics.SPEED.type, encode(topics.SPEED, 5, (30.0,)), 5)
    records[20:23] = position(10, "map"), pressure(10, 2.0), position(11, place_m=math.nan)
    records[-1] = records[-1]._replace(cdr=records[-1].cdr[:-3])
    read = list(read_together(records, taken, NOMINAL))
    assert [record for record, _ in read] == records
    by_itself = [index for index, (_, sample) in enumerate(read) if sample is None]
    assert by_itself == [10, 20, 21, 22, len(records) - 1], "of no codec for many, elsewhere, refused, refused, cut"
    for record, sample in read:
        assert sample is None or sample == taken[record.topic].read(record.message)
    strange = [position(k, "trick") for k in range(3)]
    assert [sample for _, sample in read_together(strange, taken, NOMINAL)] == [None] * 3


@given(some.lists(some.floats(), min_size=2, max_size=6))
def test_plain_numbers_are_read_as_each_is(values: list[float]) -> None:
    messages = [new(topics.MU.type, data=value) for value in values]
    expected = [math.nan if one is None else one for one in one_by_one(topics.MU, messages)]
    assert np.array_equal(as_one(topics.MU, messages), expected, equal_nan=True)


@pytest.mark.parametrize("frame", ["", "t", "tr", "tra", "trac", "track", "track1", "track12"])
@pytest.mark.parametrize("sign", [1, -1])
def test_curves_are_read_as_each_is_without_those_that_are_refused(frame: str, sign: int) -> None:
    header = replace(MESSAGE.header, frame_id=frame)
    fine = [replace(MESSAGE, header=header, points=[_moved(p, sign, by) for p in MESSAGE.points]) for by in (0.0, 7.0)]
    points = MESSAGE.points
    turned, endless, steep = ([*points[:9], one, *points[10:]] for one in _spoilt(points[9]))
    wrong = [replace(fine[0], points=each) for each in (turned, endless, steep)]
    messages = [fine[0], *wrong, fine[1]]
    ours, theirs = as_one(topics.BRAKING_CURVE, messages), one_by_one(topics.BRAKING_CURVE, messages)
    kept = [one for one in theirs if one is not None]
    assert [one is None for one in theirs] == [False, True, True, True, False]
    assert ours.t_ns.tolist() == [one.t_ns for one in kept]
    assert np.array_equal(ours.places_m, [one.places_m for one in kept])
    assert ours.sign.ravel().tolist() == [one.sign for one in kept] == [-sign, -sign]
    for name in ("distance_m", "speed_mps", "deceleration_mps2", "time_s"):
        assert np.array_equal(getattr(ours.curve, name), [getattr(one.curve, name) for one in kept]), name


def _moved(point: Any, sign: int, by_m: float) -> Any:
    columns = {"positions": sign * point.positions + by_m, "velocities": sign * point.velocities}
    return replace(point, accelerations=sign * point.accelerations, **columns)


def _spoilt(point: Any) -> tuple[Any, Any, Any]:
    """A place behind the one before, no number, a speed at which far too much is lost."""
    return (
        replace(point, positions=np.array([0.0])),
        replace(point, velocities=np.array([math.nan])),
        replace(point, velocities=0.5 * (point.velocities + MESSAGE.points[10].velocities)),
    )


def test_what_differs_in_more_than_numbers_is_left_to_be_read_one_by_one() -> None:
    point, cdr = MESSAGE.points[3], serialize(MESSAGE, TRAJECTORY)
    for points in ([replace(point, velocities=point.velocities[:0])], [replace(point, effort=point.positions)] * 3):
        other = serialize(replace(MESSAGE, points=points), TRAJECTORY)
        assert together([other, other], TRAJECTORY) is None
    for spoilt in (b"", cdr[:-9], b"\0\0" + cdr[2:], cdr[:12] + b"\xff\xff\xff\x7f" + cdr[16:]):
        assert together([spoilt, spoilt], TRAJECTORY) is None
        assert together([cdr, spoilt], TRAJECTORY) is None
    with pytest.raises(ValueError, match="it does not decode as trajectory_msgs/msg/JointTrajectory"):
        deserialize(cdr[:12] + b"\xff\xff\xff\x7f" + cdr[16:], TRAJECTORY)
    one, other = (encode(topics.TRUTH_STATE, STAMP_NS, 1.0, 2.0) for _ in range(2))
    assert together([one, other.replace(b"track", b"trick")], topics.TRUTH_STATE.type) is None
    assert together([encode(topics.DIAGNOSTICS, 1, STATUS)] * 2, DIAGNOSTICS) is None


STATUS = Status("estimator", 1, "μ is late", {"regime": "COASTING", "empty": "", "what": "ärger"}, "train 1")


def test_diagnostics_are_those_of_the_library() -> None:
    cdr = encode(topics.DIAGNOSTICS, STAMP_NS, STATUS)
    two = deserialize(cdr, DIAGNOSTICS)
    two.status.append(replace(two.status[0], name="other", values=[]))
    for each in (cdr, serialize(two, DIAGNOSTICS), serialize(replace(two, status=[]), DIAGNOSTICS)):
        ours = statuses(each)
        assert ours is not None
        assert topics.DIAGNOSTICS.read(ours) == topics.DIAGNOSTICS.read(deserialize(each, DIAGNOSTICS))


@given(some.data())
def test_spoilt_diagnostics_are_refused_where_the_library_does_so(data: some.DataObject) -> None:
    cdr = bytearray(encode(topics.DIAGNOSTICS, STAMP_NS, STATUS))
    at = data.draw(some.integers(0, len(cdr) - 1))
    cdr[at] = data.draw(some.integers(0, 255))
    end = data.draw(some.integers(len(cdr) - 40, len(cdr)))
    spoilt = bytes(cdr[:end])
    ours = statuses(spoilt)
    if ours is not None:
        assert topics.DIAGNOSTICS.read(ours) == topics.DIAGNOSTICS.read(deserialize(spoilt, DIAGNOSTICS))
