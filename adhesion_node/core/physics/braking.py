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

import numpy as np

from .adhesion import AdhesionLaw
from .train import Array, Train

POINTS = 64
"""Points of a curve: enough for linear interpolation to 0.1 %, few enough for a message."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_GRID, _HALF = np.linspace(1.0, 0.0, POINTS), 0.5 / (POINTS - 1)
_EVERY = np.concatenate((_GRID, ((_GRID[:-1] + _GRID[1:])[:, None] / 2 + _HALF * _NODES).ravel()))
"""Of the speed that is lost: the points of a curve, and behind them the nodes between two of them."""


@dataclass(frozen=True, slots=True)
class BrakingCurve:
    """Arrays of one length, from the present (distance 0, time 0) to the target speed."""

    distance_m: Array
    speed_mps: Array
    deceleration_mps2: Array
    time_s: Array


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
    if not callable(mu):
        _require(mu=mu)
    lost = max(speed_mps - target_mps, 0.0)
    every = target_mps + lost * _EVERY
    found = _deceleration(train, every, mu, grade)
    weakest = float(np.minimum.reduce(found))  # what found.min() calls
    if not weakest > 0.0:
        raise ValueError(f"braking curve: deceleration {weakest:.4g} m/s^2 at grade {grade:g}: the train does not slow")
    inner, slowing = every[POINTS:].reshape(-1, _NODES.size), found[POINTS:].reshape(-1, _NODES.size)
    weights = _HALF * lost * _WEIGHTS
    return BrakingCurve(
        distance_m=_cumulate(inner / slowing @ weights),
        speed_mps=every[:POINTS],
        deceleration_mps2=found[:POINTS],
        time_s=_cumulate(1.0 / slowing @ weights),
    )


def distance_to(braking: BrakingCurve, target_mps: float) -> float:
    """Distance, m, along the curve to where the train reaches `target_mps` (0 when already slower)."""
    return float(np.interp(-target_mps, -braking.speed_mps, braking.distance_m))


def _deceleration(train: Train, speed: Array, mu: float | AdhesionLaw, grade: float) -> Array:
    adhesion = mu(speed) if callable(mu) else mu
    full_brake = train.specific_brake(train.full_pressure_pa)
    return train.deceleration(adhesion, full_brake, train.specific_resistance(speed) + grade)


def _cumulate(steps: Array) -> Array:
    sums = np.zeros(steps.size + 1)
    np.add.accumulate(steps, out=sums[1:])  # what np.cumsum calls
    return sums


def _require(**values: float) -> None:
    for name, value in values.items():
        if not math.isfinite(value) or value < 0:
            raise ValueError(f"braking curve {name} = {value!r}: give a finite number of at least 0")
