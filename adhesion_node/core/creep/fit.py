# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Recursive least squares of the linear form with forgetting, He et al. 2017, (8)-(13).

With y = (Z, U1, U2) the sum over the data of w y y^T holds all of (10) and (12): its lower right block is H, its first
column below Z is f without the paper's factor -2. Minimising (11), J = 1/2 x^T 2H x - 2 f^T x, is solving H x = f.
All arrays may have leading axes, one entry per run.
"""

from typing import NamedTuple

import numpy as np

from ..physics.train import Array

SINGULAR = 1e-12
"""Determinant, relative to the product of the diagonal, below which H counts as of rank 1."""

DFP_ITERATIONS = 20
"""At most; on a parabola with exact steps two suffice, the rest is for rounding."""

DFP_TOLERANCE = 1e-13
"""The iteration stops when the gradient is so small against its terms."""


class Sums(NamedTuple):
    """What the recursion keeps of the data."""

    second: Array
    """Sum of w y y^T, shape (..., 3, 3)."""
    fourth: Array
    """Sum of w^2 (y y^T) x (U U^T), shape (..., 3, 3, 2, 2): the spread of the residuals, for the covariance."""
    weight: Array
    """Sum of w, shape (...): how many samples are remembered."""

    @property
    def hessian(self) -> Array:
        """H of (12), shape (..., 2, 2)."""
        return self.second[..., 1:, 1:]

    @property
    def target(self) -> Array:
        """f of (12) divided by -2, shape (..., 2)."""
        return self.second[..., 1:, 0]


def nothing(shape: tuple[int, ...] = ()) -> Sums:
    """Sums before the first sample; `shape` is that of the runs."""
    return Sums(np.zeros((*shape, 3, 3)), np.zeros((*shape, 3, 3, 2, 2)), np.zeros(shape))


def add(sums: Sums, row: Array, forgetting: Array, noise: Array | float = 0.0) -> Sums:
    """Take in one row y of shape (..., 3); what was known is worth `forgetting` of what it was (12).

    `noise`, shape (..., 3, 3), is what noise adds to y y^T on average and is taken off; the paper has none of it.
    """
    square = row[..., :, None] * row[..., None, :]
    eta = forgetting[..., None, None]
    fourth = square[..., :, :, None, None] * square[..., None, None, 1:, 1:]
    return Sums(
        eta * sums.second + square - noise,
        (eta**2)[..., None, None] * sums.fourth + fourth,
        forgetting * sums.weight + 1.0,
    )


def solve_exact(hessian: Array, target: Array, start: Array) -> Array:
    """The minimum in closed form; where the data span only one direction, the minimum nearest to `start`."""
    a, b, d = hessian[..., 0, 0], hessian[..., 0, 1], hessian[..., 1, 1]
    determinant = a * d - b * b
    regular = (determinant > SINGULAR * a * d) & (a > 0.0)
    det = np.where(regular, determinant, 1.0)
    u, v = target[..., 0], target[..., 1]
    solved = np.stack([(d * u - b * v) / det, (a * v - b * u) / det], axis=-1)
    # Rank 1: H = (a + d) e e^T, and the pseudo-inverse of the missing part is one step along e.
    missing = target - np.einsum("...ij,...j->...i", hessian, start)
    trace = np.where(a + d > 0.0, a + d, 1.0)
    return np.where(regular[..., None], solved, start + missing / trace[..., None])


def solve_dfp(hessian: Array, target: Array, start: Array) -> Array:
    """The minimum by the quasi-Newton iteration of Davidon, Fletcher and Powell, steps 3-6, from `start`.

    The paper prints p p^T/(p^T p) in the correction of the matrix; p p^T/(p^T q) is meant. For two parameters it is
    all the same: after an exact step p^T g = 0, and the second step ends in the minimum.
    """
    x = np.broadcast_to(start, target.shape).astype(np.float64)
    inverse = np.broadcast_to(np.eye(2), (*target.shape[:-1], 2, 2))
    gradient = 2.0 * (_times(hessian, x) - target)
    for _ in range(DFP_ITERATIONS):
        scale = 2.0 * (_times(np.abs(hessian), np.abs(x)) + np.abs(target))
        unfinished = np.asarray((np.abs(gradient) > DFP_TOLERANCE * scale).any(axis=-1))
        if not unfinished.any():
            break
        direction = -_times(inverse, gradient)
        curved = 2.0 * _dot(direction, _times(hessian, direction))
        unfinished &= curved > 0.0
        length = np.where(unfinished, -_dot(gradient, direction) / np.where(curved > 0.0, curved, 1.0), 0.0)
        step = length[..., None] * direction
        x = x + step
        following = 2.0 * (_times(hessian, x) - target)
        inverse = _corrected(inverse, step, following - gradient)
        gradient = following
    return x


def keep_positive(hessian: Array, target: Array, theta: Array) -> Array:
    """The minimum with p1 >= 0 and p2 >= 0: a curve that rises no steeper than mu0 l and has a peak or none."""
    own = np.diagonal(hessian, axis1=-2, axis2=-1)
    alone = np.where(own > 0.0, np.maximum(target, 0.0) / np.where(own > 0.0, own, 1.0), np.maximum(theta, 0.0))
    none = np.zeros_like(alone[..., 0])
    first, second = np.stack([alone[..., 0], none], -1), np.stack([none, alone[..., 1]], -1)
    better = _objective(hessian, target, first) <= _objective(hessian, target, second)
    edge = np.where(better[..., None], first, second)
    return np.where((theta >= 0.0).all(axis=-1, keepdims=True), theta, edge)


def covariance(sums: Sums, theta: Array) -> Array:
    """Covariance of theta, shape (..., 2, 2): H^-1 G H^-1 with G = sum of w^2 r^2 U U^T, r the residual at theta.

    It holds whether the noise is even in Z, as (7) has it, or in mu, where it grows in Z with 1 + p1 l + p2 l^2.
    The factor n/(n - 2) makes up for the two parameters. Infinite where H is singular.
    """
    hessian = sums.hessian
    contrast = np.concatenate([np.ones_like(theta[..., :1]), -theta], axis=-1)
    spread = np.einsum("...i,...j,...ijkl->...kl", contrast, contrast, sums.fourth)
    a, b, d = hessian[..., 0, 0], hessian[..., 0, 1], hessian[..., 1, 1]
    determinant = a * d - b * b
    regular = (determinant > SINGULAR * a * d) & (a > 0.0) & (sums.weight > 3.0)
    det = np.where(regular, determinant, 1.0)
    inverse = np.stack([d, -b, -b, a], axis=-1).reshape(hessian.shape) / det[..., None, None]
    freedom = sums.weight / np.maximum(sums.weight - 2.0, 1.0)
    product = inverse @ spread @ inverse
    unknown = np.diag([np.inf, np.inf])
    return np.where(regular[..., None, None], freedom[..., None, None] * product, unknown)


def forgetting_factor(error: Array, gain: float, most: float, least: float) -> Array:
    """Forgetting factor eta = max(eta_max - K_p abs(error), eta_min) of an error of mu (13).

    >>> [float(forgetting_factor(np.array(e), 0.1, 1.0, 0.971)) for e in (0.0, 0.1, -1.0)]
    [1.0, 0.99, 0.971]
    """
    return np.maximum(most - gain * np.abs(error), least)


def _corrected(inverse: Array, step: Array, change: Array) -> Array:
    """The matrix of step 6: M + p p^T/(p^T q) - M q q^T M/(q^T M q); unchanged where nothing moved."""
    pushed = _times(inverse, change)
    pq, qmq = _dot(step, change), _dot(change, pushed)
    moved = (pq > 0.0) & (qmq > 0.0)
    pq, qmq = np.where(moved, pq, 1.0), np.where(moved, qmq, 1.0)
    gained = step[..., :, None] * step[..., None, :] / pq[..., None, None]
    lost = pushed[..., :, None] * pushed[..., None, :] / qmq[..., None, None]
    return np.where(moved[..., None, None], inverse + gained - lost, inverse)


def _objective(hessian: Array, target: Array, x: Array) -> Array:
    return _dot(x, _times(hessian, x) - 2.0 * target)


def _times(matrix: Array, vector: Array) -> Array:
    return np.asarray(np.einsum("...ij,...j->...i", matrix, vector))


def _dot(one: Array, other: Array) -> Array:
    return np.asarray(np.einsum("...i,...i->...", one, other))
