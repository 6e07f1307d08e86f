# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Braking curve: distance, time and deceleration from a speed down to a target speed.

A train that decelerates by a(v) covers ds = v dv / a(v) in dt = dv / a(v), so the curve is two integrals over
speed: exact quadrature on a speed grid, no time stepping.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .adhesion import AdhesionLaw
from .train import Array, Train

POINTS = 64
"""Points of a curve: enough for linear interpolation to 0.1 %, few enough for a message."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_GRID, _HALF = np.linspace(1.0, 0.0, POINTS), 0.5 / (POINTS - 1)
_EVERY = np.concatenate((_GRID, ((_GRID[:-1] + _GRID[1:])[:, None] / 2 + _HALF * _NODES).ravel()))
"""Of the speed that is lost: the points of a curve, and behind them the nodes between two of them."""
_ONES = np.ones((2, POINTS - 1, _NODES.size))


@dataclass(frozen=True, slots=True)
class BrakingCurve:
    """Arrays of one length, from the present (distance 0, time 0) to the target speed."""

    distance_m: Array
    speed_mps: Array
    deceleration_mps2: Array
    time_s: Array


class Slowdown(NamedTuple):
    """What all braking curves of a train from one speed to another have in common."""

    train: Train
    speed_mps: Array
    """Of the points of a curve, and behind them of the nodes between two of them."""
    resistance: Array
    """R/(M g) at these speeds, N/N, the grade's part included."""
    integrands: Array
    """v and 1 at the nodes, which over the deceleration give way and time: shape (2, points - 1, nodes)."""
    weights: Array
    grade: float

    def curve(self, mu: float | AdhesionLaw) -> BrakingCurve:
        """The curve that adhesion `mu` limits; raises ValueError where it is no adhesion, or the train not slowed."""
        if not callable(mu):
            _require(mu=mu)
        train, adhesion = self.train, mu(self.speed_mps) if callable(mu) else mu
        found = train.deceleration(adhesion, train.full_brake, self.resistance)
        weakest = float(np.minimum.reduce(found))  # what found.min() calls
        if not weakest > 0.0:
            slowing = f"deceleration {weakest:.4g} m/s^2 at grade {self.grade:g}"
            raise ValueError(f"braking curve: {slowing}: the train does not slow")
        sums = np.zeros((2, POINTS))
        steps = self.integrands / found[POINTS:].reshape(-1, _NODES.size) @ self.weights
        np.add.accumulate(steps, axis=1, out=sums[:, 1:])  # what np.cumsum calls
        return BrakingCurve(sums[0], self.speed_mps[:POINTS], found[:POINTS], sums[1])


def slowdown(train: Train, speed_mps: float, target_mps: float = 0.0, grade: float = 0.0) -> Slowdown:
    """A train that slows down to a target speed; arguments as those of `curve`, which checks them."""
    lost = max(speed_mps - target_mps, 0.0)
    every = target_mps + lost * _EVERY
    integrands = _ONES.copy()
    integrands[0] = every[POINTS:].reshape(-1, _NODES.size)
    return Slowdown(train, every, train.specific_resistance(every) + grade, integrands, _HALF * lost * _WEIGHTS, grade)


def curve(
    train: Train, speed_mps: float, mu: float | AdhesionLaw, target_mps: float = 0.0, grade: float = 0.0
) -> BrakingCurve:
    """Braking curve of a full brake limited by adhesion `mu`, a number or a function of speed in m/s.

    `grade` is the rise over run (positive uphill). The running resistance of (6) brakes as well; the brake is
    taken as built up. A train at or below the target speed has a curve of length 0. Raises ValueError when an
    argument is not finite or negative, or when the train would not slow down (a grade that outweighs the brake).
    """
    _require(speed_mps=speed_mps, target_mps=target_mps)
    if not math.isfinite(grade):
        raise ValueError(f"braking curve grade = {grade!r}: give a finite rise over run")
    return slowdown(train, speed_mps, target_mps, grade).curve(mu)


def _require(**values: float) -> None:
    for name, value in values.items():
        if not math.isfinite(value) or value < 0:
            raise ValueError(f"braking curve {name} = {value!r}: give a finite number of at least 0")
