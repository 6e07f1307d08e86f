# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Maximum likelihood with noise on the creep as well as on the adhesion (errors in variables).

The paper's least squares takes the creep as exact. A speed sensor's noise on it bends the fitted curve, and more data
do not help. Here every true creep l_i is unknown too:

    minimise  sum (m_i - mu(l_i))^2 / s_mu^2 + (c_i - l_i)^2 / s_l^2   over p1, p2 and all l_i

For given p1, p2 each l_i is found alone, so that only two parameters are left for the outer search.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ...core.creep.curve import adhesion
from ...core.physics.train import Array

NEWTON_STEPS = 8
"""Steps by which a measured creep is moved onto the curve; each gains the square of the last one's accuracy."""


class NoiseStd(NamedTuple):
    """Standard deviations of the measured creep and adhesion."""

    creep: float
    adhesion: float


class Fit(NamedTuple):
    """Result of the search: theta = (p1, p2), shape (2,), its covariance, shape (2, 2), and whether it converged."""

    theta: Array
    covariance: Array
    converged: bool


def fit(creeps: Array, adhesions: Array, slope: float, start: Array, noise: NoiseStd) -> Fit:
    """Fit the curve to measured creeps and adhesions of shape (n,), from `start`; p1 and p2 stay positive.

    Raises ValueError when a standard deviation is not above 0 or there are fewer than three samples.
    """
    if not (noise.creep > 0.0 and noise.adhesion > 0.0) or creeps.size < 3:
        raise ValueError(f"noise = {noise}, samples = {creeps.size}: give standard deviations above 0, 3 samples")
    # The logarithm keeps both positive and brings them to one scale.
    solved = least_squares(
        lambda logs: _distances(creeps, adhesions, slope, np.exp(logs), noise),
        np.log(start),
        jac=lambda logs: _jacobian(creeps, adhesions, slope, np.exp(logs), noise),
        method="lm",
        xtol=1e-12,
        ftol=1e-12,
    )
    theta = np.exp(solved.x)
    information = solved.jac.T @ solved.jac
    return Fit(theta, np.linalg.inv(information) * np.outer(theta, theta), bool(solved.success))


def true_creeps(creeps: Array, adhesions: Array, slope: float, theta: Array, noise: NoiseStd) -> Array:
    """The likeliest true creep of every sample, given the curve: Gauss-Newton steps of (s_mu, s_l) distance."""
    ratio = (noise.creep / noise.adhesion) ** 2
    moved = np.maximum(creeps, 0.0)
    for _ in range(NEWTON_STEPS):
        steep = _steepness(moved, slope, theta)
        away = adhesions - adhesion(moved, slope, theta) - steep * (creeps - moved)
        moved = np.maximum(creeps + ratio * steep * away / (1.0 + ratio * steep**2), 0.0)
    return moved


def _distances(creeps: Array, adhesions: Array, slope: float, theta: Array, noise: NoiseStd) -> Array:
    """Signed distance of every sample to the curve in standard deviations."""
    near = true_creeps(creeps, adhesions, slope, theta, noise)
    away = (adhesions - adhesion(near, slope, theta)) / noise.adhesion
    return np.asarray(np.copysign(np.hypot(away, (creeps - near) / noise.creep), away))


def _jacobian(creeps: Array, adhesions: Array, slope: float, theta: Array, noise: NoiseStd) -> Array:
    """Derivatives of the distances by the logarithms of p1 and p2; at the nearest point only the curve moves."""
    near = true_creeps(creeps, adhesions, slope, theta, noise)
    spread = np.hypot(noise.adhesion, _steepness(near, slope, theta) * noise.creep)
    by_bottom = adhesion(near, slope, theta) ** 2 / (slope * np.maximum(near, 1e-12)) / spread
    return np.stack([by_bottom * near * theta[0], by_bottom * near**2 * theta[1]], axis=-1)


def _steepness(creeps: Array, slope: float, theta: Array) -> Array:
    """Derivative of the curve by the creep."""
    bottom = 1.0 + theta[0] * creeps + theta[1] * creeps**2
    return np.asarray(slope * (1.0 - theta[1] * creeps**2) / bottom**2)
