# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The points of a trajectory as one array: a day's recording holds ten million, each of which would be six objects."""

from struct import error, unpack_from
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from ..core.physics.train import Array

TYPE = "trajectory_msgs/msg/JointTrajectory"

_NAMES = ("places", "position", "velocities", "velocity", "accelerations", "acceleration", "efforts", "sec", "nanosec")
_KINDS = ("<u4", "<f8", "<u4", "<f8", "<u4", "<f8", "<u4", "<i4", "<u4")


def _point(*offsets: int) -> np.dtype[np.void]:
    """A point of one joint without efforts; before every sequence stands its length."""
    layout: Any = {"names": _NAMES, "formats": _KINDS, "offsets": offsets, "itemsize": offsets[-1] + 4}
    point: np.dtype[np.void] = np.dtype(layout)
    return point


_LATER, _FIRST = _point(0, 4, 12, 20, 28, 36, 44, 48, 52), _point(0, 8, 16, 24, 32, 40, 48, 52, 56)
"""CDR aligns a number at its size: a point that begins at a multiple of 8 is longer by 4, and none that follows is."""


class Trajectory(NamedTuple):
    """As the message, but for its points: position, velocity, acceleration and seconds in rows, shape (n, 4)."""

    header: Any
    joint_names: list[str]
    points: Array


def trajectory(cdr: bytes) -> Trajectory | None:
    """Decode a JointTrajectory whose points have one value of each kind and no effort; None where it is another."""
    try:
        return _decoded(memoryview(cdr)[4:]) if cdr[:2] == b"\0\1" else None
    except (error, ValueError):
        return None


def _decoded(body: memoryview) -> Trajectory | None:
    sec, nanosec = unpack_from("<iI", body)
    frame_id, at = _text(body, 8)
    (count,) = unpack_from("<I", body, at)
    names, at = [], at + 4
    for _ in range(count):
        name, at = _text(body, at)
        names.append(name)
    (count,) = unpack_from("<I", body, at)
    at += 4
    kinds = [(_FIRST, 1), (_LATER, count - 1)] if at % 8 == 0 else [(_LATER, count)]
    rows = []
    for kind, size in kinds:
        points = np.frombuffer(body, kind, size, at)
        at += kind.itemsize * size
        lengths = [points[name] for name in _NAMES[:6:2]]
        if not (np.all(np.array(lengths) == 1) and np.all(points["efforts"] == 0)):
            return None
        seconds = points["sec"] + points["nanosec"] / 1e9
        rows.append(np.stack([points["position"], points["velocity"], points["acceleration"], seconds], axis=1))
    header = SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec), frame_id=frame_id)
    return Trajectory(header, names, np.concatenate(rows))


def _text(body: memoryview, at: int) -> tuple[str, int]:
    """A string and where the next number begins."""
    (size,) = unpack_from("<I", body, at)
    text, end = bytes(body[at + 4 : at + 3 + size]).decode(), at + 4 + size
    return text, end + -end % 4
