# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A trajectory whose points are decoded as one array is the one that the library decodes."""

from __future__ import annotations

from dataclasses import replace

import pytest

from adhesion_node.bag.trajectory import TYPE, trajectory
from adhesion_node.bag.types import deserialize, new, serialize
from adhesion_node.core.physics import braking
from adhesion_node.core.physics.train import CRH3
from adhesion_node.wire.codecs import NOMINAL
from adhesion_node.wire.curves import read_curve, write_curve

CURVE = braking.curve(CRH3, 80.0, 0.07)
MESSAGE = new(TYPE, **write_curve(new, 1_700_000_000_123_456_789, 1e5, CURVE))


@pytest.mark.parametrize("frame", ["", "t", "tr", "tra", "trac", "track", "track1", "track12"])
@pytest.mark.parametrize("joints", [["train"], ["a", "bcd"], []])
def test_it_is_what_the_library_decodes_however_it_is_aligned(frame: str, joints: list[str]) -> None:
    header = replace(MESSAGE.header, frame_id=frame)
    cdr = serialize(replace(MESSAGE, header=header, joint_names=joints), TYPE)
    ours, theirs = trajectory(cdr), deserialize(cdr, TYPE)
    assert ours is not None
    assert (ours.joint_names, ours.header.frame_id) == (theirs.joint_names, frame)
    assert (ours.header.stamp.sec, ours.header.stamp.nanosec) == (theirs.header.stamp.sec, theirs.header.stamp.nanosec)
    times = (each.time_from_start for each in theirs.points)
    assert ours.points[:, 3].tolist() == [time.sec + time.nanosec / 1e9 for time in times]
    for column, name in enumerate(("positions", "velocities", "accelerations")):
        assert ours.points[:, column].tolist() == [getattr(each, name)[0] for each in theirs.points]


def test_a_curve_is_the_same_by_either_way() -> None:
    ours, theirs = (read_curve(each, NOMINAL) for each in (trajectory(serialize(MESSAGE, TYPE)), MESSAGE))
    assert ours.t_ns == theirs.t_ns
    assert ours.places_m.tolist() == theirs.places_m.tolist()
    assert ours.curve.speed_mps.tolist() == theirs.curve.speed_mps.tolist()
    assert ours.curve.time_s.tolist() == theirs.curve.time_s.tolist()


def test_another_trajectory_is_left_to_the_library() -> None:
    point = MESSAGE.points[3]
    for points in ([replace(point, velocities=point.velocities[:0])], [replace(point, effort=point.positions)] * 3):
        assert trajectory(serialize(replace(MESSAGE, points=points), TYPE)) is None
    cdr = serialize(MESSAGE, TYPE)
    for spoilt in (b"", cdr[:-9], b"\0\0" + cdr[2:], cdr[:12] + b"\xff\xff\xff\x7f" + cdr[16:]):
        assert trajectory(spoilt) is None
