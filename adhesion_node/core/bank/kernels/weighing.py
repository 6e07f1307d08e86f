# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What is seen, its evidence, and the probabilities of the hypotheses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

if TYPE_CHECKING:
    from ..layout import Bank

Array = NDArray[np.float64]
Labels = NDArray[np.intp]

SPEED, MU, SIZE = 1, 2, 10


class Pruning(NamedTuple):
    """What hypotheses are left."""

    least: float
    """ln of the weight below which one ends."""
    most: int
    near: float
    """Part of the standard deviations by which those that say the same may differ."""
    factor: float
    """By which their standard deviations may."""


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
def normalised(log_weight: Array) -> Array:
    """With weights that sum to 1."""
    return log_weight - total(log_weight)


@kernel
def moments(log_weight: Array, mean: Array, covariance: Array) -> tuple[Array, Array]:
    """Mean and covariance of the mixture."""
    weight = np.exp(log_weight - total(log_weight))
    centre, spread = np.zeros(SIZE), np.zeros((SIZE, SIZE))
    for h in range(weight.size):
        for i in range(SIZE):
            centre[i] += weight[h] * mean[h, i]
    for h in range(weight.size):
        for i in range(SIZE):
            for j in range(SIZE):
                apart = (mean[h, i] - centre[i]) * (mean[h, j] - centre[j])
                spread[i, j] += weight[h] * (covariance[h, i, j] + apart)
    return centre, spread


@kernel
def is_sound(mean: Array, covariance: Array, log_weight: Array) -> bool:
    """Whether every number is finite and no variance below 0."""
    for h in range(log_weight.size):
        if not np.isfinite(log_weight[h]):
            return False
        for i in range(SIZE):
            if not np.isfinite(mean[h, i]) or covariance[h, i, i] < 0.0:
                return False
            for j in range(SIZE):
                if not np.isfinite(covariance[h, i, j]):
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
def corrected(
    bank: Bank, innovation: Array, slope: Array, variance: Array, clipped: float
) -> tuple[Array, Array, Array]:
    """Kalman's correction and the logarithm of the evidence; beyond `clipped` deviations Huber's."""
    mean, covariance, log_weight = bank.mean, bank.covariance, bank.log_weight
    means, covariances, weights = np.empty_like(mean), np.empty_like(covariance), np.empty_like(log_weight)
    gain = np.empty(SIZE)
    for h in range(log_weight.size):
        spread = variance[h]
        for i in range(SIZE):
            gain[i] = 0.0
            for j in range(SIZE):
                gain[i] += covariance[h, i, j] * slope[h, j]
            spread += gain[i] * slope[h, i]
        off = abs(innovation[h]) / math.sqrt(spread)
        lost = 0.5 * off**2 if off <= clipped else clipped * off - 0.5 * clipped**2
        weights[h] = log_weight[h] - 0.5 * math.log(spread) - lost
        weaker = 1.0 / (spread * max(off / clipped, 1.0))
        for i in range(SIZE):
            pull = gain[i] * weaker
            means[h, i] = mean[h, i] + pull * innovation[h]
            for j in range(SIZE):
                covariances[h, i, j] = covariance[h, i, j] - pull * gain[j]
    return means, covariances, weights


@kernel
def _order(log_weight: Array) -> Labels:
    """Indices by falling weight; of equal ones the first first."""
    order = np.empty(log_weight.size, dtype=np.intp)
    for h in range(order.size):
        place = h
        while place > 0 and log_weight[order[place - 1]] < log_weight[h]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = h
    return order


@kernel
def _alike(bank: Bank, one: int, other: int, rule: Pruning) -> bool:
    """Whether two hypotheses have one label, and the same speed and adhesion but for parts of their deviations."""
    if bank.noise[one] != bank.noise[other] or bank.law[one] != bank.law[other] or bank.kind[one] != bank.kind[other]:
        return False
    for i in (MU, SPEED):
        std = math.sqrt(bank.covariance[one, i, i])
        ratio = math.sqrt(bank.covariance[other, i, i]) / std
        apart = abs(bank.mean[other, i] - bank.mean[one, i])
        if not (apart < rule.near * std + 1e-9 and 1.0 / rule.factor < ratio < rule.factor):
            return False
    return True


@kernel
def pruned(bank: Bank, rule: Pruning) -> tuple[Labels, Array, Array, Array]:
    """Which hypotheses stand for those that are left, and their means, covariances and weights."""
    mean, covariance, log_weight = bank.mean, bank.covariance, bank.log_weight
    whole = total(log_weight[log_weight > rule.least])
    order = _order(log_weight)
    while order.size and not log_weight[order[-1]] > rule.least:
        order = order[:-1]
    left = order.size
    kept, means = np.empty(left, dtype=np.intp), np.empty((left, SIZE))
    covariances, weights = np.empty((left, SIZE, SIZE)), np.empty(left)
    gone = np.zeros(left, dtype=np.bool_)
    count = 0
    for first in range(left):
        if gone[first]:
            continue
        one = order[first]
        group = np.empty(left - first, dtype=np.intp)
        group[0], size = one, 1
        for index in range(first + 1, left):
            h = order[index]
            if not gone[index] and _alike(bank, one, h, rule):
                group[size], gone[index] = h, True
                size += 1
        kept[count], weights[count] = one, log_weight[one] - whole
        means[count], covariances[count] = mean[one], covariance[one]
        if size > 1:
            group = group[:size]
            weights[count] = total(log_weight[group]) - whole
            means[count], covariances[count] = moments(log_weight[group], mean[group], covariance[group])
        count += 1
    kept, means, covariances, weights = kept[:count], means[:count], covariances[:count], weights[:count]
    if count > rule.most:
        best = np.sort(_order(weights)[: rule.most])
        kept, means, covariances, weights = kept[best], means[best], covariances[best], weights[best]
    return kept, means, covariances, weights - total(weights)
