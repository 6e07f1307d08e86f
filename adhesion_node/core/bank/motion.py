# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How the beliefs move on: dv/dt = -g (u + r(s, v) + gamma), with the adhesion u that is used, and decaying errors.

    u = mu (1 + rho)                                where the adhesion limits
    u = (beta B - rotating r)/(1 + rotating)        where the brake does
    u = f mu (1 + rho) + (1 - f) beta B ...         where the share f of the axles slides

Of beta B the axles that roll then use no more than half as much again as those that slide.
Roughness rho and grade gamma fade with the way, a swing rho and the slow error of the positions with time.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..physics.train import GRAVITY, Array
from ..setting import once
from .gear.radii import UNLEARNT
from .gear.slides import HINTED
from .kernels import moving
from .kernels.weighing import variances
from .labels import kinds, noises
from .labels.kinds import SLIDES
from .labels.laws import laws_of
from .layout import BRAKE, POSITION, SPEED, Bank, Mask

if TYPE_CHECKING:
    from ..config import Config

STRONGER, LEAST_BRAKE_ERROR = 2.0, 0.1
"""Errors of the brake, of such a size at least, by which the train is braked harder than by what is known to press."""

SLOWED, ANOTHER = 0.01, 1.5
"""Net deceleration over g from which, surely, another brake is at work while the gauge shows none; and times the full
brake, by what is told of it, that is used at most where one is."""

BIAS_DRIFT = 1e-4
"""Of an accelerometer's bias over g, within 1 s."""

RADIUS_DRIFT = 3e-4
"""Of what the rims are too fast by, within 1 s: they creep a little as traction changes."""


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
    filling: float = 0.0
    """B/(M g) that they will press with once they have filled, or what counts as that; 0: they have, or it is seen."""
    alone: bool = False
    """Whether nothing but a gauge of cylinders tells of the brake: another one may be at work beside."""

    @property
    def is_sure(self) -> bool:
        """Whether that is known of the train, not hinted at by a single axle."""
        return abs(self.told) > HINTED


class Use(NamedTuple):
    """Adhesion that is used, shape (H,), and its derivatives with respect to the state, shape (H, SIZE)."""

    value: Array
    slope: Array
    slides: Mask
    """Whether the adhesion limits, shape (H,)."""
    resisting: Array
    """The resistance at which, N/N, shape (H,)."""

    def std(self, config: Config, bank: Bank) -> Array:
        """Standard deviations, shape (H,): it swings, whether a hypothesis says so or not."""
        swing = np.where(kinds.SWINGS[bank.kind], 0.0, config.ripple * self.value)
        return np.asarray(np.sqrt(np.maximum(variances(self.slope, bank.covariance) + np.square(swing), 1e-12)))


def resistance(config: Config, bank: Bank) -> Array:
    """Resistance of train and track per weight, N/N, shape (H,)."""
    return config.motion.resistance(bank.mean[:, POSITION], bank.mean[:, SPEED])


def use(config: Config, bank: Bank, braking: Braking, resisting: Array) -> Use:
    """Adhesion used under each hypothesis: axles slide where the rail gives less than the brake asks for."""
    return Use(*moving.used(model_of(config)[:], bank[:], resisting, (0.0, *braking, 0.0)), resisting)


def slowing(config: Config, bank: Bank, braking: Braking) -> float:
    """By how much the train slows down under the brake, m/s^2, on the mean of all hypotheses."""
    resisting = resistance(config, bank)
    return GRAVITY * float(bank.weight @ (use(config, bank, braking, resisting).value + resisting))


def rolling_use(config: Config, bank: Bank, braking: Braking) -> Array:
    """Adhesion that the brake asks for where every axle rolls, shape (H,)."""
    rotating = config.train.rotating_mass_fraction
    needed = bank.mean[:, BRAKE] * braking.applied - rotating * resistance(config, bank)
    return np.asarray(needed / (1.0 + rotating))


def moved(config: Config, bank: Bank, dt_s: float, braking: Braking, declared_m: float) -> Bank:
    """The beliefs after `dt_s`; `declared_m` is the standard deviation that the positions declare."""
    mean, covariance = moving.moved(model_of(config)[:], bank[:], (dt_s, *braking, declared_m))
    return bank.believing(mean, covariance, bank.log_weight)


class Foreseen(NamedTuple):
    """How far a measured position is off what was foreseen; nothing, if none was."""

    metres: float = 0.0
    std_m: float = 1.0
    """Standard deviation of that over all hypotheses."""
    nearest: float = 0.0
    """In standard deviations, without sign, by the hypothesis nearest."""
    bank: Bank | None = None
    """What was foreseen."""
    tells: bool = True
    """Whether it tells of a sliding wheel: while positions may have stepped they do not."""

    @property
    def stds(self) -> float:
        """In standard deviations by the hypothesis nearest."""
        return math.copysign(self.nearest, self.metres)


def foreseen(
    config: Config,
    bank: Bank,
    dt_s: float,
    braking: Braking,
    declared_m: float,
    position_m: float,
    variances: Array,
) -> Foreseen:
    """As `moved`, and how far a position is off; `variances` are those of its white part by the label `noise`."""
    step = (dt_s, *braking, declared_m)
    mean, covariance, metres, std_m, nearest = moving.foreseen(
        model_of(config)[:], bank[:], step, position_m, variances
    )
    return Foreseen(metres, std_m, nearest, bank.believing(mean, covariance, bank.log_weight))


@once
def model_of(config: Config) -> moving.Model:
    """What the kernels need to know of train, track and labels."""
    train = config.train
    breaks, levels = config.track.steps
    most = np.where(np.arange(kinds.FREE_S.size) == kinds.OTHER, ANOTHER * train.full_brake, np.inf)
    return moving.Model(
        rotating=float(train.rotating_mass_fraction),
        resistance=np.array(train.resistance_si),
        breaks=breaks,
        levels=levels,
        laws=np.array([(law.floor, law.gain_kmh, law.offset_kmh, law.scale) for law, _ in laws_of(config)]),
        kinds=np.column_stack(
            (SLIDES.astype(np.float64), kinds.DRIFT, kinds.roughness_of(config), kinds.RESTLESSNESS, kinds.GROWTH)
        ),
        noises=np.column_stack((noises.WHITE, noises.SLOW, noises.LASTS)),
        fading=kinds.FADING,
        grade_m=kinds.grade_m_of(config),
        free=np.column_stack((kinds.FREE_S, most)),
        free_std=kinds.FREE_STD,
        rates=np.array([config.motion.position_noise_rate, config.brake_drift**2, BIAS_DRIFT**2, RADIUS_DRIFT**2]),
        unlearnt=np.square([max(config.brake_error, LEAST_BRAKE_ERROR), UNLEARNT]),
        grade_error=float(config.grade_error),
        resistance_error=float(config.resistance_std),
        strongest=1.0 + STRONGER * max(config.brake_error, LEAST_BRAKE_ERROR),
    )


def open_variance(config: Config, bank: Bank) -> Array:
    """Variance of what profile and papers leave open of grade and running resistance, shape (H,)."""
    resisting = config.train.specific_resistance(bank.mean[:, SPEED])
    return np.asarray(config.grade_error**2 + np.square(config.resistance_std * resisting))


def white_variance(bank: Bank, declared_m: float, rounded_m: float = 0.0) -> Array:
    """Variance of the positions' white part, m^2, shape (H,)."""
    return white_variances(declared_m, rounded_m)[bank.noise]


@lru_cache(maxsize=64)  # a receiver mostly declares the same
def white_variances(declared_m: float, rounded_m: float = 0.0) -> Array:
    """The same by the label `noise`, shape (N,), where so much is rounded off at least."""
    least_m = np.maximum(noises.WHITE[:, 1], rounded_m)
    return np.asarray(np.square(np.maximum(noises.WHITE[:, 0] * declared_m, least_m)))


def slow_variance(bank: Bank, declared_m: float) -> Array:
    """Variance of their slow part."""
    return np.asarray(np.square(np.maximum(noises.SLOW[:, 0] * declared_m, noises.SLOW[:, 1]))[bank.noise])
