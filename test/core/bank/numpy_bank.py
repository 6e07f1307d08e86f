# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A bank that moves and is corrected in NumPy, all hypotheses at once: what the compiled loops are held against."""

from __future__ import annotations

import math

import numpy as np

from adhesion_node.core.bank import motion
from adhesion_node.core.bank.kernels import moving
from adhesion_node.core.bank.kernels.moving import BUILDING_UP, FILLING
from adhesion_node.core.bank.labels import kinds, noises
from adhesion_node.core.bank.labels.kinds import KINDS, SLIDES
from adhesion_node.core.bank.labels.laws import laws_of
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
)
from adhesion_node.core.bank.motion import Braking, open_variance, resistance, slow_variance, white_variance
from adhesion_node.core.bank.seeing import CLIPPED, Observation
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
    loose = slides & (needed > 1.5 * rail)  # what rolls is hardly pressed
    by_rail = sliding + np.where(loose, 1.5 * (1.0 - sliding), 0.0)
    slope = np.zeros(mean.shape)
    other = np.array([KINDS[each].name == "other" for each in bank.kind])
    most = np.where(other, 1.5 * config.train.full_brake, np.inf)  # of whatever else brakes the train
    slope[:, MU] = np.where(free, mean[:, MU] < most, by_rail * (1.0 + mean[:, ROUGH]))
    slope[:, ROUGH] = by_rail * mean[:, MU]
    held = np.where(free | loose, 0.0, (1.0 - sliding) / (1.0 + rotating))
    slope[:, BRAKE] = held * braking.applied
    slope[:, SPEED] = -held * rotating * config.train.resistance_slope(mean[:, SPEED])
    value = by_rail * rail + np.where(loose, 0.0, (1.0 - sliding) * needed)
    return motion.Use(np.where(free, np.minimum(mean[:, MU], most), value), slope, slides, resisting)


def moved(config: Config, bank: Bank, dt_s: float, braking: Braking, declared_m: float) -> Bank:
    """The beliefs after `dt_s`; `declared_m` is the standard deviation that the positions declare."""
    mean, speed = bank.mean, bank.mean[:, SPEED]
    resisting = resistance(config, bank)
    used = use(config, bank, braking, resisting)
    slower = speed - dt_s * GRAVITY * (used.value + resisting + mean[:, GRADE])
    lasting, noise = _lasting(config, bank, slower, dt_s, declared_m)
    if braking.rising:
        noise[:, SPEED] += np.square(BUILDING_UP * GRAVITY * used.value) * dt_s
    held = used.slope[:, BRAKE] > 0.0
    strong = (braking.applied > 0.0) & (not braking.alone) & (mean[:, BRAKE] > 1.0 + 2.0 * max(config.brake_error, 0.1))
    noise[:, BRAKE] += 0.1**2 * (strong & (bank.covariance[:, BRAKE, BRAKE] < 0.5**2)) * dt_s
    noise[:, SPEED] += np.square(FILLING * GRAVITY * held * mean[:, BRAKE] * braking.filling) * dt_s
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
    return np.array([{"free": 5.0, "steady": 7200.0, "other": 800.0}.get(KINDS[each].name, 0.0) for each in kind])


def swings(kind: Indices) -> Mask:
    return np.array([KINDS[each].name in {"swinging", "even", "failing"} for each in kind])


def roughness_of(config: Config, kind: Indices) -> Array:
    """Of the rail, or of the swing, of a train with fewer axles than 200 m of them more."""
    rail = np.array([KINDS[each].roughness for each in kind])
    return np.where(swings(kind), config.used_ripple * math.sqrt(200.0 / max(config.train.length_m, 20.0)), rail)


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
    lasting[:, ROUGH] = np.where(swings(kind), np.exp(-dt_s / kinds.SWING_S), np.exp(-way_m / kinds.ROUGHNESS_M))
    lasting[:, GRADE] = np.exp(-way_m / kinds.grade_m_of(config))
    lasting[:, OFFSET] = np.exp(-dt_s / noises.LASTS[bank.noise])
    drift = np.square(kinds.DRIFT[kind] * np.maximum(bank.mean[:, MU], moving.LEAST_MU)) * dt_s
    noise[:, POSITION] = config.motion.position_noise_rate * dt_s
    noise[:, SPEED] = np.square(kinds.RESTLESSNESS[kind]) * dt_s
    noise[:, MU] = np.where(lasts_s > 0.0, kinds.FREE_STD**2 * (1.0 - free**2), drift)
    noise[:, ROUGH] = np.square(roughness_of(config, kind)) * (1.0 - lasting[:, ROUGH] ** 2)
    noise[:, BRAKE] = _drifted(bank, BRAKE, config.brake_drift**2 * dt_s, max(config.brake_error, 0.1))
    noise[:, GRADE] = open_variance(config, bank) * (1.0 - lasting[:, GRADE] ** 2)
    noise[:, OFFSET] = slow_variance(bank, declared_m) * (1.0 - lasting[:, OFFSET] ** 2)
    noise[:, BIAS] = motion.BIAS_DRIFT**2 * dt_s
    noise[:, RADIUS] = _drifted(bank, RADIUS, motion.RADIUS_DRIFT**2 * dt_s, 0.03)
    return lasting, noise


def _drifted(bank: Bank, component: int, drift: float, std: float) -> Array:
    """Variance that a drift adds: by itself it leads to no more than was open before anything was learnt."""
    variance = bank.covariance[:, component, component]
    drifted = std**2 + (variance - std**2) * np.exp(-drift / std**2)
    return np.asarray(np.where(variance < std**2, drifted - variance, 0.0))


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
