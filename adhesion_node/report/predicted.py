# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The braking curves of a run, those of a day too: kept by their points in single precision, 1 mm in 10 km."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import NamedTuple, overload

import numpy as np

from ..core.physics.braking import BrakingCurve
from ..core.physics.train import Array
from .series import Series, Times


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


class Curves(Sequence[Curve]):
    """Braking curves, at most one for each estimate, in the order in which they were added."""

    def __init__(self) -> None:
        self._t_ns, self._ends, self._start_m = array("q"), array("q", [0]), array("d")
        self._way_m, self._speed_mps = array("f"), array("f")

    def add(self, t_ns: int, position_m: Array, speed_mps: Array) -> None:
        """Take a curve."""
        self._t_ns.append(t_ns)
        self._start_m.append(float(position_m[0]))
        self._way_m.frombytes((position_m - position_m[0]).astype(np.float32).tobytes())
        self._speed_mps.frombytes(speed_mps.astype(np.float32).tobytes())
        self._ends.append(len(self._way_m))

    def __len__(self) -> int:
        return len(self._t_ns)

    @overload
    def __getitem__(self, index: int) -> Curve: ...

    @overload
    def __getitem__(self, index: slice) -> list[Curve]: ...

    def __getitem__(self, index: int | slice) -> Curve | list[Curve]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        at = range(len(self))[index]
        part = slice(self._ends[at], self._ends[at + 1])
        way, speed = np.array([self._way_m[part], self._speed_mps[part]], dtype=np.float64)
        return Curve(self._t_ns[at], self._start_m[at] + way, speed)

    def by_time(self, t_ns: Times) -> dict[int, Curve]:
        """Those of these times."""
        places = {known: index for index, known in enumerate(self._t_ns)}
        return {t: self[places[t]] for t in t_ns.tolist() if t in places}

    def lengths(self, target_mps: float) -> Series:
        """Distance, m, from the start of every curve to where the train has the target speed; 0 where it is slower."""
        if not len(self):
            return Series(np.array([], dtype=np.int64), np.array([]))
        way, speed = (np.frombuffer(part, dtype=np.float32) for part in (self._way_m, self._speed_mps))
        ends = np.array(self._ends)
        starts, last = ends[:-1], ends[1:] - 1
        beyond = np.minimum(starts + np.add.reduceat(speed > target_mps, starts), last)  # the first that is not faster
        before = np.maximum(beyond - 1, starts)
        slower = speed[before] - speed[beyond]
        part = np.clip((speed[before] - target_mps) / np.where(slower > 0.0, slower, np.inf), 0.0, 1.0)
        reached = np.abs(way[before] + part * (way[beyond] - way[before]).astype(np.float64))
        order = np.argsort(t_ns := np.array(self._t_ns, dtype=np.int64), kind="stable")
        return Series(t_ns[order], reached[order])
