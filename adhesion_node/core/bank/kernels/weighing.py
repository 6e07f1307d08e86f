# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is seen, its evidence, and the probabilities of the hypotheses."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

Array = NDArray[np.float64]
Labels = NDArray[np.intp]
Mask = NDArray[np.bool_]

POSITION, OFFSET, SIZE = 0, 6, 11


@kernel
def total(log_weight: Array) -> float:
    """ln of the sum of the weights."""
    most = -np.inf
    for each in log_weight:
        most = max(most, each)
    if not np.isfinite(most):
        return most
    sum_over = 0.0
    for each in log_weight:
        sum_over += math.exp(each - most)
    return most + math.log(sum_over)


@kernel
def normalised(log_weight: Array, least: float) -> Array:
    """With weights that sum to 1; each was at least `least`, a logarithm, before."""
    result = log_weight - total(log_weight)
    if least > -np.inf:
        for h in range(result.size):
            result[h] = max(result[h], least)
        result -= total(result)
    return result


@kernel
def changing(
    log_weight: Array, changed_s: Array, kind: Labels, slides: Mask, after_s: float, passing: int, held: int
) -> tuple[float, float, float]:
    """Probabilities that the rail has changed, by what `passing` and `held` say as well; of `passing`; of sliding."""
    changed, passes, sliding = 0.0, 0.0, 0.0
    for h in range(kind.size):
        weight = math.exp(log_weight[h])
        if kind[h] == passing:
            passes += weight
        if slides[kind[h]]:
            sliding += weight
        if kind[h] == passing or kind[h] == held or changed_s[h] > after_s:
            changed += weight
    return changed, passes, sliding


@kernel
def borne_out(
    log_weight: Array, age_s: Array, kind: Labels, after_s: float, likely: float, passing: int, border: float
) -> Array:
    """Weights of those alone that are as old as `after_s`, or `likely`; of all, where none is or the young prevail.

    What says `passing` counts by its age only where all of it together is more probable than `border`.
    """
    passes, young = 0.0, 0.0
    for h in range(kind.size):
        passes += math.exp(log_weight[h]) if kind[h] == passing else 0.0
        young += math.exp(log_weight[h]) if age_s[h] < after_s else 0.0
    kept = np.full(kind.size, -np.inf)
    for h in range(kind.size):
        old = (age_s[h] >= after_s or young > 0.5) and (kind[h] != passing or passes > border)
        if old or math.exp(log_weight[h]) > likely:
            kept[h] = log_weight[h]
    return normalised(kept, -np.inf) if kept.max() > -np.inf else log_weight


@kernel
def is_sound(mean: Array, covariance: Array, log_weight: Array) -> bool:
    """Whether every number is finite and no variance below 0."""
    for h in range(log_weight.size):
        if not np.isfinite(log_weight[h]):
            return False
        sum_over = 0.0  # of a number that is not finite 0 times it is NaN
        for i in range(SIZE):
            sum_over += 0.0 * mean[h, i]
            if covariance[h, i, i] < 0.0:
                return False
            for j in range(SIZE):
                sum_over += 0.0 * covariance[h, i, j]
        if sum_over != 0.0:
            return False
    return True


@kernel
def variances(slope: Array, covariance: Array) -> Array:
    """h P h^T of each hypothesis, shape (H,)."""
    result = np.zeros(slope.shape[0])
    for h in range(result.size):
        for i in range(SIZE):
            if slope[h, i] != 0.0:
                for j in range(SIZE):
                    result[h] += slope[h, i] * covariance[h, i, j] * slope[h, j]
    return result


@kernel
def _taken_in(
    before: tuple[Array, Array, float],
    innovation: float,
    gain: Array,
    spread: float,
    clipped: float,
    after: tuple[Array, Array],
) -> float:
    """Write mean and covariance of one hypothesis behind Kalman's correction, beyond `clipped` deviations Huber's.

    `gain` is P h, `spread` the variance of the `innovation`. Returns the logarithm of its weight times the evidence.
    """
    (mean, covariance, log_weight), (means, covariances) = before, after
    off = abs(innovation) / math.sqrt(spread)
    lost = 0.5 * off**2 if off <= clipped else clipped * off - 0.5 * clipped**2
    weaker = 1.0 / (spread * max(off / clipped, 1.0))
    for i in range(SIZE):
        pull = gain[i] * weaker
        means[i] = mean[i] + pull * innovation
        for j in range(SIZE):
            covariances[i, j] = covariance[i, j] - pull * gain[j]
    return log_weight - 0.5 * math.log(spread) - lost


@kernel
def corrected(
    mean: Array, covariance: Array, log_weight: Array, innovation: Array, slope: Array, variance: Array, clipped: float
) -> tuple[Array, Array, Array]:
    """Kalman's correction and the logarithm of the evidence; beyond `clipped` deviations Huber's."""
    means, covariances, weights = np.empty_like(mean), np.empty_like(covariance), np.empty_like(log_weight)
    gain = np.empty(SIZE)
    for h in range(log_weight.size):
        gain[:] = 0.0
        for j in range(SIZE):
            by = slope[h, j]
            if by != 0.0:
                for i in range(SIZE):
                    gain[i] += covariance[h, j, i] * by
        spread = variance[h]
        for i in range(SIZE):
            spread += gain[i] * slope[h, i]
        before, after = (mean[h], covariance[h], log_weight[h]), (means[h], covariances[h])
        weights[h] = _taken_in(before, innovation[h], gain, spread, clipped, after)
    return means, covariances, weights


@kernel
def placed(
    mean: Array,
    covariance: Array,
    log_weight: Array,
    noise: Labels,
    white: Array,
    position_m: float,
    clipped: float,
) -> tuple[Array, Array, Array, float]:
    """`corrected` by a position, of which place and slow error are seen, its weights normalised; ln of their sum.

    `white` is the variance, m^2, of the rest of its error, by the hypothesis' label `noise`.
    """
    means, covariances, weights = np.empty_like(mean), np.empty_like(covariance), np.empty_like(log_weight)
    gain = np.empty(SIZE)
    for h in range(log_weight.size):
        p, innovation = covariance[h], position_m - (mean[h, POSITION] + mean[h, OFFSET])
        for i in range(SIZE):
            gain[i] = p[POSITION, i] + p[OFFSET, i]
        spread = white[noise[h]] + gain[POSITION] + gain[OFFSET]
        before, after = (mean[h], p, log_weight[h]), (means[h], covariances[h])
        weights[h] = _taken_in(before, innovation, gain, spread, clipped, after)
    whole = total(weights)
    return means, covariances, weights - whole, whole
