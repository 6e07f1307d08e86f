# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What EM expects of smoothed particles, in sums over the steps of a window, and by Kalman's recursion its information.

Indices are in the order (component, time, particle).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

if TYPE_CHECKING:
    from .filtering import Given, Particles

Array = NDArray[np.float64]

GRAVITY = 9.8
DT, APPLIED, PLACE, PLACE_VARIANCE, RATE, RATE_VARIANCE = 0, 1, 2, 3, 4, 5
"""Rows of `Given.window`, as in `equation`."""


@kernel
def _resistance(given: Given, s: float, v: float) -> float:
    section = np.searchsorted(given.breaks, s, side="right")
    c = given.resistance
    return float(c[0] + v * (c[1] + c[2] * v) + given.levels[section])


@kernel
def _limit(given: Given, k: int, resisting: float) -> float:
    """Largest adhesion that the brake uses in a step."""
    return float((given.window[APPLIED, k] - given.rotating * resisting) / (1.0 + given.rotating))


@kernel
def reduced(given: Given, mu: float, particles: Particles, marginal: Array) -> Array:
    """The statistics of I2 (26), filtered at `mu`: adhesion used, its information and limit in each step, (3, K).

    I2 is quadratic in the step's deviations and these are sums of a term in x_t and a term in x_t+1, so the
    double sum over pairs collapses to the marginal weights (K + 1, N). As the particles' steps used
    min(mu, limit), what the smoother adds to it is what they missed.
    """
    states, stepped, _ = particles
    found = np.empty((3, stepped.shape[1]))
    for k in range(stepped.shape[1]):
        missed_s, missed_v, used, resisting = 0.0, 0.0, 0.0, 0.0
        for i in range(stepped.shape[2]):
            before, after = marginal[k, i], marginal[k + 1, i]
            missed_s += stepped[0, k, i] * before - states[0, k + 1, i] * after
            missed_v += stepped[1, k, i] * before - states[1, k + 1, i] * after
            own = _resistance(given, states[0, k, i], states[1, k, i])
            used += min(mu, _limit(given, k, own)) * before
            resisting += own * before
        dt = given.window[DT, k]
        by_s, by_v = GRAVITY * 0.5 * dt**2 / given.spread[0, k] ** 2, GRAVITY * dt / given.spread[1, k] ** 2
        weight = GRAVITY * (0.5 * dt**2 * by_s + dt * by_v)
        found[0, k], found[1, k] = used + (by_s * missed_s + by_v * missed_v) / weight, weight
        found[2, k] = _limit(given, k, resisting)
    return found


@kernel
def expected(given: Given, mu: float, particles: Particles, marginal: Array) -> tuple[Array, float]:
    """The `reduced` statistics, and the observed information at `mu`, or at their largest limit where that is less."""
    found = reduced(given, mu, particles, marginal)
    return found, tracked(given, min(mu, found[2].max()))[3]


@kernel
def tracked(given: Given, mu: float) -> tuple[Array, Array, Array, float]:
    """Extended Kalman filter at an adhesion: means, covariances, and what is known of the adhesion itself.

    Shapes (K, 2), (K, 2, 2); derivative of the last mean with respect to mu, (2,); observed information on mu: the
    innovations' derivatives squared and divided by their variances, exact while adhesion limits.
    """
    window, count = given.window, given.window.shape[1]
    means, covariances = np.empty((count, 2)), np.empty((count, 2, 2))
    mean, p, sensitivity, information = given.mean.copy(), given.covariance.copy(), np.zeros(2), 0.0
    for k in range(count):
        dt, resisting = window[DT, k], _resistance(given, mean[0], mean[1])
        limit, by_speed = _limit(given, k, resisting), given.resistance[1] + 2.0 * given.resistance[2] * mean[1]
        brake_limits = limit < mu
        kept = 1.0 - dt * GRAVITY * (by_speed / (1.0 + given.rotating) if brake_limits else by_speed)
        half, pushed = 0.5 * dt * (1.0 + kept), 0.0 if brake_limits else -GRAVITY * dt
        sensitivity[0] += half * sensitivity[1] + 0.5 * dt * pushed
        sensitivity[1] = kept * sensitivity[1] + pushed
        slower = mean[1] - dt * GRAVITY * (min(mu, limit) + resisting)
        mean[0], mean[1] = mean[0] + 0.5 * dt * (mean[1] + slower), slower
        p[0, 0] += half * (p[0, 1] + p[1, 0] + half * p[1, 1]) + given.spread[0, k] ** 2
        p[0, 1] = p[1, 0] = kept * (p[0, 1] + half * p[1, 1])
        p[1, 1] = kept**2 * p[1, 1] + given.spread[1, k] ** 2
        for index in range(2):
            variance = window[PLACE_VARIANCE + 2 * index, k]
            if np.isfinite(variance):
                total, off = p[index, index] + variance, window[PLACE + 2 * index, k] - mean[index]
                gain, felt = (p[0, index] / total, p[1, index] / total), sensitivity[index]
                information += felt**2 / total
                for c in range(2):
                    sensitivity[c] -= gain[c] * felt
                    mean[c] += gain[c] * off
                _joseph(p, gain, index, variance)
        means[k], covariances[k] = mean, p
    return means, covariances, sensitivity, information


@kernel
def _joseph(p: Array, gain: tuple[float, float], index: int, variance: float) -> None:
    """Covariance after a measurement: stays symmetric and positive however small its variance is."""
    by_s, by_v = 1.0 - index, float(index)
    kept = (1.0 - gain[0] * by_s, -gain[0] * by_v), (-gain[1] * by_s, 1.0 - gain[1] * by_v)
    a, b, c = p[0, 0], p[0, 1], p[1, 1]
    for i in range(2):
        for j in range(2):
            first, second = kept[i][0] * a + kept[i][1] * b, kept[i][0] * b + kept[i][1] * c
            p[i, j] = first * kept[j][0] + second * kept[j][1] + variance * gain[i] * gain[j]
