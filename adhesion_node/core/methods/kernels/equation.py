# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A window's normal equation: linearised, assembled, factorised and solved, and the searches made of it.

    [ A    c ] [ dx ]   [ b ]
    [ c^T  d ] [ dp ] = [ e ]

of the K + 1 states (position, speed) and of kappa, which all steps share. With x' = f(x, kappa) + w a step about a
trajectory is dx' = [[1, half], [0, kept]] dx + effect (dt/2, 1) dkappa - error. So A couples neighbouring states alone:
three of its diagonals are not 0, and A = L D L^T is found in one pass, together with L^-1 b and L^-1 c.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

if TYPE_CHECKING:
    from ..rail_condition.smoother import KappaSearch

Array = NDArray[np.float64]

GRAVITY = 9.8
DT, APPLIED, PLACE, PLACE_VARIANCE, RATE, RATE_VARIANCE = 0, 1, 2, 3, 4, 5
"""Rows of `Given.window`: step, brake B/(M g), measured position and speed with their variances."""
HALF, KEPT, EFFECT_S, EFFECT, ERROR_S, ERROR, HEADROOM = 0, 1, 2, 3, 4, 5, 6
"""Columns of the steps; the headroom is kappa at which the brake begins to limit, less the present kappa."""
PIVOT, NEAR, FAR, RIGHT, BORDER = 0, 1, 2, 3, 4
"""Rows of an equation: the diagonals of A, then 1/D and L; b and c, then L^-1 b and L^-1 c."""

WEIGHT_TOLERANCE = 1e-2
"""Change of a measurement's weight below which it has converged; what is left moves kappa by far less than sigma."""

BELOW = 0.98
"""Part of the brake's limit at which a search for kappa begins at most: from the limit on no step tells of it."""

LIMIT_TOLERANCE = 1e-3
"""Relative width of the interval in which kappa is known to end at the brake's limit: bisection stops there."""


class Given(NamedTuple):
    """Train, track, the rail's speed law, the measurements, and the belief of (s, v, kappa) before them."""

    rotating: float
    noise_m: float
    """Variances of the process noise per second, of position and speed."""
    noise_mps: float
    tail_dof: float
    """Of the positions' Student t; 0 for Gaussian."""
    resistance: Array
    """Of the speed in m/s: c0, c1, c2, N/N."""
    law: Array
    """floor, gain, offset, scale."""
    breaks: Array
    """Where the track's profile changes, m."""
    levels: Array
    """Its resistance before, between and behind them, N/N."""
    window: Array
    """Shape (6, K)."""
    mean: Array
    covariance: Array


class Solved(NamedTuple):
    """A normal equation, factorised and solved."""

    steps: Array
    """Shape (K, 7)."""
    rows: Array
    """Shape (5, 2K + 2)."""
    moved: Array
    """Gauss-Newton step of the trajectory, shape (2K + 2,)."""
    change: float
    """The same of kappa."""
    information: float
    """d - c^T A^-1 c: what is known of kappa, the states being unknown."""
    decrease: float
    """How far the step lowers -ln p."""
    misfit: float
    """-ln p of trajectory and kappa before the measurements, up to a constant."""
    failed: int
    """Row of A from which on it is not positive definite, from 1; 0: none; -1: it is the belief's covariance."""


@kernel
def _resistance(given: Given, s: float, v: float) -> float:
    section = np.searchsorted(given.breaks, s, side="right")
    c = given.resistance
    return float(c[0] + v * (c[1] + c[2] * v) + given.levels[section])


@kernel
def _law(given: Given, v: float) -> tuple[float, float]:
    """Adhesion of the speed law and its slope, s/m."""
    law, over = given.law, given.law[2] + 3.6 * max(v, 0.0)
    return float(law[3] * (law[0] + law[1] / over)), float(-3.6 * law[3] * law[1] / over**2)


@kernel
def _limit(given: Given, brake: float, resisting: float) -> float:
    """Largest adhesion that the brake uses."""
    return (brake - given.rotating * resisting) / (1.0 + given.rotating)


@kernel
def _weight(given: Given, squared: float) -> float:
    """EM weight of Student's t times its expected information, (dof + 1)/(dof + 3): so the curvature is right, too."""
    dof = given.tail_dof
    return (dof + 1.0) ** 2 / (dof + 3.0) / (dof + squared) if dof > 0.0 else 1.0


@kernel
def _squared(given: Given, trajectory: Array, k: int) -> float:
    off = given.window[PLACE, k] - trajectory[k + 1, 0]
    return float(off**2 / given.window[PLACE_VARIANCE, k])


@kernel
def _precision(given: Given) -> tuple[Array, float]:
    """Inverse of the belief's covariance and half the logarithm of its determinant; NaN where there is none."""
    p, root = given.covariance, np.zeros((3, 3))
    for i in range(3):  # the inverse of its Cholesky factor, row by row
        across = np.zeros(3)
        for j in range(i):
            for m in range(j + 1):
                across[j] += root[j, m] * p[i, m]
        left = p[i, i] - across[0] ** 2 - across[1] ** 2
        root[i, i] = 1.0 / math.sqrt(left) if left > 0.0 else np.nan
        for m in range(i):
            for j in range(m, i):
                root[i, m] -= root[i, i] * across[j] * root[j, m]
    inverse = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for m in range(max(i, j), 3):
                inverse[i, j] += root[m, i] * root[m, j]
    return inverse, -math.log(root[0, 0] * root[1, 1] * root[2, 2])


@kernel
def _linearised(given: Given, trajectory: Array, kappa: float, steps: Array) -> None:
    """Linearise the steps about the trajectory, shape (at least K + 1, 2), at kappa."""
    for k in range(steps.shape[0]):
        s, v, dt = trajectory[k, 0], trajectory[k, 1], given.window[DT, k]
        resisting = _resistance(given, s, v)
        by_speed = given.resistance[1] + 2.0 * given.resistance[2] * v
        adhesion, bends = _law(given, v)
        limit = _limit(given, given.window[APPLIED, k], resisting)
        used = min(kappa * adhesion, limit)
        # while the brake limits, part of the resistance goes into the rotating masses
        slope = kappa * bends + by_speed if used < limit else by_speed / (1.0 + given.rotating)
        slower = v - dt * GRAVITY * (used + resisting)
        kept = 1.0 - dt * GRAVITY * slope
        steps[k, HALF], steps[k, KEPT] = 0.5 * dt * (1.0 + kept), kept
        steps[k, EFFECT] = -dt * GRAVITY * adhesion
        steps[k, EFFECT_S] = 0.5 * dt * steps[k, EFFECT]
        steps[k, ERROR] = trajectory[k + 1, 1] - slower
        steps[k, ERROR_S] = trajectory[k + 1, 0] - s - 0.5 * dt * (v + slower)
        steps[k, HEADROOM] = limit / adhesion - kappa


@kernel
def _assembled(
    given: Given, trajectory: Array, kappa: float, weights: Array, margin: float, steps: Array, rows: Array
) -> tuple[float, float, float]:
    """Fill the rows; return d, e and the misfit. Steps with less headroom than `margin` do not depend on kappa."""
    window = given.window
    precision, _ = _precision(given)
    off = given.mean[0] - trajectory[0, 0], given.mean[1] - trajectory[0, 1], given.mean[2] - kappa
    rows[:] = 0.0
    misfit, push = 0.0, 0.0
    for i in range(3):
        push = precision[i, 0] * off[0] + precision[i, 1] * off[1] + precision[i, 2] * off[2]
        misfit += 0.5 * push * off[i]
        if i < 2:
            rows[PIVOT, i], rows[RIGHT, i], rows[BORDER, i] = precision[i, i], push, precision[2, i]
    rows[NEAR, 1], corner = precision[0, 1], precision[2, 2]
    for k in range(steps.shape[0]):
        s, v, later_s, later_v = 2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 3
        half, kept, effect_s, effect = steps[k, HALF], steps[k, KEPT], steps[k, EFFECT_S], steps[k, EFFECT]
        error_s, error, headroom = steps[k, ERROR_S], steps[k, ERROR], steps[k, HEADROOM]
        sure_s, sure_v = 1.0 / (given.noise_m * window[DT, k]), 1.0 / (given.noise_mps * window[DT, k])
        seen_s, seen_v = weights[k] / window[PLACE_VARIANCE, k], 1.0 / window[RATE_VARIANCE, k]
        force_s, force_v = sure_s * error_s, sure_v * error
        rows[PIVOT, s] += sure_s
        rows[PIVOT, v] += sure_s * half**2 + sure_v * kept**2
        rows[PIVOT, later_s], rows[PIVOT, later_v] = sure_s + seen_s, sure_v + seen_v
        rows[NEAR, v] += sure_s * half
        rows[NEAR, later_s], rows[FAR, later_s], rows[FAR, later_v] = -sure_s * half, -sure_s, -sure_v * kept
        rows[RIGHT, s] += force_s
        rows[RIGHT, v] += half * force_s + kept * force_v
        rows[RIGHT, later_s] = seen_s * (window[PLACE, k] - trajectory[k + 1, 0]) - force_s
        rows[RIGHT, later_v] = seen_v * (window[RATE, k] - trajectory[k + 1, 1]) - force_v
        misfit += 0.5 * (force_s * error_s + force_v * error)
        if headroom > margin:
            rows[BORDER, s] += sure_s * effect_s
            rows[BORDER, v] += half * sure_s * effect_s + kept * sure_v * effect
            rows[BORDER, later_s], rows[BORDER, later_v] = -sure_s * effect_s, -sure_v * effect
            corner += sure_s * effect_s**2 + sure_v * effect**2
            push += effect_s * force_s + effect * force_v
    return corner, push, misfit


@kernel
def _eliminated(rows: Array) -> int:
    """Factorise in place; return the first row that is not positive definite, from 1, or 0."""
    for i in range(rows.shape[1]):
        pivot = rows[PIVOT, i]
        if i > 1:
            far = rows[FAR, i]
            rows[NEAR, i] -= far * rows[NEAR, i - 1]
            rows[FAR, i] *= rows[PIVOT, i - 2]
            pivot -= far * rows[FAR, i]
            rows[RIGHT, i] -= rows[FAR, i] * rows[RIGHT, i - 2]
            rows[BORDER, i] -= rows[FAR, i] * rows[BORDER, i - 2]
        if i > 0:
            near = rows[NEAR, i]
            rows[NEAR, i] *= rows[PIVOT, i - 1]
            pivot -= near * rows[NEAR, i]
            rows[RIGHT, i] -= rows[NEAR, i] * rows[RIGHT, i - 1]
            rows[BORDER, i] -= rows[NEAR, i] * rows[BORDER, i - 1]
        if not pivot > 0.0:
            return i + 1
        rows[PIVOT, i] = 1.0 / pivot
    return 0


@kernel
def _back(rows: Array, half: Array) -> Array:
    """A^-1 b of L^-1 b, shape (2K + 2,)."""
    found: Array = half * rows[PIVOT]
    for i in range(found.size - 2, -1, -1):
        found[i] -= rows[NEAR, i + 1] * found[i + 1]
        if i + 2 < found.size:
            found[i] -= rows[FAR, i + 2] * found[i + 2]
    return found


@kernel
def solved(given: Given, trajectory: Array, kappa: float, weights: Array, margin: float) -> Solved:
    """Linearise, assemble, factorise and solve at a trajectory, shape (at least K + 1, 2), and kappa."""
    count = given.window.shape[1]
    steps, rows = np.empty((count, 7)), np.empty((5, 2 * count + 2))
    _linearised(given, trajectory, kappa, steps)
    corner, push, misfit = _assembled(given, trajectory, kappa, weights, margin, steps, rows)
    failed = _eliminated(rows) if not np.isnan(corner) else -1
    information, gain, drop = corner, push, 0.0
    for i in range(rows.shape[1]):
        by_pivot = rows[PIVOT, i]
        information -= rows[BORDER, i] ** 2 * by_pivot
        gain -= rows[BORDER, i] * rows[RIGHT, i] * by_pivot
        drop += rows[RIGHT, i] ** 2 * by_pivot
    change = gain / information
    moved = _back(rows, rows[RIGHT] - change * rows[BORDER])
    return Solved(steps, rows, moved, change, information, 0.5 * (drop + gain * change), misfit, failed)


@kernel
def _begun(given: Given, kappa: float, near: Array) -> tuple[Array, float]:
    """The trajectory `near` drawn out at constant deceleration, and a kappa that some step can use."""
    window, known = given.window, near.shape[0]
    trajectory = np.empty((window.shape[1] + 1, 2))
    trajectory[:known] = near
    s, v = near[known - 1, 0], near[known - 1, 1]
    resisting, (adhesion, _) = _resistance(given, s, v), _law(given, v)
    kappa = min(kappa, BELOW * _limit(given, window[APPLIED].max(), resisting) / adhesion)
    for k in range(known - 1, window.shape[1]):
        used = min(kappa * adhesion, _limit(given, window[APPLIED, k], resisting))
        slower = v - GRAVITY * window[DT, k] * (used + resisting)
        s += 0.5 * window[DT, k] * (v + slower)
        v = slower
        trajectory[k + 1, 0], trajectory[k + 1, 1] = s, v
    return trajectory, kappa


@kernel
def _reweighted(given: Given, trajectory: Array, weights: Array) -> float:
    """Weigh the measurements by their deviations from the trajectory; return the largest change of a weight."""
    largest = 0.0
    for k in range(weights.size):
        before, weights[k] = weights[k], _weight(given, _squared(given, trajectory, k))
        largest = max(largest, abs(weights[k] - before))
    return largest


@kernel
def smoothed(
    given: Given, search: KappaSearch, near: Array, fresh: bool
) -> tuple[Array, float, Array, Array, int, bool, int]:
    """Trajectory, kappa, weights, headroom, iterations, whether it converged, and `Solved.failed`.

    The search begins where adhesion limits: beyond the brake's limit nothing would pull kappa back. Where it ends at
    that limit, Newton's steps leap to and fro across it; then the interval between them is halved.
    """
    trajectory, kappa = _begun(given, search.start, near)
    weights = np.full(given.window.shape[1], _weight(given, 0.0))
    if not fresh:
        _reweighted(given, trajectory, weights)
    low, high = search.lowest, np.inf
    for iteration in range(search.iterations):
        now = solved(given, trajectory, kappa, weights, 0.0)
        if now.failed != 0:
            return trajectory, kappa, weights, now.steps[:, HEADROOM].copy(), iteration, False, now.failed
        least, most = kappa + now.steps[:, HEADROOM].min(), kappa + now.steps[:, HEADROOM].max()
        if now.change > 0.0:
            low = max(low, kappa)
        elif kappa >= least:
            high = min(high, kappa)
        following = max(kappa + now.change, search.lowest)
        crossing = max(kappa, following) >= least and abs(now.change) > search.tolerance
        if crossing and not low < following < high:
            following = 0.5 * (max(low, min(least, high)) + min(high, max(most, low)))
        trajectory += now.moved.reshape(-1, 2)
        change, kappa = following - kappa, following
        off = _reweighted(given, trajectory, weights)
        if (abs(change) <= search.tolerance or high - low <= LIMIT_TOLERANCE * kappa) and off <= WEIGHT_TOLERANCE:
            return trajectory, kappa, weights, _headroom(given, trajectory, kappa), iteration + 1, True, 0
    return trajectory, kappa, weights, _headroom(given, trajectory, kappa), search.iterations, False, 0


@kernel
def _headroom(given: Given, trajectory: Array, kappa: float) -> Array:
    steps = np.empty((given.window.shape[1], 7))
    _linearised(given, trajectory, kappa, steps)
    return steps[:, HEADROOM].copy()


@kernel
def covariance_at_end(now: Solved) -> Array:
    """Covariance of the last state and kappa, shape (3, 3)."""
    before, last, below = now.rows[PIVOT, -2], now.rows[PIVOT, -1], now.rows[NEAR, -1]
    along = np.ones(3)
    along[1] = -now.rows[BORDER, -1] * last
    along[0] = -now.rows[BORDER, -2] * before - below * along[1]
    covariance = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            covariance[i, j] = along[i] * along[j] / now.information
    covariance[0, 0] += before + below**2 * last
    covariance[0, 1] -= below * last
    covariance[1, 0] -= below * last
    covariance[1, 1] += last
    return covariance


@kernel
def posterior(
    given: Given, trajectory: Array, kappa: float, weights: Array, margin: float
) -> tuple[Array, Array, float, int]:
    """Mean and covariance of the last state and kappa, the window's ln p(y) up to a constant, and `Solved.failed`."""
    now, window, dof = solved(given, trajectory, kappa, weights, margin), given.window, given.tail_dof
    last = window.shape[1]
    mean = np.empty(3)
    mean[0], mean[1] = trajectory[last, 0] + now.moved[-2], trajectory[last, 1] + now.moved[-1]
    mean[2] = kappa + now.change
    misfit = now.misfit - now.decrease
    for k in range(last):
        squared = _squared(given, trajectory, k)
        misfit += 0.5 * (dof + 1.0) * math.log1p(squared / dof) if dof > 0.0 else 0.5 * squared
        misfit += 0.5 * (window[RATE, k] - trajectory[k + 1, 1]) ** 2 / window[RATE_VARIANCE, k]
    spread = 0.5 * (math.log(now.information) - np.log(now.rows[PIVOT]).sum())
    return mean, covariance_at_end(now), -misfit - spread - _precision(given)[1], now.failed


@kernel
def position_variances(now: Solved) -> Array:
    """Variances of the K + 1 smoothed positions, from the last one back: the diagonal of the inverse."""
    near, far, size = now.rows[NEAR], now.rows[FAR], now.moved.size
    along = _back(now.rows, now.rows[BORDER])
    found = np.empty(size // 2)
    one, one_next, next_one = 0.0, 0.0, 0.0  # of the inverse: (i+1, i+1), (i+1, i+2), (i+2, i+2)
    for i in range(size - 1, -1, -1):
        by_next = near[i + 1] if i + 1 < size else 0.0
        by_far = far[i + 2] if i + 2 < size else 0.0
        below = -by_next * one - by_far * one_next
        beyond = -by_next * one_next - by_far * next_one
        own = now.rows[PIVOT, i] - by_next * below - by_far * beyond
        one, one_next, next_one = own, below, one
        if i % 2 == 0:
            found[i // 2] = own + along[i] ** 2 / now.information
    return found
