# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Quantiles of mixtures of Gaussians: of what is used, and of what may be counted on along the way ahead."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

if TYPE_CHECKING:
    from ..layout import Bank
    from ..motion import Use

Array = NDArray[np.float64]

GRAVITY = 9.8
SLOWEST_MPS, LEAST_SLOWING = 1.0, 0.005
"""The way to a standstill is that of a train which is so fast, and slows by so much over g, at least: it stays finite
where a fall outweighs the brake."""
TAIL, STEPS = 8.0, 60
"""Standard deviations beyond which a Gaussian holds nothing, 6e-16 of it; steps to a root at most, as many as halve any
bracket to the last bit."""
STRAIGHT = 1e-3
"""Relative growth below which its mean is taken as straight: exact to a part in 1e7, where the closed form cancels."""
SPEED, MU, ROUGH, GRADE, SIZE = 1, 2, 3, 5, 11


class Ahead(NamedTuple):
    """What changes on the way to a standstill."""

    rough: Array
    """Variance of the roughness of each kind, shape (K,)."""
    fading: Array
    """How fast that fades, per m and per s, shape (K, 2)."""
    drift: Array
    """Relative variance that adhesion gains in 1 s, shape (K,)."""
    growth: Array
    """What it gains in 1 s as is counted on, relative, shape (K,)."""
    grade_m: float
    """Correlation length of the grade."""
    resistance: Array
    """Of the speed in m/s: c0, c1, c2, N/N."""
    grade_error: float
    resistance_error: float
    error: float
    """By how much the way ahead comes to differ, relative."""
    error_m: float
    """Over which way it does."""
    near: float
    """What share of that the mean of any way may differ by, however short it is."""
    laws: Array
    """floor, gain, offset, scale of each law, shape (L, 4)."""
    rise: float
    """Power of what a law promises for lower speeds that is counted on."""
    least: float
    """Adhesion less grade counts as no less."""


class Asked(NamedTuple):
    """Which quantile; where axles roll, what part of what they use is borne if they slide, and what is at least."""

    missed: float
    borne: float
    known: float
    lowest: float
    """What hardly any rail is below: there a quantile counts that is likelier to be missed, ..."""
    likelier: float
    """... so likely."""


@kernel
def _quantile(weight: Array, mean: Array, std: Array, probability: float) -> float:
    """The root of F(x) = p by Halley's steps, far out Newton's, in a bracket that shrinks, halved where one leaves it.

    It is begun at the quantile of the Gaussian with the mixture's moments (Abramowitz and Stegun 26.2.23).
    """
    low, high, whole, centre, spread = np.inf, -np.inf, 0.0, 0.0, 0.0
    for h in range(weight.size):
        low, high = min(low, mean[h] - TAIL * std[h]), max(high, mean[h] + TAIL * std[h])
        whole += weight[h]
        centre += weight[h] * mean[h]
        spread += weight[h] * (mean[h] ** 2 + std[h] ** 2)
    centre /= whole
    tail = math.sqrt(-2.0 * math.log(min(probability, 1.0 - probability)))
    off = tail - (2.515517 + tail * (0.802853 + tail * 0.010328)) / (
        1.0 + tail * (1.432788 + tail * (0.189269 + tail * 0.001308))
    )
    x = centre + math.copysign(off, probability - 0.5) * math.sqrt(max(spread / whole - centre**2, 0.0))
    if not low < x < high:
        x = 0.5 * (low + high)
    for _ in range(STEPS):
        below, density, bend = 0.0, 0.0, 0.0
        for h in range(weight.size):
            z = (x - mean[h]) / std[h]
            if z > TAIL:
                below += weight[h]
            elif z > -TAIL and weight[h] > 0.0:
                below += 0.5 * weight[h] * math.erfc(-z / math.sqrt(2.0))
                each = weight[h] / std[h] * math.exp(-0.5 * z**2)
                density += each
                bend -= each * z / std[h]
        excess = below - probability
        if excess < 0.0:
            low = x
        else:
            high = x
        tail, wanted = (below, probability) if probability < 0.5 else (whole - below, whole - probability)
        per = math.sqrt(2.0 * math.pi) / density if density > 0.0 else np.inf
        if 0.0 < tail < 0.5 * wanted:  # far out the logarithm of the tail is nearly straight, and the tail is not
            step = math.copysign(tail * math.log(tail / wanted) * per, excess)
        else:
            weaker = 1.0 - 0.5 * excess * per * bend / density if density > 0.0 else 1.0
            step = excess * per / (weaker if weaker > 0.5 else 1.0)
        before, x = x, x - step
        if abs(x - before) <= 1e-12:  # it may be an end of the bracket by now
            break
        if not low < x < high:
            x = 0.5 * (low + high)
    return x


@kernel
def quantiles(weights: Array, means: Array, stds: Array, probabilities: Array) -> Array:
    """Of each row of `means` and `stds`, shape (R, H), those of P `probabilities`, shape (R, P)."""
    result = np.empty((means.shape[0], probabilities.size))
    for row in range(means.shape[0]):
        for index in range(probabilities.size):
            result[row, index] = _quantile(weights, means[row], stds[row], probabilities[index])
    return result


@kernel
def _law(laws: Array, law: int, v: float) -> float:
    row = laws[law]
    return float(row[3] * (row[0] + row[1] / (row[2] + max(v, 0.0) * 3.6)))


@kernel
def _mean_ahead(relative: float) -> tuple[float, float]:
    """What stays in the mean over a way of so many correlation lengths, and what share of its variance is added."""
    kept = -math.expm1(-relative) / relative
    return kept, max(2.0 / relative * (1.0 - kept) - kept**2, 0.0)


@kernel
def _grown(relative: float) -> float:
    """Mean along the way to a standstill of what grows by e to that until then."""
    if abs(relative) < STRAIGHT:
        return 1.0 + relative / 3.0
    return 2.0 * (math.expm1(relative) - relative) / relative**2


@kernel
def counted_on(
    rule: Ahead,
    bank: Bank,
    weight: Array,
    used: Use,
    speeds: Array,
    asked: Asked,
) -> Array:
    """Quantile of adhesion and grade ahead at each of some `speeds`, shape as they; the last is the one that is told.

    What is not known of that counts, too: a train that is faster than told needs more adhesion for the same way.

    Adhesion is above 0 and known in proportion: that of its logarithm, with the same mean and variance.
    """
    count, mean, covariance = weight.size, bank.mean, bank.covariance
    middle, std = np.empty((speeds.size, count)), np.empty((speeds.size, count))
    by, told = np.empty(SIZE), max(speeds[-1], SLOWEST_MPS)
    for h in range(count):
        x, u, grade, k = mean[h], used.value[h], mean[h, GRADE], bank.kind[h]
        slope, slides = used.slope[h], used.slides[h]
        speed = max(x[SPEED], SLOWEST_MPS)
        slowing = GRAVITY * max(u + used.resisting[h] + grade, LEAST_SLOWING)
        way_m, time_s = speed**2 / (2.0 * slowing), speed / slowing
        per_mps = 2.0 * slowing / GRAVITY / told  # of the adhesion that a train so much faster needs for the same way
        rough_kept, rough_added = _mean_ahead(way_m * rule.fading[k, 0] + time_s * rule.fading[k, 1])
        grade_kept, grade_added = _mean_ahead(way_m / rule.grade_m)
        by[:] = slope
        by[ROUGH] *= rough_kept
        by[GRADE] = grade_kept
        by[SPEED] -= per_mps
        c = rule.resistance
        basic = c[0] + x[SPEED] * (c[1] + c[2] * x[SPEED])
        variance = (rule.grade_error**2 + (rule.resistance_error * basic) ** 2) * grade_added
        variance += (rule.error * u) ** 2 * (rule.near**2 + _mean_ahead(way_m / rule.error_m)[1])
        for i in range(SIZE):
            if by[i] != 0.0:
                for j in range(SIZE):
                    variance += by[i] * covariance[h, i, j] * by[j]
        if slides:
            variance += x[MU] ** 2 * (rule.rough[k] * rough_added + rule.drift[k] * time_s / 3.0)
        one, rest = math.sqrt(max(variance, 1e-12)), grade * grade_kept
        law, grown = _law(rule.laws, bank.law[h], speed), _grown(rule.growth[k] * time_s)
        level = u - slope[ROUGH] * x[ROUGH] * (1.0 - rough_kept) - per_mps * (x[SPEED] - told)
        for row in range(speeds.size):
            if slides:
                rising = (_law(rule.laws, bank.law[h], speeds[row]) / law) ** rule.rise
                rising *= grown
                foreseen, spread = level * rising + rest, one * rising
            elif asked.borne * u < asked.known:
                foreseen, spread = asked.known, 1e-6
            else:
                foreseen, spread = level + rest + asked.borne * u - u, one
            foreseen = max(foreseen, rule.least)
            square = math.log1p((spread / foreseen) ** 2)  # so much may be taken away, but not all
            middle[row, h], std[row, h] = math.log(foreseen) - 0.5 * square, math.sqrt(square)
    result = np.empty(speeds.size)
    for row in range(speeds.size):
        result[row] = math.exp(_quantile(weight, middle[row], std[row], asked.missed))
        if result[row] < asked.lowest:
            likelier = math.exp(_quantile(weight, middle[row], std[row], asked.likelier))
            result[row] = max(result[row], min(asked.lowest, likelier))
    return result
