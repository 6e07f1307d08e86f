# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Adhesion over creep: the Kiencke curve, its peak and the linear form of it, He et al. 2017, (1)-(7).

Every function works element by element; the parameters theta = (p1, p2) stand in the last axis.
"""

import numpy as np

from ..physics.train import GRAVITY, Array

LEAST = 1e-12
"""Stands for 0 where a curve without a peak would divide by it."""


def creep_speed(wheel_radps: float, speed_mps: float, radius_m: float) -> float:
    """Creep speed v_s = r w - v, m/s (1).

    >>> creep_speed(20.0, 10.0, 0.525)
    0.5
    """
    return radius_m * wheel_radps - speed_mps


def creep(wheel_radps: float, speed_mps: float, radius_m: float) -> float:
    """Creep (r w - v)/v, without unit (2); the speed must not be 0.

    >>> creep(20.0, 10.0, 0.525)
    0.05
    """
    return creep_speed(wheel_radps, speed_mps, radius_m) / speed_mps


def used_adhesion(force_n: float, load_kg: float) -> float:
    """Adhesion F/(M g) in use, without unit (3), of a force at the rim and the mass on its axles.

    >>> round(used_adhesion(24_500.0, 25_000.0), 9)
    0.1
    """
    return force_n / (load_kg * GRAVITY)


def adhesion(creeps: Array, slope: float, theta: Array) -> Array:
    """Kiencke's curve mu = mu0 l/(1 + p1 l + p2 l^2) (4); `theta` has shape (..., 2).

    >>> float(adhesion(np.array(0.1), 20.0, np.array([80.0, 100.0])))
    0.2
    """
    return np.asarray(slope * creeps / (1.0 + theta[..., 0] * creeps + theta[..., 1] * creeps**2))


def peak(slope: float, theta: Array) -> tuple[Array, Array]:
    """Peak (5): mu_max = mu0/(p1 + 2 sqrt p2) and its creep l_m = 1/sqrt p2; huge where the curve has none.

    >>> [round(float(value), 4) for value in peak(20.0, np.array([80.0, 100.0]))]
    [0.2, 0.1]
    """
    root = np.sqrt(np.maximum(theta[..., 1], 0.0))
    return slope / np.maximum(theta[..., 0] + 2.0 * root, LEAST), 1.0 / np.maximum(root, LEAST)


def parameters(slope: float, mu_max: float, lambda_m: float) -> Array:
    """theta of the curve with a given peak, (5) solved; ValueError when no curve rises to it from `slope`.

    >>> [round(float(value), 2) for value in parameters(20.0, 0.35, 0.1)]
    [37.14, 100.0]
    """
    theta = np.array([slope / mu_max - 2.0 / lambda_m, 1.0 / lambda_m**2])
    if theta[0] < 0.0:
        most = slope * lambda_m / 2.0
        raise ValueError(f"mu_max = {mu_max:g}: with slope {slope:g} and lambda_m {lambda_m:g} give at most {most:g}")
    return theta


def peak_jacobian(slope: float, theta: Array) -> Array:
    """Derivatives of (mu_max, l_m) by (p1, p2), shape (..., 2, 2), for the delta method."""
    root = np.sqrt(np.maximum(theta[..., 1], LEAST**2))
    by_p1 = -slope / np.maximum(theta[..., 0] + 2.0 * root, LEAST) ** 2
    rows = np.stack([by_p1, by_p1 / root, np.zeros_like(root), -0.5 / root**3], axis=-1)
    return rows.reshape(*rows.shape[:-1], 2, 2)


def regression(creeps: Array, adhesions: Array, slope: float) -> Array:
    """(Z, U1, U2) of the linear form (6), (7): Z = mu0 l - mu = p1 mu l + p2 mu l^2 + noise; shape (..., 3).

    >>> regression(np.array(0.1), np.array(0.2), 20.0).round(6).tolist()
    [1.8, 0.02, 0.002]
    """
    return np.stack([slope * creeps - adhesions, adhesions * creeps, adhesions * creeps**2], axis=-1)


def noise_products(creeps: Array, adhesions: Array, slope: float, creep_var: Array, adhesion_var: Array) -> Array:
    """What noise adds to the products y y^T of y = (Z, U1, U2) on average, shape (..., 3, 3); to second order.

    By derivatives, E[y y^T] - y y^T = y_m y_m^T s_m^2 + (y_l y_l^T + (y y_ll^T + y_ll y^T)/2) s_l^2. It does not
    average out: the plain least squares of (9) is biased by it, whichever of the two is noisy.
    """
    row, zero = regression(creeps, adhesions, slope), np.zeros_like(creeps)
    by_adhesion = np.stack([zero - 1.0, creeps, creeps**2], axis=-1)
    by_creep = np.stack([zero + slope, adhesions, 2.0 * adhesions * creeps], axis=-1)
    mixed = row[..., :, None] * np.stack([zero, zero, 2.0 * adhesions], axis=-1)[..., None, :]
    bent = _square(by_creep) + 0.5 * (mixed + np.swapaxes(mixed, -1, -2))
    return np.asarray(_square(by_adhesion) * adhesion_var[..., None, None] + bent * creep_var[..., None, None])


def _square(row: Array) -> Array:
    return np.asarray(row[..., :, None] * row[..., None, :])
