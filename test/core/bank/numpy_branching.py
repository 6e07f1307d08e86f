# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Hypotheses that branch, are united and given up, in NumPy: what the compiled loops are held against."""

from __future__ import annotations

import math

import numpy as np
from numpy_bank import moments, normalised, roughness_of, use
from scipy.special import ndtr

from adhesion_node.core.bank import branching
from adhesion_node.core.bank.labels.kinds import HELD, KINDS, OTHER, PASSING, SLIDES, SLIDING
from adhesion_node.core.bank.labels.laws import SLIPPERY, WET, laws_of
from adhesion_node.core.bank.layout import BRAKE, MU, ROUGH, SPEED, Bank, joined
from adhesion_node.core.bank.motion import Braking, resistance
from adhesion_node.core.config import Config
from adhesion_node.core.physics.train import Array


def branched(config: Config, bank: Bank, braking: Braking, now_s: float, elapsed_s: float) -> Bank:
    """With what may have become different within the last `elapsed_s`."""
    strong, bank = bank.weight > branching.STRONG, _doubted(config, bank, braking)
    children = [bank]
    sliding, held = bank.part(strong & SLIDES[bank.kind]), bank.part(strong & np.isin(bank.kind, (HELD, OTHER)))
    if sliding.log_weight.size:
        children += _changed(config, sliding, now_s, elapsed_s)
        if braking.told <= 1.0:
            children += _rolling(sliding, braking, now_s, elapsed_s)
    if held.log_weight.size and braking.told >= -1.0:
        children += _begun_to_slide(config, held, braking, now_s, elapsed_s)
    return normalised(joined(children + _otherwise(config, bank.part(strong), braking, now_s, elapsed_s)))


def _changed(config: Config, sliding: Bank, now_s: float, elapsed_s: float) -> list[Bank]:
    """Adhesion depends otherwise on speed; or a border is passed."""
    now = np.full(sliding.log_weight.size, now_s)
    children = []
    for law, (_, priors) in enumerate(laws_of(config)):
        probability = np.interp(sliding.mean[:, MU], (SLIPPERY, WET), priors)
        weight = sliding.log_weight + np.log(np.maximum(probability, 1e-300) * elapsed_s / branching.BEND_S)
        bent = sliding._replace(log_weight=weight, law=np.full(now.size, law), born_s=now)
        children.append(bent.part((sliding.law != law) & (probability > 0.0)))
    steady, passing = sliding.part(sliding.kind != PASSING), sliding.part(sliding.kind == PASSING)
    lasting = [kind for kind in SLIDING if kind != PASSING]
    begun = steady.labelled(PASSING, steady.law, now_s, math.log(elapsed_s / branching.PASSING_S))
    for kind in SLIDING:
        if kind == PASSING:
            children.append(begun._replace(changed_s=np.full(begun.law.size, now_s)))
            continue
        share = KINDS[kind].prior / sum(KINDS[each].prior for each in lasting)
        passed = passing.labelled(kind, passing.law, now_s, math.log(share * elapsed_s / branching.PASSED_S))
        passed = passed._replace(changed_s=np.full(passed.law.size, now_s))
        children.append(passed.with_fresh(ROUGH, 0.0, roughness_of(config, np.array([kind]))[0]))
    return children


def _rolling(sliding: Bank, braking: Braking, now_s: float, elapsed_s: float) -> list[Bank]:
    """Adhesion has become more than the brake uses: likelier the nearer it was."""
    found = []
    for noise in np.unique(sliding.noise):
        alike = sliding.part(sliding.noise == noise)
        one = alike.part(np.array([np.argmax(alike.log_weight)]))
        most = float(one.mean[0, BRAKE]) * braking.applied
        spread = math.hypot(math.sqrt(one.covariance[0, MU, MU]), math.sqrt(one.covariance[0, BRAKE, BRAKE]) * most)
        near = float(ndtr((one.mean[0, MU] - branching.REACHED * most) / max(spread, 1e-6)))
        prior = elapsed_s * (1.0 / branching.CHANGE_S + near / branching.REACHED_S)
        total = np.logaddexp.reduce(alike.log_weight) - one.log_weight
        found.append(one.with_fresh(ROUGH, 0.0, 0.0).labelled(HELD, 0, now_s, total + math.log(min(prior, 1.0))))
    return found


def _begun_to_slide(config: Config, held: Bank, braking: Braking, now_s: float, elapsed_s: float) -> list[Bank]:
    """Adhesion has become less than the brake needs, or another one has ended: a little less, or any."""
    needed = _rolling_use(config, held, braking)
    parts = branching.LESS[:1] if braking.rising else branching.LESS
    begin_s = branching.RISING_S if braking.rising else branching.STEADY_S
    rate = elapsed_s / np.where(held.kind == HELD, begin_s, branching.ENDED_S) / len(parts)
    share = sum(KINDS[kind].prior for kind in SLIDING)
    found = []
    for less in parts:
        gives = less * needed
        for law, (_, priors) in enumerate(laws_of(config)):
            probability = np.interp(gives, (SLIPPERY, WET), priors)
            for kind in SLIDING:
                likely = np.log(np.maximum(rate * probability * KINDS[kind].prior / share, 1e-300))
                fresh = held.with_fresh(MU, gives, branching.LESS_STD * gives + branching.LESS_LEAST_STD)
                fresh = fresh.with_fresh(ROUGH, 0.0, roughness_of(config, np.array([kind]))[0])
                found.append(fresh.labelled(kind, law, now_s, likely).part(probability > 0.0))
    return found


def _rolling_use(config: Config, bank: Bank, braking: Braking) -> Array:
    held = bank._replace(kind=np.full_like(bank.kind, HELD))
    return use(config, held, braking, resistance(config, held)).value


def _doubted(config: Config, bank: Bank, braking: Braking) -> Bank:
    """Another brake gives more than the known one needs, or it is hardly there."""
    off = bank.mean[:, MU] - _rolling_use(config, bank, braking)
    more = ndtr(off / np.sqrt(bank.covariance[:, MU, MU]))
    doubt = np.where(bank.kind == OTHER, np.log(np.maximum(more, branching.UNNEEDED)), 0.0)
    return bank._replace(log_weight=bank.log_weight + doubt)


def _otherwise(config: Config, strong: Bank, braking: Braking, now_s: float, elapsed_s: float) -> list[Bank]:
    """Another brake begins to work, or has ended: then axles roll, or what was used is what the rail gives."""
    found, ended = [], elapsed_s / branching.ENDED_S
    more, std = branching.MORE
    for index, kind in enumerate(strong.kind):
        one = strong.part(np.array([index])).with_fresh(ROUGH, 0.0, 0.0)
        if kind == HELD and braking.alone:
            other = one.with_fresh(MU, _rolling_use(config, one, braking) + more, std)
            found.append(other.labelled(OTHER, 0, now_s, math.log(elapsed_s / branching.OTHER_S)))
        elif kind == OTHER and braking.told <= 1.0:
            spread = 0.5 * np.abs(one.mean[:, MU]) + branching.LESS_LEAST_STD
            found.append(one.with_fresh(MU, one.mean[:, MU], spread).labelled(HELD, 0, now_s, math.log(ended)))
    others = strong.part((strong.kind == OTHER) & (braking.told >= -1.0))
    if others.log_weight.size:
        share = sum(KINDS[kind].prior for kind in SLIDING)
        for law, (_, priors) in enumerate(laws_of(config)):
            probability = np.interp(others.mean[:, MU], (SLIPPERY, WET), priors)
            for kind in SLIDING:
                likely = np.log(np.maximum(ended * probability * KINDS[kind].prior / share, 1e-300))
                left = others.with_fresh(ROUGH, 0.0, roughness_of(config, np.array([kind]))[0])
                found.append(left.labelled(kind, law, now_s, likely).part(probability > 0.0))
    return found


def pruned(bank: Bank) -> Bank:
    """Without the unlikely, and with what says the same said once."""
    bank = _united(normalised(bank.part(bank.log_weight > math.log(branching.LEAST))))
    if bank.log_weight.size > branching.MOST:
        bank = bank.part(np.sort(np.argsort(-np.round(bank.log_weight, 9), kind="stable")[: branching.MOST]))
    return normalised(bank)


def _united(bank: Bank) -> Bank:
    """Unite hypotheses of one label that say the same, the likelier one first."""
    order = np.argsort(-np.round(bank.log_weight, 9), kind="stable")
    bank = bank.part(order)
    same = (bank.noise[:, None] == bank.noise) & (bank.law[:, None] == bank.law) & (bank.kind[:, None] == bank.kind)
    for component in (MU, SPEED):
        std = np.sqrt(bank.covariance[:, component, component])
        mean = bank.mean[:, component]
        ratio = std / std[:, None]
        same &= np.abs(mean - mean[:, None]) < branching.ALIKE * std[:, None] + 1e-9
        same &= (ratio < branching.ALIKE_STD) & (ratio > 1.0 / branching.ALIKE_STD)
    gone = np.zeros(order.size, dtype=np.bool_)
    mean, covariance, log_weight = bank.mean.copy(), bank.covariance.copy(), bank.log_weight.copy()
    for index in range(order.size):
        if gone[index]:
            continue
        group = same[index] & ~gone
        group[:index] = False
        if np.count_nonzero(group) > 1:
            part = bank.part(group)
            mean[index], covariance[index] = moments(part)
            log_weight[index] = np.logaddexp.reduce(part.log_weight)
            group[index] = False
            gone |= group
    return bank._replace(mean=mean, covariance=covariance, log_weight=log_weight).part(~gone)
