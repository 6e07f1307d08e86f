# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Creep force of a braked wheel: Polach's curve with friction that falls with the sliding speed.

    F/Q = mu0 ((1 - A) exp(-B w) + A) (2/pi) (k_A e/(1 + (k_A e)^2) + arctan(k_S e)),    e = (pi/4) K s/mu0

w is the sliding speed v - r omega, s = w/v the creep, Q the load. K is the slope of F/Q at s = 0 by Kalker's linear
theory where k_A = k_S = 1; contaminated rails have smaller k, so a softer contact. Oldrich Polach, "Creep forces in
simulations of traction vehicles running on adhesion limit", Wear 258 (2005) 992-1000, equations 2 to 6 and its table.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from .compiled import formula
from .journey import Array

KALKER_SLOPE = 120.0
"""G a b c11/Q of a wheel of 0.45 m under 7 to 8 t."""

CREEPING_MPS = 0.2
"""Below this speed of the train the creep counts against this one: a quotient of two zeros is none."""

SLIDING = 0.02
"""A group slides beyond the peak of its curve, at the latest from this creep on; one that rolls has a tenth of it."""

CONDITIONS = np.array([0.05, 0.08, 0.15, 0.25])
K_A, K_S = np.array([0.3, 0.3, 0.3, 1.0]), np.array([0.1, 0.1, 0.1, 0.4])
FALL_A, FALL_B = np.array([0.85, 0.5, 0.5, 0.4]), np.array([0.10, 0.15, 0.15, 0.60])
"""The curve's parameters at these mu0: a film of leaves, wet, wet, dry; between them they follow log mu0."""


class Contact(NamedTuple):
    """What the rail offers at some places; equal shapes."""

    mu0: Array
    k_a: Array
    k_s: Array
    fall_a: Array
    fall_b: Array


def contact(mu0: Array) -> Contact:
    """Return the curves of rails of these mu0, any shape."""
    place, nodes = np.log(mu0), np.log(CONDITIONS)
    return Contact(mu0, *(np.interp(place, nodes, values) for values in (K_A, K_S, FALL_A, FALL_B)))


def adhesion(sliding_mps: Array, speed_mps: Array, rail: Contact) -> tuple[Array, Array]:
    """Return F/Q, positive where it brakes the train, and its derivative by the sliding speed, s/m."""
    stretch, tangent, exponent = _arguments(sliding_mps, speed_mps, rail.mu0, rail.k_s, rail.fall_b)
    force, slope = _curve(sliding_mps, stretch, tangent, np.arctan(tangent), np.exp(exponent), *rail)
    return force, slope


@formula("ddddd->ddd")
def _arguments(w: float, v: float, mu0: float, k_s: float, b: float, stretch: Array, y: Array, falls: Array) -> None:
    """What the arc tangent and the exponential are taken of."""
    stretch[0] = np.pi / 4.0 * KALKER_SLOPE / (mu0 * max(v, CREEPING_MPS))
    y[0] = k_s * (stretch[0] * w)
    falls[0] = -b * abs(w)


@formula("dddddddddd->dd")
def _curve(
    w: float,
    stretch: float,
    y: float,
    arc: float,
    falls: float,
    mu0: float,
    k_a: float,
    k_s: float,
    a: float,
    b: float,
    force: Array,
    slope: Array,
) -> None:
    x = k_a * (stretch * w)
    q = 1.0 / (1.0 + x * x)
    shape = x * q + arc
    falling = (1.0 - a) * falls
    friction = falling + a
    rising = stretch * (k_a * (1.0 - x * x) * q * q + k_s / (1.0 + y * y))
    scale = 2.0 / np.pi * mu0
    force[0] = scale * shape * friction
    slope[0] = scale * (rising * friction - np.sign(w) * b * falling * shape)


_CREEPS = np.geomspace(2e-4, 1.0, 400)
_SPEEDS = np.concatenate([[0.0], np.geomspace(0.3, 110.0, 60)])
_LEVELS = np.geomspace(0.005, 1.0, 160)


@cache
def _peaks() -> tuple[Array, Array]:
    """Peak over mu0 and its creep; shape (levels, speeds). Level by level: all at once are ten times the cache."""
    speed = np.maximum(_SPEEDS, CREEPING_MPS)[:, None]
    curves = (adhesion(_CREEPS * speed, speed, contact(level))[0] for level in _LEVELS)
    ratios, creeps = zip(*((curve.max(axis=-1), _CREEPS[curve.argmax(axis=-1)]) for curve in curves), strict=True)
    return np.array(ratios) / _LEVELS[:, None], np.array(creeps)


def peak(speed_mps: Array, rail: Contact) -> tuple[Array, Array]:
    """Return the peak of F/Q and its creep; bilinear in a table over log mu0 and speed, shapes broadcast."""
    level = np.interp(np.log(rail.mu0), np.log(_LEVELS), np.arange(_LEVELS.size))
    speed = np.interp(speed_mps, _SPEEDS, np.arange(_SPEEDS.size))
    i, j = (np.minimum(at.astype(np.intp), size - 2) for at, size in ((level, _LEVELS.size), (speed, _SPEEDS.size)))
    a, b = level - i, speed - j

    def look(table: Array) -> Array:
        low = table[i, j] * (1.0 - b) + table[i, j + 1] * b
        high = table[i + 1, j] * (1.0 - b) + table[i + 1, j + 1] * b
        result: Array = low * (1.0 - a) + high * a
        return result

    ratio, creep = _peaks()
    return rail.mu0 * look(ratio), look(creep)
