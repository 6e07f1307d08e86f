# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The hypotheses that spring from others: the rail has changed, axles begin to slide or roll again."""

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
Mask = NDArray[np.bool_]
Columns = tuple[Array, Array, Array, Labels, Labels, Labels, Array, Array]

MU, ROUGH, BRAKE, SIZE = 2, 3, 4, 11
HELD = 1
LAW, ROLLS, BORDER, BEGINS, ENDS, LASTS, LEFT, SLIDES = 1, 2, 3, 4, 5, 6, 7, 8
"""What is new of a hypothesis; from `SLIDES` on, by which part of `less`. A row of `rows` is its parent, law, kind, and
this."""


class Rule(NamedTuple):
    """What may spring from what, and how likely."""

    now_s: float
    elapsed_s: float
    strong: float
    """Probability from which others spring from a hypothesis."""
    change_s: float
    """Time in which axles roll whatever the adhesion was."""
    bend_s: float
    """Time in which adhesion begins to depend otherwise on speed."""
    begin_s: float
    """Time in which axles begin to slide."""
    reached_s: float
    """Time in which axles roll that the brake no longer makes slide."""
    reached: float
    """Part of what the brake presses with from which adhesion is no longer reached by it."""
    passing: int
    """Kind of a rail whose border the train passes."""
    passing_s: float
    """Time in which it begins to pass one."""
    passed_s: float
    """Time that this takes."""
    other: int
    """Kind of a train that another brake holds beside the known one."""
    other_s: float
    """Time in which that begins to work, ..."""
    ended_s: float
    """... and ends."""
    more: Array
    """How much more is used then than the known brake needs, and how well that is known."""
    unneeded: float
    """Part of its probability, at least, that is left to one that is seen to give no more."""
    less: Array
    """Parts of what the brake needs that a rail may give on which axles begin to slide."""
    less_std: float
    """How well each of them is known, relative, ..."""
    least_std: float
    """... and how badly at least, as adhesion."""
    applied: float
    told: float
    laws: Array
    """Probabilities on a slippery and on a wet rail, shape (L, 2)."""
    levels: Array
    """Adhesion up to which a rail is the one, and from which on it is the other."""
    sliding: Array
    """Roughness and prior of each kind, shape (K, 2); the prior is 0 where it does not slide."""


@kernel
def law_prior(laws: Array, levels: Array, law: int, mu: float) -> float:
    """Probability of a law where the rail gives `mu`."""
    wet = min(max((mu - levels[0]) / (levels[1] - levels[0]), 0.0), 1.0)
    return float(laws[law, 0] + wet * (laws[law, 1] - laws[law, 0]))


@kernel
def _bent(bank: Bank, slides: Mask, rule: Rule, rows: Labels, weight: Array, size: int) -> int:
    """Adhesion depends otherwise on speed."""
    for law in range(rule.laws.shape[0]):
        for h in range(slides.size):
            likely = law_prior(rule.laws, rule.levels, law, bank.mean[h, MU])
            if slides[h] and likely > 0.0 and bank.law[h] != law:
                rows[size, 0], rows[size, 1], rows[size, 2], rows[size, 3] = h, law, bank.kind[h], LAW
                weight[size] = bank.log_weight[h] + math.log(likely * rule.elapsed_s / rule.bend_s)
                size += 1
    return size


@kernel
def _passing(bank: Bank, slides: Mask, rule: Rule, rows: Labels, weight: Array, size: int) -> int:
    """The train begins to pass a border of the rail, or has passed it."""
    lasting = rule.sliding[:, 1].sum() - rule.sliding[rule.passing, 1]
    for kind in range(rule.sliding.shape[0]):
        for h in range(slides.size):
            if slides[h] and (kind == rule.passing) != (bank.kind[h] == rule.passing):
                begins = kind == rule.passing
                likely = 1.0 / rule.passing_s if begins else rule.sliding[kind, 1] / lasting / rule.passed_s
                if likely > 0.0:
                    rows[size, 0], rows[size, 1], rows[size, 2] = h, bank.law[h], kind
                    rows[size, 3] = BORDER if begins else LASTS
                    weight[size] = bank.log_weight[h] + math.log(likely * rule.elapsed_s)
                    size += 1
    return size


@kernel
def _rolling(bank: Bank, slides: Mask, rule: Rule, rows: Labels, weight: Array, size: int) -> int:
    """Adhesion has become more than the brake uses: of each way that positions err the likeliest hypothesis says so."""
    for noise in range(bank.noise.max() + 1):
        best, whole = -1, 0.0
        for h in range(slides.size):
            if slides[h] and bank.noise[h] == noise:
                whole += math.exp(bank.log_weight[h])
                best = h if best < 0 or bank.log_weight[h] > bank.log_weight[best] else best
        if best >= 0:
            x, p = bank.mean[best], bank.covariance[best]
            reach = x[BRAKE] * rule.applied
            spread = math.hypot(math.sqrt(p[MU, MU]), math.sqrt(p[BRAKE, BRAKE]) * reach)
            off = (x[MU] - rule.reached * reach) / max(spread, 1e-6)
            near = 0.5 * math.erfc(-off / math.sqrt(2.0))
            prior = rule.elapsed_s * (1.0 / rule.change_s + near / rule.reached_s)
            rows[size, 0], rows[size, 1], rows[size, 2], rows[size, 3] = best, 0, HELD, ROLLS
            weight[size] = math.log(whole * min(prior, 1.0))
            size += 1
    return size


@kernel
def _begun(bank: Bank, holds: Mask, needed: Array, rule: Rule, rows: Labels, weight: Array, size: int) -> int:
    """Adhesion has become less than the brake needs, or is so where there is no other brake any more."""
    rate = rule.elapsed_s / rule.sliding[:, 1].sum() / rule.less.size
    for part in range(rule.less.size):
        for law in range(rule.laws.shape[0]):
            for kind in range(rule.sliding.shape[0]):
                for h in range(holds.size):
                    gives = rule.less[part] * needed[h]
                    likely = rate * law_prior(rule.laws, rule.levels, law, gives) * rule.sliding[kind, 1]
                    likely /= rule.begin_s if bank.kind[h] == HELD else rule.ended_s
                    if holds[h] and likely > 0.0:
                        rows[size, 0], rows[size, 1], rows[size, 2], rows[size, 3] = h, law, kind, SLIDES + part
                        weight[size] = weight[h] + math.log(likely)
                        size += 1
    return size


@kernel
def _unneeded(bank: Bank, needed: Array, rule: Rule, weight: Array) -> None:
    """Another brake that gives no more than the known one needs is hardly there."""
    for h in range(needed.size):
        if bank.kind[h] == rule.other:
            off = (needed[h] - bank.mean[h, MU]) / math.sqrt(max(bank.covariance[h, MU, MU], 1e-12))
            weight[h] += math.log(max(0.5 * math.erfc(off / math.sqrt(2.0)), rule.unneeded))


@kernel
def _otherwise(bank: Bank, strong: Mask, rule: Rule, rows: Labels, weight: Array, size: int) -> int:
    """Another brake begins to work beside the known one, or has ended: then axles roll."""
    for h in range(strong.size):
        begins, ends = bank.kind[h] == HELD, bank.kind[h] == rule.other and rule.told <= 0.0
        likely = rule.elapsed_s / (rule.other_s if begins else rule.ended_s)
        if strong[h] and (begins or ends) and likely > 0.0:
            rows[size, 0], rows[size, 1], rows[size, 2] = h, 0, rule.other if begins else HELD
            rows[size, 3] = BEGINS if begins else ENDS
            weight[size] = weight[h] + math.log(likely)
            size += 1
    return size


@kernel
def _left(bank: Bank, others: Mask, rule: Rule, rows: Labels, weight: Array, size: int) -> int:
    """There is no other brake any more, and what is used is what the rail gives."""
    rate = rule.elapsed_s / rule.ended_s / rule.sliding[:, 1].sum()
    for law in range(rule.laws.shape[0]):
        for kind in range(rule.sliding.shape[0]):
            for h in range(others.size):
                likely = rate * law_prior(rule.laws, rule.levels, law, bank.mean[h, MU]) * rule.sliding[kind, 1]
                if others[h] and likely > 0.0:
                    rows[size, 0], rows[size, 1], rows[size, 2], rows[size, 3] = h, law, kind, LEFT
                    weight[size] = weight[h] + math.log(likely)
                    size += 1
    return size


@kernel
def _fresh(x: Array, p: Array, component: int, mean: float, std: float) -> None:
    x[component] = mean
    p[component, :] = 0.0
    p[:, component] = 0.0
    p[component, component] = std**2


@kernel
def branched(bank: Bank, needed: Array, rule: Rule) -> Columns:
    """All hypotheses, and behind them what may be different now; `needed` is the adhesion that each would use rolling.

    The weights are not normalised.
    """
    count = bank.kind.size
    strong = np.exp(bank.log_weight) > rule.strong
    slides = strong & (rule.sliding[:, 1][bank.kind] > 0.0)
    holds = strong & ((bank.kind == HELD) | (bank.kind == rule.other)) & (rule.told >= 0.0)
    others = strong & (bank.kind == rule.other) & (rule.told >= 0.0)
    kinds, laws = rule.sliding.shape[0], rule.laws.shape[0]
    most = count + strong.sum() + (laws + 1 + kinds) * slides.sum()
    most += laws * kinds * (rule.less.size * holds.sum() + others.sum())
    rows, weight = np.zeros((most, 4), np.intp), np.empty(most)
    for h in range(count):
        rows[h, 0], rows[h, 1], rows[h, 2], weight[h] = h, bank.law[h], bank.kind[h], bank.log_weight[h]
    _unneeded(bank, needed, rule, weight)
    size = _bent(bank, slides, rule, rows, weight, count)
    size = _passing(bank, slides, rule, rows, weight, size)
    if rule.told <= 0.0 and slides.any():
        size = _rolling(bank, slides, rule, rows, weight, size)
    size = _begun(bank, holds, needed, rule, rows, weight, size)
    size = _otherwise(bank, strong, rule, rows, weight, size)
    size = _left(bank, others, rule, rows, weight, size)
    parent, law, kind = rows[:size, 0].copy(), rows[:size, 1].copy(), rows[:size, 2].copy()
    mean, covariance = bank.mean[parent], bank.covariance[parent]
    born, changed = bank.born_s[parent], bank.changed_s[parent]
    for row in range(count, size):
        new, x, p = rows[row, 3], mean[row], covariance[row]
        born[row] = rule.now_s
        if new in (BORDER, LASTS):
            changed[row] = rule.now_s
        if new in (ROLLS, BEGINS, ENDS):
            _fresh(x, p, ROUGH, 0.0, 0.0)
        if new == BEGINS:
            _fresh(x, p, MU, needed[parent[row]] + rule.more[0], rule.more[1])
        if new == ENDS:
            _fresh(x, p, MU, x[MU], 0.5 * abs(x[MU]) + rule.least_std)
        if new >= LASTS:
            _fresh(x, p, ROUGH, 0.0, rule.sliding[kind[row], 0])
        if new >= SLIDES:
            gives = rule.less[new - SLIDES] * needed[parent[row]]
            _fresh(x, p, MU, gives, rule.less_std * gives + rule.least_std)
    return mean, covariance, weight[:size].copy(), bank.noise[parent], law, kind, born, changed
