# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The braking curves of a run, thinned while it is read: a day's would fill the memory, and a page shows hundreds."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from ...core.physics.braking import BrakingCurve
from ...core.physics.train import Array
from .series import Series, Times

MOST_CURVES = 8192
"""Curves that are kept: all of the first hour; of a longer run evenly spread ones, half as many at least."""


class Curve(NamedTuple):
    """A predicted braking: at which places, m along the track, the train has which speeds, m/s; arrays of (n,)."""

    t_ns: int
    position_m: Array
    speed_mps: Array

    @property
    def braking(self) -> BrakingCurve:
        """The curve from its first place, constant in its deceleration from point to point."""
        way, speed = np.abs(self.position_m - self.position_m[0]), self.speed_mps
        slowing = (speed[:-1] ** 2 - speed[1:] ** 2) / (2.0 * np.maximum(np.diff(way), 1e-6))
        times = np.concatenate(([0.0], np.cumsum(2.0 * np.diff(way) / np.maximum(speed[:-1] + speed[1:], 1e-6))))
        return BrakingCurve(way, speed, np.append(slowing, slowing[-1]), times)


def distances_to(target_mps: float, position_m: Array, speed_mps: Array) -> Array:
    """Distances, m, from the starts of curves, of (..., n), to where the train has the target speed; shape (...).

    0 where it is slower.

    >>> distances_to(5.0, np.array([100.0, 200.0, 260.0]), np.array([[20.0, 10.0, 0.0], [4.0, 2.0, 0.0]])).tolist()
    [130.0, 0.0]
    """
    before = np.clip((speed_mps >= target_mps).sum(axis=-1, keepdims=True) - 1, 0, speed_mps.shape[-1] - 2)
    columns = np.broadcast_arrays(position_m, speed_mps)
    (here, fast), (there, slow) = (
        tuple(np.take_along_axis(column, at, axis=-1)[..., 0] for column in columns) for at in (before, before + 1)
    )
    share = np.where(fast > slow, (fast - target_mps) / np.where(fast > slow, fast - slow, 1.0), fast >= target_mps)
    share = np.clip(share, 0.0, 1.0)
    return np.asarray(np.abs(here + share * (there - here) - position_m[..., 0]))


class Curves:
    """Braking curves, at most one for each estimate; of all of them the distances to some `targets`, m/s, are kept."""

    def __init__(self, targets: Iterable[float] = ()) -> None:
        self._kept: list[Curve] = []
        self._t_ns, self._lengths = array("q"), {target: array("d") for target in targets}
        self._stride = 1

    def add(self, t_ns: Times, position_m: Array, speed_mps: Array) -> None:
        """Take curves, of (k,) and (k, n)."""
        for target, lengths in self._lengths.items():
            lengths.frombytes(distances_to(target, position_m, speed_mps).tobytes())
        for stamp, *curve in zip(t_ns.tolist(), position_m, speed_mps, strict=True):
            if len(self._t_ns) % self._stride == 0:
                self._kept.append(Curve(stamp, *(column.copy() for column in curve)))
            self._t_ns.append(stamp)
            if len(self._kept) > MOST_CURVES:
                self._stride *= 2
                self._kept = self._kept[::2]

    @property
    def kept(self) -> list[Curve]:
        """Those that are kept, by their times."""
        return sorted(self._kept, key=attrgetter("t_ns"))

    def lengths(self, target_mps: float) -> Series:
        """Distance, m, to the target speed by their times; of another target than was asked for by those kept alone."""
        if target_mps in self._lengths:
            t_ns, found = np.array(self._t_ns, dtype=np.int64), np.array(self._lengths[target_mps])
        else:
            t_ns = np.array([curve.t_ns for curve in self._kept], dtype=np.int64)
            found = np.array([float(distances_to(target_mps, *curve[1:])) for curve in self._kept])
        order = np.argsort(t_ns, kind="stable")
        return Series(t_ns[order], found[order])
