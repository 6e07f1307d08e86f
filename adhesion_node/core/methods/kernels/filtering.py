# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Filters of a window of K steps, by N particles and by Kalman's recursion, and what EM makes of smoothed particles.

Indices are in the order (component, time, particle).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

GRAVITY = 9.8
DT, APPLIED, PLACE, PLACE_VARIANCE, RATE, RATE_VARIANCE = 0, 1, 2, 3, 4, 5
"""Rows of `Given.window`, as in `equation`."""

BITS, WHOLE, LN2 = 1.4426950408889634, 6755399441055744.0, (6.93147180369123816490e-01, 1.90821492927058770002e-10)
"""1/ln 2; what moves the whole part of a number into its last bits; ln 2 in two parts."""

LEAST = -300.0
"""Logarithm of the least weight that is told apart."""


class Given(NamedTuple):
    """Train, track, the law of the first state, and what was measured."""

    rotating: float
    resistance: Array
    """Of the speed in m/s: c0, c1, c2, N/N."""
    breaks: Array
    """Where the track's profile changes, m."""
    levels: Array
    """Its resistance before, between and behind them, N/N."""
    mean: Array
    covariance: Array
    root: Array
    """Its Cholesky factor, lower."""
    window: Array
    """Shape (6, K)."""
    spread: Array
    """Standard deviations of the process noise, shape (2, K)."""


class Draws(NamedTuple):
    """Random numbers of a pass: of the process noise, (2, K, N), to resample by, (K,), of the first states, (N, 2)."""

    normal: Array
    uniform: Array
    start: Array


class Particles(NamedTuple):
    """The filter's particles and what the smoother takes of them."""

    states: Array
    """Positions and speeds, (2, K + 1, N)."""
    stepped: Array
    """Where the noise-free step leads those of the times 0..K-1, (2, K, N)."""
    log_weights: Array
    """(K + 1, N), the greatest of each time 0."""


@kernel
def _resistance(given: Given, s: float, v: float) -> float:
    section = 0
    while section < given.breaks.size and s >= given.breaks[section]:
        section += 1
    c = given.resistance
    return float(c[0] + v * (c[1] + c[2] * v) + given.levels[section])


@kernel
def _limit(given: Given, k: int, resisting: float) -> float:
    """Largest adhesion that the brake uses in a step."""
    return float((given.window[APPLIED, k] - given.rotating * resisting) / (1.0 + given.rotating))


@kernel
def _exp(x: float) -> float:
    """exp(x) for -700 < x < 700, to 1e-14: 2^k by the bits of a number, the rest by Taylor's series; no branch."""
    moved = x * BITS + WHOLE
    k = moved - WHOLE
    r = x - k * LN2[0] - k * LN2[1]
    series = 1.0 / 3628800.0 + r * (1.0 / 39916800.0)
    series = 1.0 / 40320.0 + r * (1.0 / 362880.0 + r * series)
    series = 1.0 / 720.0 + r * (1.0 / 5040.0 + r * series)
    series = 1.0 / 24.0 + r * (1.0 / 120.0 + r * series)
    series = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * series)))
    bits = np.float64(series).view(np.int64) + (np.float64(moved).view(np.int64) << 52)
    return float(np.int64(bits).view(np.float64))


@kernel
def systematic(weights: Array, offset: float) -> Indices:
    """Systematic resampling by relative weights, (N,): the particles on which the numbers (j + offset)/N fall."""
    count, upto, done, total = weights.size, 0.0, 0, weights.sum()
    parents = np.empty(count, dtype=np.int64)
    for i in range(count):
        upto += weights[i]
        reached = upto * (count / total) + (1.0 - offset)  # so many of the N numbers, rounded down
        last = count if i == count - 1 else min(int(reached), count)
        while done < last:
            parents[done] = i
            done += 1
    return parents


@kernel
def filtered(given: Given, mu: float, draws: Draws, particles: Particles) -> tuple[float, float]:
    """Fill the particles; return ln p(y_1:K) (14)(15) up to the measurements' constants, and the smallest ESS."""
    states, stepped, logs = particles
    window, count, (normal, uniform, start) = given.window, logs.shape[1], draws
    c0, c1, c2 = given.resistance[0], given.resistance[1], given.resistance[2]
    for i in range(count):
        for c in range(2):
            states[c, 0, i] = given.mean[c] + start[i, 0] * given.root[c, 0] + start[i, 1] * given.root[c, 1]
    logs[0] = 0.0
    weights, parents = np.ones(count), np.empty(0, np.int64)
    total, square, log_likelihood, ess = float(count), float(count), 0.0, float(count)
    for k in range(window.shape[1]):
        dt, unresisted = window[DT, k], _limit(given, k, 0.0)
        by_resistance = _limit(given, k, 1.0) - unresisted
        stepped[0, k] = given.levels[0]
        for section in range(given.breaks.size):
            begins, level = given.breaks[section], given.levels[section + 1]
            for i in range(count):
                stepped[0, k, i] = level if states[0, k, i] >= begins else stepped[0, k, i]
        for i in range(count):
            v = states[1, k, i]
            resisting = c0 + v * (c1 + c2 * v) + stepped[0, k, i]
            slower = v - dt * GRAVITY * (min(mu, unresisted + by_resistance * resisting) + resisting)
            stepped[0, k, i], stepped[1, k, i] = states[0, k, i] + 0.5 * dt * (v + slower), slower
        poor = total * total < 0.5 * count * square
        if poor:
            parents = systematic(weights, uniform[k])
            log_likelihood += math.log(total / count)
        by_place, by_rate = -0.5 / window[PLACE_VARIANCE, k], -0.5 / window[RATE_VARIANCE, k]
        kept, place, rate = 0.0 if poor else 1.0, window[PLACE, k], window[RATE, k]
        spread_s, spread_v = given.spread[0, k], given.spread[1, k]
        for i in range(count):
            parent = parents[i] if poor else i
            s = spread_s * normal[0, k, i] + stepped[0, k, parent]
            v = spread_v * normal[1, k, i] + stepped[1, k, parent]
            states[0, k + 1, i], states[1, k + 1, i], off_s, off_v = s, v, place - s, rate - v
            logs[k + 1, i] = kept * logs[k, i] + by_place * off_s * off_s + by_rate * off_v * off_v
        top = logs[k + 1].max()
        log_likelihood += top
        for i in range(count):
            logs[k + 1, i] -= top
            weights[i] = _exp(max(logs[k + 1, i], LEAST))
        total, square = 0.0, 0.0
        for i in range(count):
            total += weights[i]
            square += weights[i] ** 2
        ess = min(ess, total**2 / square)
    return log_likelihood + math.log(total / count), ess


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
def maximised(found: Array, lowest: float) -> tuple[float, float]:
    """Adhesion of at least `lowest` that maximises Q, of `reduced` statistics, exact, also at kinks; the largest limit.

    Between two neighbouring limits Q is a parabola; beyond the largest limit it is flat, so the answer never
    exceeds that limit: "at least this much adhesion".
    """
    order = np.argsort(found[2])
    weights, weighted, squares, kept = 0.0, 0.0, 0.0, 0.0
    for k in range(found.shape[1]):
        weights += found[1, k]
        weighted += found[1, k] * found[0, k]
        squares += found[1, k] * found[0, k] ** 2
    best, mu, least = np.inf, lowest, lowest
    for k in order:  # with the lower limits below mu, the further steps are active and the others keep their limit
        used, weight, limit = found[0, k], found[1, k], max(found[2, k], lowest)
        tried = min(max(weighted / weights, least), limit)
        loss = kept + squares - tried * (2.0 * weighted - tried * weights)
        if loss < best:
            best, mu = loss, tried
        kept, least = kept + weight * (limit - used) ** 2, limit
        weights, weighted, squares = weights - weight, weighted - weight * used, squares - weight * used**2
    return mu, found[2, order[-1]]


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
