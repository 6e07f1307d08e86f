# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""How the beliefs move on: dv/dt = -g (u + r(s, v) + gamma), with the adhesion u that is used, and decaying errors.

    u = mu (1 + rho)                                where the adhesion limits
    u = (beta B - rotating r)/(1 + rotating)        where the brake does
    u = f mu (1 + rho) + (1 - f) beta B ...         where the share f of the axles slides

Roughness rho and grade gamma fade with the way, the slow error of the positions with time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..physics.adhesion import SpeedLaw
from ..physics.train import GRAVITY, Array
from . import kinds
from .kinds import FREE, SLIDES
from .layout import BIAS, BRAKE, EACH, GRADE, MU, OFFSET, POSITION, ROUGH, SPEED, Bank, Mask

if TYPE_CHECKING:
    from ..config import Config

BUILDING_UP = 0.3
"""Error of the brake's force while it is applied harder, relative: of the speed over 1 s, and as an accelerometer feels
it."""

BIAS_DRIFT = 1e-4
"""Of an accelerometer's bias over g, within 1 s."""


class Braking(NamedTuple):
    """The brake over a step."""

    applied: float
    """B/(M g) that the cylinders press with."""
    share: float = 1.0
    """Of the axles, that slides where any does."""
    rising: bool = False
    """Whether the brake is being applied harder."""
    told: float = 0.0
    """Log odds per second by which axles are known to slide, or below 0 to roll."""


class Use(NamedTuple):
    """Adhesion that is used, shape (H,), and its derivatives with respect to the state, shape (H, SIZE)."""

    value: Array
    slope: Array
    slides: Mask
    """Whether the adhesion limits, shape (H,)."""

    def std(self, bank: Bank) -> Array:
        """Standard deviations, shape (H,)."""
        variance = np.einsum("hi,hij,hj->h", self.slope, bank.covariance, self.slope)
        return np.asarray(np.sqrt(np.maximum(variance, 1e-12)))


def laws_of(config: Config) -> tuple[tuple[SpeedLaw, float], ...]:
    """How adhesion may depend on speed, with probabilities: the law, the low-adhesion law, not at all."""
    rest = (1.0 - config.law_probability) / 2.0
    return ((config.speed_law, config.law_probability), (config.low_law, rest), (SpeedLaw(1.0), rest))


def resistance(config: Config, bank: Bank) -> Array:
    """Resistance of train and track per weight, N/N, shape (H,)."""
    return config.motion.resistance(bank.mean[:, POSITION], bank.mean[:, SPEED])


def use(config: Config, bank: Bank, braking: Braking, resisting: Array) -> Use:
    """Adhesion used under each hypothesis: axles slide where the rail gives less than the brake asks for."""
    mean, rotating = bank.mean, config.train.rotating_mass_fraction
    needed = (mean[:, BRAKE] * braking.applied - rotating * resisting) / (1.0 + rotating)
    rail = mean[:, MU] * (1.0 + mean[:, ROUGH])
    free = bank.kind == FREE
    slides = SLIDES[bank.kind] & ((rail < needed) | (braking.told > 0.0))
    sliding = np.where(slides, braking.share, 0.0)
    slope = np.zeros(mean.shape)
    slope[:, MU] = np.where(free, 1.0, sliding * (1.0 + mean[:, ROUGH]))
    slope[:, ROUGH] = sliding * mean[:, MU]
    held = np.where(free, 0.0, (1.0 - sliding) / (1.0 + rotating))
    slope[:, BRAKE] = held * braking.applied
    slope[:, SPEED] = -held * rotating * config.train.resistance_slope(mean[:, SPEED])
    return Use(np.where(free, mean[:, MU], sliding * rail + (1.0 - sliding) * needed), slope, slides)


def moved(config: Config, bank: Bank, dt_s: float, braking: Braking, declared_m: float) -> Bank:
    """The beliefs after `dt_s`; `declared_m` is the standard deviation that the positions declare."""
    mean, speed = bank.mean, bank.mean[:, SPEED]
    resisting = resistance(config, bank)
    used = use(config, bank, braking, resisting)
    slower = speed - dt_s * GRAVITY * (used.value + resisting + mean[:, GRADE])
    lasting, noise = _lasting(config, bank, slower, dt_s, declared_m)
    if braking.rising:
        noise[:, SPEED] += np.square(BUILDING_UP * GRAVITY * used.value) * dt_s
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


def open_variance(config: Config, bank: Bank) -> Array:
    """Variance of what profile and papers leave open of grade and running resistance, shape (H,)."""
    resisting = config.train.specific_resistance(bank.mean[:, SPEED])
    return np.asarray(config.grade_error**2 + np.square(config.resistance_std * resisting))


def white_variance(bank: Bank, declared_m: float) -> Array:
    """Variance of the positions' white part, m^2, shape (H,)."""
    return np.asarray(np.square(np.maximum(kinds.WHITE[:, 0] * declared_m, kinds.WHITE[:, 1]))[bank.noise])


def slow_variance(bank: Bank, declared_m: float) -> Array:
    """Variance of their slow part."""
    return np.asarray(np.square(np.maximum(kinds.SLOW[:, 0] * declared_m, kinds.SLOW[:, 1]))[bank.noise])


def _lasting(config: Config, bank: Bank, slower: Array, dt_s: float, declared_m: float) -> tuple[Array, Array]:
    """What lasts of each component over a step, and the variance that is added, shapes (H, SIZE)."""
    kind, speed = bank.kind, bank.mean[:, SPEED]
    way_m = np.maximum(speed, 0.1) * dt_s
    by_law = [law(slower) / law(speed) for law, _ in laws_of(config)]
    free = np.exp(-dt_s / kinds.FREE_S)
    lasting, noise = np.ones(bank.mean.shape), np.zeros(bank.mean.shape)
    lasting[:, MU] = np.where(kind == FREE, free, np.where(SLIDES[kind], np.choose(bank.law, by_law), 1.0))
    lasting[:, ROUGH] = np.exp(-way_m / kinds.ROUGHNESS_M)
    lasting[:, GRADE] = np.exp(-way_m / kinds.GRADE_M)
    lasting[:, OFFSET] = np.exp(-dt_s / kinds.LASTS[bank.noise])
    drift = np.square(kinds.DRIFT[kind] * bank.mean[:, MU]) * dt_s
    noise[:, POSITION] = config.motion.position_noise_rate * dt_s
    noise[:, SPEED] = np.square(kinds.RESTLESSNESS[kind]) * dt_s
    noise[:, MU] = np.where(kind == FREE, kinds.FREE_STD**2 * (1.0 - free**2), drift)
    noise[:, ROUGH] = np.square(kinds.ROUGHNESS[kind]) * (1.0 - lasting[:, ROUGH] ** 2)
    noise[:, BRAKE] = config.brake_drift**2 * dt_s
    noise[:, GRADE] = open_variance(config, bank) * (1.0 - lasting[:, GRADE] ** 2)
    noise[:, OFFSET] = slow_variance(bank, declared_m) * (1.0 - lasting[:, OFFSET] ** 2)
    noise[:, BIAS] = BIAS_DRIFT**2 * dt_s
    return lasting, noise
