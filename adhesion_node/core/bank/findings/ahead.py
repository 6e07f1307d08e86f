# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What may be counted on along the way to a standstill: the adhesion that the safe curve takes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...belief.rail import Rail
from ...physics.adhesion import AdhesionLaw
from ...physics.train import Array, Train
from ...setting import once
from ..blind import STANDS_MPS
from ..gear.slides import HINTED
from ..kernels import mixture, weighing
from ..labels import kinds
from ..layout import BRAKE, SPEED, Bank
from ..memory import Memory, S
from ..motion import Braking, Use, model_of, resistance, use
from ..seeing import ROLLED

if TYPE_CHECKING:
    from ...config import Config

SPEEDS_AHEAD = np.linspace(0.0, 1.0, 6)
"""Parts of the present speed at which adhesion is foreseen."""

DRIFT_AHEAD = 0.02
"""Most drift that is counted on ahead: a border will have been passed."""

LEAST_AHEAD = 0.002
"""Adhesion less grade ahead counts as no less."""

LOWEST_PART, LIKELIER = 0.5, 0.05
"""Part of `lowest_mu` that hardly any rail is below, as that holds with 95 % of any: less counts ahead once it is so
probable, as the tails of what has only just come to mind reach down to nothing."""

AHEAD_M, NEAR = 2000.0, 0.375
"""Over which way the adhesion, or the brake's force, comes to differ by `ahead_std`, and what share of that the mean of
the shortest way may differ by."""

COUNTED_RISE = 0.5
"""Power of what a law promises for lower speeds that is counted on: slide protection uses less of it."""

KNOWN_SHARE = 0.6
"""Of the chance that the bound or the safe curve may fail, what is left to all that the hypotheses know of; the rest is
for what they do not."""

FAILS = 0.7
"""Probability from which a rail that has gone on losing adhesion is counted on to do so ahead."""

PARTIAL = 0.8
"""Part of the full brake below which adhesion may be more than it shows: what was known before still holds."""

UNTOLD = 4.0
"""Times its odds sliding since the brake was applied counts for the way ahead while neither wheels nor slide protection
tell of it: as if it had been as likely as rolling, so that nothing but what is measured since speaks for the brake."""

LOST, LOST_MPS = 1.5, 5.0
"""A speed is lost where the train may be so many times as fast as told, and by so much."""

NOTHING = -1.0
"""No adhesion is so low: the floor alone counts."""

BORNE_OUT_S, BORNE_OUT, BORDER = 2.0, 0.1, 0.2
"""A change of the rail counts for the way ahead after so long, once it is so probable, or once all that are so young
prevail; before its border is passed, if all that say so are so probable together."""


class Ahead(NamedTuple):
    """Adhesion, less what an unknown grade may take away, that the way to a standstill does not fall below."""

    speed_mps: tuple[float, ...]
    """Rising from 0 to the present speed."""
    mu: tuple[float, ...]
    floor: float = 0.0
    """No less than this, ..."""
    share: float = 1.0
    """... of what slows the train down by which such a part counts: it may be faster than told, and needs more way."""

    def against(self, train: Train, resistance: Array | float) -> AdhesionLaw:
        """Adhesion at speeds, element by element, where resistance and grade, over the weight, slow the train, too.

        The fastest train that there may be uses no more than its brake does.
        """
        floor = train.used_adhesion(self.floor, train.full_brake, resistance)
        least = self.share * (floor + resistance) - resistance
        return lambda speed_mps: np.maximum(np.interp(speed_mps, self.speed_mps, self.mu), least)

    def at_least(self, other: Ahead) -> Ahead:
        """No less than the floor of another one."""
        return self._replace(floor=other.floor, share=other.share)


def constant(mu: float) -> Ahead:
    """The same at any speed."""
    return Ahead((0.0,), (max(mu, 0.0),))


def counted_on(
    config: Config, bank: Bank, missed: float, braking: Braking, known: Rail, used: Use | None = None
) -> Ahead:
    """Quantile of adhesion and grade ahead, at each of some speeds down to a standstill.

    What is known of roughness and grade here fades along the way, and the way takes the mean of them. Axles that roll
    under a part of the brake leave the bound as it was `known` when the braking began, as far as the whole brake can
    use it: that may make them slide.
    `used` is what each hypothesis uses now, if that is at hand.
    """
    used = use(config, bank, braking, resistance(config, bank)) if used is None else used
    weight, partial = bank.weight, is_partial(config, braking, float(bank.weight @ used.value))
    speeds = _speeds_ahead(bank)
    if not (partial or braking.is_sure):
        weight = weight * np.where(used.slides & np.isneginf(bank.born_s), UNTOLD, 1.0)
        weight /= weight.sum()
    borne, least = (ROLLED[0] / ROLLED[1], min(known.lower, surely(config, bank))) if partial else (1.0, 0.0)
    asked = mixture.Asked(float(missed), borne, float(least), LOWEST_PART * config.lowest_mu, LIKELIER)
    rule = _ahead_of(config)
    if float(bank.weight @ (kinds.GROWTH[bank.kind] < 0.0)) < FAILS:
        rule = rule._replace(growth=np.zeros_like(rule.growth))
    low = mixture.counted_on(rule, bank, weight, used, speeds, asked)
    return Ahead(tuple(speeds.tolist()), tuple(low.tolist()))


def borne_out(memory: Memory) -> Bank:
    """Without what has only just come to mind: that the rail may change this moment is always possible."""
    bank = memory.bank
    age_s, limits = memory.t_ns / S - bank.born_s, (BORNE_OUT_S, BORNE_OUT, kinds.PASSING, BORDER)
    return bank._replace(log_weight=weighing.borne_out(bank.log_weight, age_s, bank.kind, *limits))


def unfelt(config: Config, bank: Bank, lower: float) -> Ahead:
    """A bound of any speed: who brakes by it leaves room for the error of the speed, but not for one that is lost."""
    lower = min(lower, surely(config, bank))
    floor, is_lost = for_the_fastest(config, bank, lower)
    return floor if is_lost else constant(lower)


def for_the_fastest(config: Config, bank: Bank, mu: float) -> tuple[Ahead, bool]:
    """Adhesion that stops the fastest train there may be, told as the slower one needs it for the same way, v^2 / 2a.

    And whether the speed is lost: what is counted on ahead holds for errors that are small beside it.
    """
    std, missed = np.sqrt(bank.covariance[:, SPEED, SPEED]), KNOWN_SHARE * (1.0 - config.curve_confidence)
    fastest = float(quantiles(bank.weight, bank.mean[:, SPEED], std, (1.0 - missed,)).item())
    told = max(abs(float(bank.weight @ bank.mean[:, SPEED])), STANDS_MPS)
    is_lost = fastest > LOST * told and fastest - told > LOST_MPS
    return Ahead((0.0,), (NOTHING,), mu, (told / max(fastest, told)) ** 2), is_lost


def surely(config: Config, bank: Bank) -> float:
    """What the whole brake surely asks for, by what is known of its force; of a strong one what its papers say."""
    std, missed = np.sqrt(bank.covariance[:, BRAKE, BRAKE]), KNOWN_SHARE * (1.0 - config.curve_confidence)
    factor = float(quantiles(bank.weight, bank.mean[:, BRAKE], std, (missed,)).item())
    return min(max(factor, 0.0), 1.0) * config.train.full_brake


def is_partial(config: Config, braking: Braking, used: float) -> bool:
    """Whether axles may roll under a part of the brake, by what presses and by what is `used`, of another one, too."""
    return max(braking.applied, used) < PARTIAL * config.train.full_brake and not braking.told > HINTED


def _speeds_ahead(bank: Bank) -> Array:
    """From 0 to the present speed."""
    return np.asarray(float(bank.weight @ np.maximum(bank.mean[:, SPEED], 1.0)) * SPEEDS_AHEAD)


@once
def _ahead_of(config: Config) -> mixture.Ahead:
    return mixture.Ahead(
        rough=np.square(kinds.roughness_of(config)),
        fading=kinds.FADING,
        drift=np.square(np.minimum(kinds.DRIFT, DRIFT_AHEAD)),
        growth=np.minimum(kinds.GROWTH, 0.0),
        grade_m=kinds.RESIDUAL_M,
        resistance=np.array(config.train.resistance_si),
        grade_error=float(config.grade_error),
        resistance_error=float(config.resistance_std),
        error=float(config.ahead_std),
        error_m=AHEAD_M,
        near=NEAR,
        laws=model_of(config).laws,
        rise=COUNTED_RISE,
        least=LEAST_AHEAD,
    )


def quantiles(weights: Array, means: Array, stds: Array, probabilities: Sequence[float]) -> Array:
    """Quantiles of mixtures of Gaussians.

    `weights` has the shape (H,), `means` and `stds` (..., H); the result (..., P) for P probabilities.
    """
    mean, std = (np.ascontiguousarray(np.atleast_2d(each)) for each in (means, stds))
    rows = mixture.quantiles(weights, mean, std, np.array(probabilities))
    return rows.reshape(*means.shape[:-1], len(probabilities))
