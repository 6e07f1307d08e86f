# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the sensors say: each observation corrects every hypothesis and weighs it by how well it had foreseen it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import ndtr

from ..physics.train import GRAVITY, Array
from .kernels import weighing
from .kernels.moving import BUILDING_UP
from .labels.kinds import OTHER, SLIDES
from .layout import BIAS, BRAKE, MU, PITCH, ROUGH, SCALE, SPEED, Bank
from .motion import Braking, resistance, rolling_use, use

if TYPE_CHECKING:
    from ..config import Config

CLIPPED = 3.5
"""Deviation in standard deviations from which an observation pulls no harder (Huber), as tails are heavier."""

STEADY_ERROR, SWINGING = 0.002, 1.9
"""What an accelerometer feels beside what is used in the mean: over g, and over the swing of that."""

ROLLED, SLID = (0.85, 1.15), (1.0, 0.9)
"""Parts of what the brake needs, and of what sliding axles use, between which adhesion lies where wheels roll or slide:
rolling ones could use a seventh more than sliding ones, and some axles slide before the others."""

PRESSED, DEEP, LEAST_LIKELY = 0.15, 0.6, 1e-4
"""Error of the brake's force while axles begin to slide, over that of the demand; part of it up to which what falling
rims leave to be used tells more than that they slide; and its least probability, where a hypothesis says that it is
more."""


class Observation(NamedTuple):
    """A scalar that was measured, against what each hypothesis had foreseen; shapes (H,) and (H, SIZE)."""

    innovation: Array
    slope: Array
    variance: Array | float

    @property
    def variances(self) -> Array:
        """Of each hypothesis."""
        same = isinstance(self.variance, float)
        return np.full(self.innovation.size, self.variance) if same else np.asarray(self.variance)


def speed_seen(bank: Bank, speed_mps: float, variance: float, scale: int = SCALE) -> Observation:
    """A speed, whose scale may be wrong; the error of that is the component `scale`."""
    slope = np.zeros(bank.mean.shape)
    slope[:, SPEED] = 1.0 + bank.mean[:, scale]
    slope[:, scale] = bank.mean[:, SPEED]
    return Observation(speed_mps - slope[:, SPEED] * bank.mean[:, SPEED], slope, variance)


def acceleration_seen(
    config: Config, bank: Bank, acceleration_mps2: float, variance: float, braking: Braking
) -> Observation:
    """An accelerometer along the train: it feels brake and resistance, not the grade; under the brake it pitches."""
    resisting = config.train.specific_resistance(bank.mean[:, SPEED])
    used, error = use(config, bank, braking, resisting), BUILDING_UP if braking.rising else SWINGING * config.ripple
    felt, pitched = -(used.value + resisting), 1.0 + bank.mean[:, PITCH]
    slope = -used.slope * pitched[:, None]
    slope[:, PITCH] += felt
    slope[:, BIAS] = 1.0
    filling = np.where(used.slope[:, BRAKE] > 0.0, BUILDING_UP * bank.mean[:, BRAKE] * braking.filling, 0.0)
    innovation = acceleration_mps2 / GRAVITY - felt * pitched - bank.mean[:, BIAS]
    unsteady = STEADY_ERROR**2 + np.square(error * used.value) + np.square(filling)
    return Observation(innovation, slope, variance / GRAVITY**2 + unsteady)


def corrected(bank: Bank, seen: Observation) -> Bank:
    """Take an observation in; the weights are not normalised."""
    before = bank.mean, bank.covariance, bank.log_weight
    return bank.believing(*weighing.corrected(*before, seen.innovation, seen.slope, seen.variances, CLIPPED))


def considered(before: Bank, bank: Bank, component: int) -> Bank:
    """The bank with a component as it was known before: it is considered, not estimated (Schmidt 1966)."""
    bank.mean[:, component] = before.mean[:, component]
    bank.covariance[:, component, component] = before.covariance[:, component, component]
    return bank


def wheels_seen(config: Config, bank: Bank, braking: Braking, elapsed_s: float) -> Bank:
    """Take in that wheels were seen to slide, or to roll: adhesion is below, or above, what the brake needs.

    The weights are not normalised.
    """
    mean, times = bank.mean, math.exp(elapsed_s * braking.told)
    part, more = SLID if braking.told > 0.0 else ROLLED
    slope = np.zeros(mean.shape)
    slope[:, BRAKE] = part * braking.applied / (1.0 + config.train.rotating_mass_fraction)
    slope[:, MU], slope[:, ROUGH] = -more * (1.0 + mean[:, ROUGH]), -more * mean[:, MU]
    short = part * rolling_use(config, bank, braking) + slope[:, MU] * mean[:, MU]
    slides = np.where(SLIDES[bank.kind], times - 1.0, 0.0)
    seen, more = _above(bank, short, slope, 0.0, 1.0, slides), max(elapsed_s * braking.told, 0.0)
    return seen._replace(log_weight=seen.log_weight + more * (bank.kind == OTHER))  # it makes them slide, or none does


def fall_seen(config: Config, bank: Bank, braking: Braking, fall_mps2: float) -> Bank:
    """Take in that all rims fall so fast: what the brake presses with beyond what the rail gives slows them down.

    No more than the rest can be used: cylinders may have been let go, or other rims fall faster. It is of use where
    that is far less than the brake asks for. The weights are not normalised.
    """
    turned, brake = fall_mps2 / GRAVITY, braking.applied
    turning = min(config.train.rotating_mass_fraction * turned, brake)
    if brake - turning > DEEP * brake:
        return bank
    used = use(config, bank, braking, resistance(config, bank))
    slope = -used.slope
    slope[:, BRAKE] += brake
    variance = (config.rotating_mass_std * turned) ** 2 + (PRESSED * brake) ** 2
    return _above(bank, bank.mean[:, BRAKE] * brake - turning - used.value, slope, variance, LEAST_LIKELY, 1.0)


def _above(bank: Bank, value: Array, slope: Array, variance: float, least: float, more: Array | float) -> Bank:
    """Take in that a value, measured so well, is above 0: it is so with the likelihood `least` + `more`, else `least`.

    Each Gaussian becomes the one with the moments of what is left of it.
    """
    gain = np.einsum("hij,hj->hi", bank.covariance, slope)
    std = np.sqrt(np.maximum(np.einsum("hi,hi->h", gain, slope) + variance, 1e-12))
    off = value / std
    total = least + more * ndtr(off)
    pull = more * np.exp(-0.5 * off**2) / math.sqrt(2.0 * math.pi) / total
    gain /= std[:, None]
    return bank._replace(
        mean=bank.mean + gain * pull[:, None],
        covariance=bank.covariance - (pull * (pull + off))[:, None, None] * gain[:, :, None] * gain[:, None, :],
        log_weight=bank.log_weight + np.log(total),
    )
