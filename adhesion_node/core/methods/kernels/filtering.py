# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Particle filter of a window of K steps with N particles.

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
