# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the wheels tell of the train's speed: unbraked they roll, under the brake the fastest mostly does."""

from __future__ import annotations

import math

import numpy as np

from .layout import RADIUS, SPEED, Bank
from .seeing import CLIPPED, corrected, speed_seen

ROLLING_SHARE, FASTEST_SHARE = 0.02, 0.008
"""Error of the rims' speed, relative: of the middle one while no brake is applied, of the fastest under the brake."""

CREEP = 0.002
"""By how much the fastest rim is slower than the train while it rolls."""

ROLLS = 0.006
"""Error of the fastest rim's speed under the brake where it rolls, relative."""

SLIDES = 0.2
"""Density of what it shows where it slides, times that error: slides last, so the next sample tells nothing new."""

UNSEEN = 1e12
"""Variance of what is not seen."""


def rim_speed(bank: Bank) -> tuple[float, float]:
    """Speed of a rim that rolls, as radii are expected, and its standard deviation, m/s."""
    mean, covariance = bank.moments()
    slope = np.array([1.0 + mean[RADIUS], mean[SPEED]])
    both = covariance[np.ix_((SPEED, RADIUS), (SPEED, RADIUS))]
    return float(slope[0] * mean[SPEED]), math.sqrt(max(float(slope @ both @ slope), 0.0))


def rolling(bank: Bank, rim_mps: float) -> Bank:
    """Take in the speed of the middle rim while no brake is applied. The weights are not normalised."""
    return corrected(bank, speed_seen(bank, rim_mps, (ROLLING_SHARE * rim_mps) ** 2, RADIUS))


def not_slower(bank: Bank, rim_mps: float) -> Bank:
    """Take in that under the brake no rim is faster than the train: only what contradicts it is corrected."""
    std = FASTEST_SHARE * rim_mps
    seen = speed_seen(bank, rim_mps, std**2, RADIUS)
    slower = seen.innovation > 0.0
    after = corrected(bank, seen._replace(variance=np.where(slower, std**2, UNSEEN)))
    squared = np.minimum(seen.innovation / std, CLIPPED) ** 2
    return after._replace(log_weight=bank.log_weight - np.where(slower, 0.5 * squared, 0.0))


def as_fast(bank: Bank, rim_mps: float) -> Bank:
    """Take in that the fastest rim under the brake is as fast as the train, or slides.

    Each Gaussian becomes the one with the moments of both (probabilistic data association, Bar-Shalom and Tse 1975).
    The weights are not normalised.
    """
    error = ROLLS * rim_mps
    seen = speed_seen(bank, rim_mps * (1.0 + CREEP), error**2, RADIUS)
    gain = np.einsum("hij,hj->hi", bank.covariance, seen.slope)
    std = np.sqrt(np.einsum("hi,hi->h", gain, seen.slope) + error**2)
    off, gain = seen.innovation / std, gain / std[:, None]
    rolls = np.exp(-0.5 * off**2) / (math.sqrt(2.0 * math.pi) * std)
    total = rolls + SLIDES / error
    part = rolls / total
    narrower = part * (1.0 - (1.0 - part) * off**2)
    return bank._replace(
        mean=bank.mean + gain * (part * off)[:, None],
        covariance=bank.covariance - narrower[:, None, None] * gain[:, :, None] * gain[:, None, :],
        log_weight=bank.log_weight + np.log(total),
    )
