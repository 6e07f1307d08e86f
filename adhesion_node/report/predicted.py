# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The braking curves of a run, thinned while it is read: a day's would fill the memory, and a page shows hundreds."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ..core.physics.braking import BrakingCurve
from ..core.physics.train import Array
from .series import Series

MOST_CURVES = 8192
"""Curves that are kept: all of the first hour; of a longer run evenly spread ones, half as many at least."""


class Curve(NamedTuple):
    """A predicted braking: at which places, m along the track, the train has which speeds, m/s; arrays of (n,)."""

    t_ns: int
    position_m: Array
    speed_mps: Array

    def distance_to(self, target_mps: float) -> float:
        """Distance, m, from the start of the curve to where the train has the target speed; 0 where it is slower."""
        return abs(float(np.interp(-target_mps, -self.speed_mps, self.position_m) - self.position_m[0]))

    @property
    def braking(self) -> BrakingCurve:
        """The curve from its first place, constant in its deceleration from point to point."""
        way, speed = np.abs(self.position_m - self.position_m[0]), self.speed_mps
        slowing = (speed[:-1] ** 2 - speed[1:] ** 2) / (2.0 * np.maximum(np.diff(way), 1e-6))
        times = np.concatenate(([0.0], np.cumsum(2.0 * np.diff(way) / np.maximum(speed[:-1] + speed[1:], 1e-6))))
        return BrakingCurve(way, speed, np.append(slowing, slowing[-1]), times)


class Curves:
    """Braking curves, at most one for each estimate; of all of them the distances to some `targets`, m/s, are kept."""

    def __init__(self, targets: Iterable[float] = ()) -> None:
        self.kept: list[Curve] = []
        self._t_ns, self._lengths = array("q"), {target: array("d") for target in targets}
        self._stride = 1

    def add(self, curve: Curve) -> None:
        """Take a curve."""
        for target, lengths in self._lengths.items():
            lengths.append(curve.distance_to(target))
        if len(self._t_ns) % self._stride == 0:
            self.kept.append(curve)
        self._t_ns.append(curve.t_ns)
        if len(self.kept) > MOST_CURVES:
            self._stride *= 2
            self.kept = self.kept[::2]

    def lengths(self, target_mps: float) -> Series:
        """Distance, m, to the target speed by their times; of another target than was asked for by those kept alone."""
        if target_mps in self._lengths:
            t_ns, found = np.array(self._t_ns, dtype=np.int64), np.array(self._lengths[target_mps])
        else:
            t_ns = np.array([curve.t_ns for curve in self.kept], dtype=np.int64)
            found = np.array([curve.distance_to(target_mps) for curve in self.kept])
        order = np.argsort(t_ns, kind="stable")
        return Series(t_ns[order], found[order])
