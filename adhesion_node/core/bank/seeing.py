# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What the sensors say: each observation corrects every hypothesis and weighs it by how well it had foreseen it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..physics.train import GRAVITY, Array
from .kernels import weighing
from .layout import BIAS, OFFSET, PITCH, POSITION, SCALE, SPEED, Bank
from .motion import BUILDING_UP, Braking, use, white_variance

if TYPE_CHECKING:
    from ..config import Config

CLIPPED = 3.5
"""Deviation in standard deviations from which an observation pulls no harder (Huber), as tails are heavier."""

UNSEEN = 1e12
"""Variance of what is not seen."""

STEADY_ERROR, BRAKING_ERROR = 0.002, 0.06
"""What an accelerometer feels beside the mean brake: over g, and over the adhesion used, as axles slide in turns."""


class Observation(NamedTuple):
    """A scalar that was measured, against what each hypothesis had foreseen; shapes (H,) and (H, SIZE)."""

    innovation: Array
    slope: Array
    variance: Array | float

    def apart(self, bank: Bank) -> Array:
        """Innovations in standard deviations, shape (H,)."""
        foreseen = weighing.variances(self.slope, bank.covariance)
        result: Array = np.abs(self.innovation) / np.sqrt(foreseen + self.variance)
        return result


def position_seen(bank: Bank, position_m: float, declared_m: float) -> Observation:
    """A position, whose declared standard deviation is only a hint."""
    slope = np.zeros(bank.mean.shape)
    slope[:, POSITION] = slope[:, OFFSET] = 1.0
    foreseen = bank.mean[:, POSITION] + bank.mean[:, OFFSET]
    return Observation(position_m - foreseen, slope, white_variance(bank, declared_m))


def speed_seen(bank: Bank, speed_mps: float, variance: float) -> Observation:
    """A speed, whose scale may be wrong."""
    slope = np.zeros(bank.mean.shape)
    slope[:, SPEED] = 1.0 + bank.mean[:, SCALE]
    slope[:, SCALE] = bank.mean[:, SPEED]
    return Observation(speed_mps - slope[:, SPEED] * bank.mean[:, SPEED], slope, variance)


def acceleration_seen(
    config: Config, bank: Bank, acceleration_mps2: float, variance: float, braking: Braking
) -> Observation:
    """An accelerometer along the train: it feels brake and resistance, not the grade; under the brake it pitches."""
    resisting = config.train.specific_resistance(bank.mean[:, SPEED])
    used, error = use(config, bank, braking, resisting), BUILDING_UP if braking.rising else BRAKING_ERROR
    felt, pitched = -(used.value + resisting), 1.0 + bank.mean[:, PITCH]
    slope = -used.slope * pitched[:, None]
    slope[:, PITCH] += felt
    slope[:, BIAS] = 1.0
    innovation = acceleration_mps2 / GRAVITY - felt * pitched - bank.mean[:, BIAS]
    return Observation(innovation, slope, variance / GRAVITY**2 + STEADY_ERROR**2 + (error * used.value) ** 2)


def corrected(bank: Bank, seen: Observation) -> Bank:
    """Take an observation in; the weights are not normalised."""
    variance = seen.variance + np.zeros(seen.innovation.size)
    mean, covariance, log_weight = weighing.corrected(bank, seen.innovation, seen.slope, variance, CLIPPED)
    return bank._replace(mean=mean, covariance=covariance, log_weight=log_weight)


def not_slower(bank: Bank, rim_mps: float, std_mps: float) -> Bank:
    """Take in that under the brake no rim is faster than the train: only what contradicts it is corrected."""
    seen = speed_seen(bank, rim_mps, std_mps**2)
    slower = seen.innovation > 0.0
    after = corrected(bank, seen._replace(variance=np.where(slower, std_mps**2, UNSEEN)))
    squared = np.minimum(seen.innovation / std_mps, CLIPPED) ** 2
    return after._replace(log_weight=bank.log_weight - np.where(slower, 0.5 * squared, 0.0))
