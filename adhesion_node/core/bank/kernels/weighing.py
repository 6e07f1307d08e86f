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

EQUAL = 1e-9
"""Logarithms of weights that differ by less are equal: rounding shall not choose between twins of another law."""


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
def _total(log_weight: Array) -> float:
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
    return log_weight - _total(log_weight)


@kernel
def _united(weight: Array, mean: Array, covariance: Array, group: Labels, centre: Array, spread: Array) -> float:
    """Write mean and covariance of a mixture of some hypotheses; return their weight."""
    whole = 0.0
    for h in group:
        whole += weight[h]
    centre[:] = 0.0
    spread[:] = 0.0
    for h in group:
        for i in range(SIZE):
            centre[i] += weight[h] / whole * mean[h, i]
    for h in group:
        for i in range(SIZE):
            for j in range(SIZE):
                apart = (mean[h, i] - centre[i]) * (mean[h, j] - centre[j])
                spread[i, j] += weight[h] / whole * (covariance[h, i, j] + apart)
    return whole


@kernel
def moments(log_weight: Array, mean: Array, covariance: Array) -> tuple[Array, Array]:
    """Mean and covariance of the mixture."""
    centre, spread = np.empty(SIZE), np.empty((SIZE, SIZE))
    weight = np.exp(log_weight - _total(log_weight))
    _united(weight, mean, covariance, np.arange(weight.size), centre, spread)
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
    """Indices by falling weight; of those that are equal but for rounding the first first."""
    order = np.empty(log_weight.size, dtype=np.intp)
    for h in range(order.size):
        place = h
        while place > 0 and log_weight[order[place - 1]] < log_weight[h] - EQUAL:
            order[place] = order[place - 1]
            place -= 1
        order[place] = h
    return order


@kernel
def pruned(bank: Bank, rule: Pruning) -> tuple[Labels, Array, Array, Array]:
    """Which hypotheses stand for those that are left, and their means, covariances and weights."""
    mean, covariance, log_weight = bank.mean, bank.covariance, bank.log_weight
    count = log_weight.size
    order, label = _order(log_weight), (bank.noise * 64 + bank.law) * 64 + bank.kind
    centre, std, weight = np.empty((count, 2)), np.empty((count, 2)), np.empty(count)
    for h in range(count):
        weight[h] = math.exp(log_weight[h]) if log_weight[h] > rule.least else 0.0
        for part, i in enumerate((MU, SPEED)):
            centre[h, part], std[h, part] = mean[h, i], math.sqrt(covariance[h, i, i])
    left, group = 0, np.empty(count, dtype=np.intp)
    kept, means, sums = np.empty(count, dtype=np.intp), np.empty((count, SIZE)), np.empty(count)
    covariances = np.empty((count, SIZE, SIZE))
    gone = weight == 0.0
    for first in range(count):
        one = order[first]
        if gone[one]:
            continue
        size = 0
        for index in range(first, count):
            h = order[index]
            if gone[h] or label[h] != label[one]:
                continue
            alike = True
            for part in range(2):
                ratio = std[h, part] / std[one, part]
                near = abs(centre[h, part] - centre[one, part]) < rule.near * std[one, part] + 1e-9
                alike = alike and near and 1.0 / rule.factor < ratio < rule.factor
            if alike or h == one:
                group[size], gone[h] = h, True
                size += 1
        kept[left], means[left], covariances[left], sums[left] = one, mean[one], covariance[one], weight[one]
        if size > 1:
            sums[left] = _united(weight, mean, covariance, group[:size], means[left], covariances[left])
        left += 1
    logs = np.log(sums[:left])
    chosen = np.arange(left)
    if left > rule.most:
        chosen = np.sort(_order(logs)[: rule.most])
    return kept[chosen], means[chosen], covariances[chosen], normalised(logs[chosen])
