# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The bank's arithmetic in NumPy, all hypotheses at once: what the compiled loops are held against."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.integrate import trapezoid
from scipy.special import ndtr

from adhesion_node.core.bank import branching, motion
from adhesion_node.core.bank.findings import ahead
from adhesion_node.core.bank.kernels import moving
from adhesion_node.core.bank.labels import kinds, noises
from adhesion_node.core.bank.labels.kinds import HELD, KINDS, PASSING, SLIDES, SLIDING
from adhesion_node.core.bank.labels.laws import SLIPPERY, WET, laws_of
from adhesion_node.core.bank.layout import (
    BIAS,
    BRAKE,
    GRADE,
    MU,
    OFFSET,
    POSITION,
    RADIUS,
    ROUGH,
    SPEED,
    Bank,
    Indices,
    Mask,
    joined,
)
from adhesion_node.core.bank.motion import Braking, open_variance, resistance, slow_variance, white_variance
from adhesion_node.core.bank.seeing import CLIPPED, ROLLED, Observation
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.physics.train import GRAVITY, Array

EACH = np.arange(11)


def use(config: Config, bank: Bank, braking: Braking, resisting: Array) -> motion.Use:
    """Adhesion used under each hypothesis: axles slide where the rail gives less than the brake asks for."""
    mean, rotating = bank.mean, config.train.rotating_mass_fraction
    needed = (mean[:, BRAKE] * braking.applied - rotating * resisting) / (1.0 + rotating)
    rail = mean[:, MU] * (1.0 + mean[:, ROUGH])
    free = _lasts_s(bank.kind) > 0.0
    slides = SLIDES[bank.kind] & ((rail < needed) | (braking.told > 0.0))
    sliding = np.where(slides, braking.share, 0.0)
    slope = np.zeros(mean.shape)
    slope[:, MU] = np.where(free, 1.0, sliding * (1.0 + mean[:, ROUGH]))
    slope[:, ROUGH] = sliding * mean[:, MU]
    held = np.where(free, 0.0, (1.0 - sliding) / (1.0 + rotating))
    slope[:, BRAKE] = held * braking.applied
    slope[:, SPEED] = -held * rotating * config.train.resistance_slope(mean[:, SPEED])
    return motion.Use(np.where(free, mean[:, MU], sliding * rail + (1.0 - sliding) * needed), slope, slides, resisting)


def moved(config: Config, bank: Bank, dt_s: float, braking: Braking, declared_m: float) -> Bank:
    """The beliefs after `dt_s`; `declared_m` is the standard deviation that the positions declare."""
    mean, speed = bank.mean, bank.mean[:, SPEED]
    resisting = resistance(config, bank)
    used = use(config, bank, braking, resisting)
    slower = speed - dt_s * GRAVITY * (used.value + resisting + mean[:, GRADE])
    lasting, noise = _lasting(config, bank, slower, dt_s, declared_m)
    if braking.rising:
        noise[:, SPEED] += np.square(motion.BUILDING_UP * GRAVITY * used.value) * dt_s
    held = used.slope[:, BRAKE] > 0.0
    noise[:, SPEED] += np.square(motion.FILLING * GRAVITY * held * mean[:, BRAKE] * braking.filling) * dt_s
    means = mean * lasting
    means[:, SPEED] = slower
    means[:, POSITION] = mean[:, POSITION] + 0.5 * dt_s * (speed + slower)
    effect = used.slope
    effect[:, GRADE] = 1.0
    effect[:, SPEED] += config.train.resistance_slope(speed)
    step = np.zeros(bank.covariance.shape)
    step[:, EACH, EACH] = lasting
    step[:, SPEED] -= dt_s * GRAVITY * effect
    step[:, POSITION] -= 0.5 * dt_s**2 * GRAVITY * effect
    step[:, POSITION, SPEED] += dt_s
    covariance = step @ bank.covariance @ step.transpose(0, 2, 1)
    covariance[:, EACH, EACH] += noise
    return bank._replace(mean=means, covariance=covariance)


def _lasts_s(kind: Indices) -> Array:
    """How long a deceleration lasts that no brake holds; 0 where one does."""
    return np.array([{"free": 5.0, "steady": 7200.0}.get(KINDS[each].name, 0.0) for each in kind])


def _swings(kind: Indices) -> Mask:
    return np.array([KINDS[each].name in {"swinging", "even", "failing"} for each in kind])


def _roughness(config: Config, kind: Indices) -> Array:
    """Of the rail, or of the swing, of a train with fewer axles than 200 m of them more."""
    rail = np.array([KINDS[each].roughness for each in kind])
    return np.where(_swings(kind), config.used_ripple * math.sqrt(200.0 / max(config.train.length_m, 20.0)), rail)


def _lasting(config: Config, bank: Bank, slower: Array, dt_s: float, declared_m: float) -> tuple[Array, Array]:
    """What lasts of each component over a step, and the variance that is added, shapes (H, SIZE)."""
    kind, speed = bank.kind, bank.mean[:, SPEED]
    way_m = np.maximum(speed, 0.1) * dt_s
    by_law = [law(slower) / law(speed) for law, _ in laws_of(config)]
    lasts_s = _lasts_s(kind)
    free = np.exp(-dt_s / np.where(lasts_s > 0.0, lasts_s, 1.0))
    lasting, noise = np.ones(bank.mean.shape), np.zeros(bank.mean.shape)
    grown = np.choose(bank.law, by_law) * np.exp(kinds.GROWTH[kind] * dt_s)
    lasting[:, MU] = np.where(lasts_s > 0.0, free, np.where(SLIDES[kind], grown, 1.0))
    lasting[:, ROUGH] = np.where(_swings(kind), np.exp(-dt_s / kinds.SWING_S), np.exp(-way_m / kinds.ROUGHNESS_M))
    lasting[:, GRADE] = np.exp(-way_m / kinds.grade_m_of(config))
    lasting[:, OFFSET] = np.exp(-dt_s / noises.LASTS[bank.noise])
    drift = np.square(kinds.DRIFT[kind] * np.maximum(bank.mean[:, MU], moving.LEAST_MU)) * dt_s
    noise[:, POSITION] = config.motion.position_noise_rate * dt_s
    noise[:, SPEED] = np.square(kinds.RESTLESSNESS[kind]) * dt_s
    noise[:, MU] = np.where(lasts_s > 0.0, kinds.FREE_STD**2 * (1.0 - free**2), drift)
    noise[:, ROUGH] = np.square(_roughness(config, kind)) * (1.0 - lasting[:, ROUGH] ** 2)
    noise[:, BRAKE] = config.brake_drift**2 * dt_s
    noise[:, GRADE] = open_variance(config, bank) * (1.0 - lasting[:, GRADE] ** 2)
    noise[:, OFFSET] = slow_variance(bank, declared_m) * (1.0 - lasting[:, OFFSET] ** 2)
    noise[:, BIAS] = motion.BIAS_DRIFT**2 * dt_s
    noise[:, RADIUS] = motion.RADIUS_DRIFT**2 * dt_s
    return lasting, noise


def position_seen(bank: Bank, position_m: float, declared_m: float) -> Observation:
    """A position, whose declared standard deviation is only a hint."""
    slope = np.zeros(bank.mean.shape)
    slope[:, POSITION] = slope[:, OFFSET] = 1.0
    foreseen = bank.mean[:, POSITION] + bank.mean[:, OFFSET]
    return Observation(position_m - foreseen, slope, white_variance(bank, declared_m))


def corrected(bank: Bank, seen: Observation) -> Bank:
    """Take an observation in; the weights are not normalised."""
    gain = np.einsum("hij,hj->hi", bank.covariance, seen.slope)
    variance = np.einsum("hi,hi->h", gain, seen.slope) + seen.variance
    squared = seen.innovation**2 / variance
    clipped = CLIPPED * np.sqrt(squared) - 0.5 * CLIPPED**2
    evidence = -0.5 * np.log(variance) - np.where(squared > CLIPPED**2, clipped, 0.5 * squared)
    pull = gain / (variance * np.maximum(np.sqrt(squared) / CLIPPED, 1.0))[:, None]
    return bank._replace(
        mean=bank.mean + pull * seen.innovation[:, None],
        covariance=bank.covariance - pull[:, :, None] * gain[:, None, :],
        log_weight=bank.log_weight + evidence,
    )


def normalised(bank: Bank) -> Bank:
    """With probabilities that sum to 1."""
    return bank._replace(log_weight=bank.log_weight - np.logaddexp.reduce(bank.log_weight))


def moments(bank: Bank) -> tuple[Array, Array]:
    """Mean and covariance over all hypotheses."""
    weight = normalised(bank).weight
    mean = weight @ bank.mean
    apart = bank.mean - mean
    return mean, np.einsum("h,hij->ij", weight, bank.covariance) + (apart.T * weight) @ apart


def branched(config: Config, bank: Bank, braking: Braking, now_s: float, elapsed_s: float) -> Bank:
    """With what may have become different within the last `elapsed_s`."""
    strong = bank.weight > branching.STRONG
    children = [bank]
    sliding, held = bank.part(strong & SLIDES[bank.kind]), bank.part(strong & (bank.kind == HELD))
    if sliding.log_weight.size:
        children += _changed(config, sliding, now_s, elapsed_s)
        if braking.told <= 0.0:
            children += _rolling(sliding, braking, now_s, elapsed_s)
    if held.log_weight.size and braking.told >= 0.0:
        children += _begun_to_slide(config, held, braking, now_s, elapsed_s)
    return normalised(joined(children))


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
        children.append(passed.with_fresh(ROUGH, 0.0, _roughness(config, np.array([kind]))[0]))
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
    """Adhesion has become less than the brake needs: a little less while it rises, else any less."""
    needed = use(config, held, braking, resistance(config, held)).value
    parts = branching.LESS[:1] if braking.rising else branching.LESS
    rate = elapsed_s / (branching.RISING_S if braking.rising else branching.STEADY_S) / len(parts)
    share = sum(KINDS[kind].prior for kind in SLIDING)
    found = []
    for less in parts:
        gives = less * needed
        for law, (_, priors) in enumerate(laws_of(config)):
            probability = np.interp(gives, (SLIPPERY, WET), priors)
            for kind in SLIDING:
                likely = np.log(np.maximum(rate * probability * KINDS[kind].prior / share, 1e-300))
                fresh = held.with_fresh(MU, gives, branching.LESS_STD * gives + branching.LESS_LEAST_STD)
                fresh = fresh.with_fresh(ROUGH, 0.0, _roughness(config, np.array([kind]))[0])
                found.append(fresh.labelled(kind, law, now_s, likely).part(probability > 0.0))
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


def quantiles(weights: Array, means: Array, stds: Array, probabilities: Sequence[float]) -> Array:
    """Quantiles of mixtures of Gaussians by bisection.

    `weights` has the shape (H,), `means` and `stds` (..., H); the result (..., P) for P probabilities.
    """
    wanted = np.array(probabilities)
    size = (*means.shape[:-1], wanted.size)
    low = np.broadcast_to((means - 8.0 * stds).min(axis=-1, keepdims=True), size)
    high = np.broadcast_to((means + 8.0 * stds).max(axis=-1, keepdims=True), size)
    for _ in range(60):
        middle = 0.5 * (low + high)
        below = ndtr((middle[..., None] - means[..., None, :]) / stds[..., None, :]) @ weights < wanted
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return np.asarray(0.5 * (low + high))


def counted_on(config: Config, bank: Bank, missed: float, braking: Braking, known: Rail) -> tuple[Array, Array]:
    """Quantile of adhesion and grade ahead, at each of some speeds down to a standstill, behind these speeds."""
    mean, used = bank.mean, use(config, bank, braking, resistance(config, bank))
    sliding = used.slides
    speed, resisting = np.maximum(mean[:, SPEED], 1.0), resistance(config, bank)
    slowing = GRAVITY * np.maximum(used.value + resisting + mean[:, GRADE], 0.005)
    way_m, time_s = speed**2 / (2.0 * slowing), speed / slowing
    swinging = _swings(bank.kind)
    lengths = np.where(swinging, time_s / kinds.SWING_S, way_m / kinds.ROUGHNESS_M)
    rough_kept, rough_added = _mean_ahead(lengths, 1.0)
    grade_kept, grade_added = _mean_ahead(way_m, kinds.grade_m_of(config))
    slope = used.slope.copy()
    slope[:, ROUGH] *= rough_kept
    slope[:, GRADE] = grade_kept
    told = max(float(bank.weight @ speed), 1.0)
    slope[:, SPEED] -= 2.0 * slowing / GRAVITY / told  # a way goes with the speed's square
    adhesion = used.value - used.slope[:, ROUGH] * mean[:, ROUGH] * (1.0 - rough_kept)
    adhesion = adhesion - 2.0 * slowing / GRAVITY * (mean[:, SPEED] - told) / told
    roughness = (
        _roughness(config, bank.kind) ** 2 * rough_added
        + np.minimum(kinds.DRIFT[bank.kind], ahead.DRIFT_AHEAD) ** 2 * time_s / 3.0
    )
    variance = np.einsum("hi,hij,hj->h", slope, bank.covariance, slope) + open_variance(config, bank) * grade_added
    apart = ahead.NEAR**2 + _mean_ahead(way_m, ahead.AHEAD_M)[1]
    variance += apart * np.square(config.ahead_std * used.value) + np.where(sliding, mean[:, MU] ** 2 * roughness, 0.0)
    speeds = float(bank.weight @ speed) * ahead.SPEEDS_AHEAD
    by_law = np.array([law(speeds[:, None]) / law(speed) for law, _ in laws_of(config)])
    rising = np.where(sliding, by_law[bank.law, :, np.arange(bank.law.size)].T, 1.0) ** ahead.COUNTED_RISE
    fails = float(bank.weight @ (kinds.GROWTH[bank.kind] < 0.0)) >= ahead.FAILS
    growth = np.where(sliding & fails, np.minimum(kinds.GROWTH[bank.kind], 0.0), 0.0)
    passed = np.linspace(0.0, 1.0, 4001)  # of the time to the standstill; there the train is so much slower
    rising *= trapezoid(2.0 * (1.0 - passed) * np.exp(np.outer(growth * time_s, passed)), passed)
    foreseen = adhesion * rising + mean[:, GRADE] * grade_kept
    std = np.sqrt(np.maximum(variance, 1e-12)) * rising
    # the whole brake may make axles slide that roll under a part of it
    whole = config.train.specific_brake(config.train.full_pressure_pa)
    partial = braking.applied < ahead.PARTIAL * whole
    borne = used.value * (ROLLED[0] / ROLLED[1] if partial else 1.0)
    least = min(known.lower, whole) if partial else 0.0
    foreseen, more = np.where(sliding, foreseen, foreseen + borne - used.value), ~sliding & (borne < least)
    foreseen, std = np.where(more, least, foreseen), np.where(more, 1e-6, std)
    middle = np.maximum(foreseen, ahead.LEAST_AHEAD)
    variance = np.log1p(np.square(std / middle))  # of the logarithm: so much may be taken away, but not all
    # where nothing tells which, sliding since the brake was applied is as likely as rolling beforehand
    since = sliding & np.isneginf(bank.born_s) & (not partial) & (braking.told == 0.0)
    odds = np.where(since, ahead.UNTOLD, 1.0) * bank.weight
    weight = odds / odds.sum()
    wanted = missed, ahead.LIKELIER
    low, likelier = np.exp(quantiles(weight, np.log(middle) - 0.5 * variance, np.sqrt(variance), wanted)).T
    lowest = ahead.LOWEST_PART * config.lowest_mu  # of any rail, unless it is likelier to be less
    return speeds, np.maximum(low, np.minimum(lowest, likelier))


def _mean_ahead(way_m: Array, length_m: float) -> tuple[Array, Array]:
    """Of what fades over a length: what stays of it in the mean over a way, and what share of its variance is added."""
    relative = way_m / length_m
    kept = -np.expm1(-relative) / relative
    spread = 2.0 / relative * (1.0 - kept)
    return kept, np.maximum(spread - kept**2, 0.0)
