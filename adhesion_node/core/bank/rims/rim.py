# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What one rim's speed does to the belief where it rolls, is no faster than the train, or is as fast or slides."""

from __future__ import annotations

import math

import numpy as np

from ..gear.wander import Rolled
from ..layout import RADIUS, SCALE, SPEED, Bank
from ..seeing import CLIPPED, corrected, speed_seen

ROLLING_SHARE, FASTEST_SHARE = 0.02, 0.008
"""Error of the rims' speed, relative: of the middle one while no brake is applied, of the fastest under the brake."""

CREEP = 0.002
"""By how much the fastest rim is slower than the train while it rolls."""

SLIDES = 0.2
"""Density of what a rim shows where it slides, times its error: slides last, so the next sample tells nothing new."""

FEW = 6
"""Rims heard; of fewer the fastest slides the likelier, the fewer they are, and where it creeps no other shows it."""

TINY = 1e-12
"""Variance of a scale that is known."""

UNSEEN = 1e12
"""Variance of what is not seen."""


def rim_speed(bank: Bank) -> tuple[float, float]:
    """Speed of a rim that rolls, as radii are expected, and its standard deviation, m/s."""
    mean, covariance = bank.moments()
    slope = np.array([1.0 + mean[RADIUS], mean[SPEED]])
    both = covariance[np.ix_((SPEED, RADIUS), (SPEED, RADIUS))]
    return float(slope[0] * mean[SPEED]), math.sqrt(max(float(slope @ both @ slope), 0.0))


def rolled_of(bank: Bank) -> Rolled:
    """What radii are while axles roll: where they were learnt by measured speeds they go with the scale of these."""
    mean, covariance = bank.moments()
    by_scale = covariance[RADIUS, SCALE] / max(covariance[SCALE, SCALE], TINY)
    own = covariance[RADIUS, RADIUS] - by_scale * covariance[RADIUS, SCALE]
    return Rolled(float(mean[RADIUS]), float(own), float(by_scale), float(mean[SCALE]))


def as_rolled(bank: Bank, rolled: Rolled | None) -> Bank:
    """Where axles have slid: radii are again what they were, and their variance, before all of them crept."""
    if rolled is None:
        return bank
    mean, covariance = bank.mean.copy(), bank.covariance.copy()
    mean[:, RADIUS] = rolled.radius + rolled.by_scale * (mean[:, SCALE] - rolled.scale)
    along = rolled.by_scale * covariance[:, SCALE]
    covariance[:, RADIUS, :] = covariance[:, :, RADIUS] = along
    covariance[:, RADIUS, RADIUS] = rolled.variance + rolled.by_scale * along[:, SCALE]
    return bank._replace(mean=mean, covariance=covariance)


def rolling(bank: Bank, rim_mps: float) -> Bank:
    """Take in the speed of the middle rim while no brake is applied. The weights are not normalised.

    How far radii matter is told by what is measured, as the speed may be hardly known.
    """
    seen = speed_seen(bank, rim_mps, (ROLLING_SHARE * rim_mps) ** 2, RADIUS)
    seen.slope[:, RADIUS] = rim_mps / (1.0 + bank.mean[:, RADIUS])
    return corrected(bank, seen)


def not_slower(bank: Bank, rim_mps: float, std: float) -> Bank:
    """Take in that no rim is faster than the train but for an error, m/s: only what contradicts it is corrected."""
    seen = speed_seen(bank, rim_mps, std**2, RADIUS)
    slower = seen.innovation > 0.0
    after = corrected(bank, seen._replace(variance=np.where(slower, std**2, UNSEEN)))
    squared = np.minimum(seen.innovation / std, CLIPPED) ** 2
    return after._replace(log_weight=bank.log_weight - np.where(slower, 0.5 * squared, 0.0))


def as_fast(bank: Bank, rim_mps: float, error: float, slides: float = SLIDES) -> Bank:
    """Take in that a rim is as fast as the train but for an error, m/s, or slides.

    Each Gaussian becomes the one with the moments of both (probabilistic data association, Bar-Shalom and Tse 1975).
    The weights are not normalised.
    """
    seen = speed_seen(bank, rim_mps * (1.0 + CREEP), error**2, RADIUS)
    gain = np.einsum("hij,hj->hi", bank.covariance, seen.slope)
    std = np.sqrt(np.einsum("hi,hi->h", gain, seen.slope) + error**2)
    off, gain = seen.innovation / std, gain / std[:, None]
    rolled = np.exp(-0.5 * off**2) / (math.sqrt(2.0 * math.pi) * std)
    total = rolled + slides / error
    part = rolled / total
    narrower = part * (1.0 - (1.0 - part) * off**2)
    return bank._replace(
        mean=bank.mean + gain * (part * off)[:, None],
        covariance=bank.covariance - narrower[:, None, None] * gain[:, :, None] * gain[:, None, :],
        log_weight=bank.log_weight + np.log(total),
    )


def slides_of(count: int) -> float:
    """Density of what the fastest of so many rims shows where it slides."""
    return SLIDES * max(FEW / count, 1.0)
