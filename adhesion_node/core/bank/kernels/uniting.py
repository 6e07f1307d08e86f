# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Many hypotheses as one Gaussian, and as fewer: the unlikely end, and what says the same is united."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import kernel

Array = NDArray[np.float64]
Labels = NDArray[np.intp]
Columns = tuple[Array, Array, Array, Labels, Labels, Labels, Array, Array]

SPEED, MU, SIZE = 1, 2, 11

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
def _united(weight: Array, mean: Array, covariance: Array, group: Labels, centre: Array, spread: Array) -> float:
    """Write mean and covariance of a mixture of some hypotheses, of their first components; return their weight."""
    whole, size = 0.0, centre.size
    for h in group:
        whole += weight[h]
    centre[:] = 0.0
    spread[:] = 0.0
    for h in group:
        share = weight[h] / whole
        for i in range(size):
            centre[i] += share * mean[h, i]
    for h in group:
        share = weight[h] / whole
        for i in range(size):
            off = mean[h, i] - centre[i]
            for j in range(size):
                spread[i, j] += share * (covariance[h, i, j] + off * (mean[h, j] - centre[j]))
    return whole


@kernel
def moments(log_weight: Array, mean: Array, covariance: Array, size: int) -> tuple[Array, Array]:
    """Mean and covariance of the first components of the mixture."""
    centre, spread = np.empty(size), np.empty((size, size))
    weight = np.exp(log_weight - log_weight.max())
    _united(weight, mean, covariance, np.arange(weight.size), centre, spread)
    return centre, spread


@kernel
def mean_of(log_weight: Array, mean: Array, component: int) -> float:
    """Mean of one component over the mixture; the weights sum to 1."""
    result = 0.0
    for h in range(log_weight.size):
        result += math.exp(log_weight[h]) * mean[h, component]
    return result


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
def _alike(rule: Pruning, mean: Array, std: Array, of_mean: Array, of_std: Array) -> bool:
    """Whether two hypotheses say the same of adhesion and speed."""
    alike = True
    for part, i in enumerate((MU, SPEED)):
        near = abs(mean[i] - of_mean[i]) < rule.near * of_std[part] + 1e-9
        alike = alike and near and 1.0 / rule.factor < std[part] / of_std[part] < rule.factor
    return alike


@kernel
def pruned(bank: Columns, numbers: tuple[float, int, float, float]) -> Columns:
    """The hypotheses that are left by the numbers of a `Pruning`, their weights normalised."""
    rule, (mean, covariance, log_weight, noise, law, kind, born_s, changed_s) = Pruning(*numbers), bank
    count = log_weight.size
    order, label = _order(log_weight), (noise * 64 + law) * 64 + kind
    std, weight = np.empty((count, 2)), np.empty(count)
    for h in range(count):
        weight[h] = math.exp(log_weight[h]) if log_weight[h] > rule.least else 0.0
        std[h, 0], std[h, 1] = math.sqrt(covariance[h, MU, MU]), math.sqrt(covariance[h, SPEED, SPEED])
    # members of the groups, one group behind the other; where each ends, its likeliest member, its weight
    left, size, member = 0, 0, np.empty(count, dtype=np.intp)
    ends, kept, sums = np.zeros(count + 1, dtype=np.intp), np.empty(count, dtype=np.intp), np.zeros(count)
    gone = weight == 0.0
    for first in range(count):
        one = order[first]
        if gone[one]:
            continue
        for index in range(first, count):
            h = order[index]
            if label[h] != label[one] or gone[h]:
                continue
            if h == one or _alike(rule, mean[h], std[h], mean[one], std[one]):
                member[size], gone[h] = h, True
                sums[left] += weight[h]
                size += 1
        kept[left], ends[left + 1] = one, size
        left += 1
    chosen = np.arange(left)
    if left > rule.most:
        chosen = np.sort(_order(np.log(sums[:left]))[: rule.most])
    means, covariances = np.empty((chosen.size, SIZE)), np.empty((chosen.size, SIZE, SIZE))
    for row, group in enumerate(chosen):
        one = kept[group]
        if ends[group + 1] - ends[group] > 1:
            _united(weight, mean, covariance, member[ends[group] : ends[group + 1]], means[row], covariances[row])
            continue
        for i in range(SIZE):
            means[row, i] = mean[one, i]
            for j in range(SIZE):
                covariances[row, i, j] = covariance[one, i, j]
    kept, sums = kept[chosen], sums[chosen]
    return (
        *(means, covariances, np.log(sums / sums.sum())),
        *(noise[kept], law[kept], kind[kept], born_s[kept], changed_s[kept]),
    )
