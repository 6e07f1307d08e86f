# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a bank foresees of the way ahead in NumPy, all hypotheses at once: what compiled loops are held against."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy_bank import roughness_of, swings, use
from scipy.integrate import trapezoid
from scipy.special import ndtr

from adhesion_node.core.bank.findings import ahead
from adhesion_node.core.bank.labels import kinds
from adhesion_node.core.bank.labels.laws import laws_of
from adhesion_node.core.bank.layout import GRADE, MU, ROUGH, SPEED, Bank
from adhesion_node.core.bank.motion import Braking, open_variance, resistance
from adhesion_node.core.bank.seeing import ROLLED
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.physics.train import GRAVITY, Array


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
    swinging = swings(bank.kind)
    lengths = np.where(swinging, time_s / kinds.SWING_S, way_m / kinds.ROUGHNESS_M)
    rough_kept, rough_added = _mean_ahead(lengths, 1.0)
    grade_kept, grade_added = _mean_ahead(way_m, kinds.RESIDUAL_M)
    slope = used.slope.copy()
    slope[:, ROUGH] *= rough_kept
    slope[:, GRADE] = grade_kept
    told = max(float(bank.weight @ speed), 1.0)
    slope[:, SPEED] -= 2.0 * slowing / GRAVITY / told  # a way goes with the speed's square
    adhesion = used.value - used.slope[:, ROUGH] * mean[:, ROUGH] * (1.0 - rough_kept)
    adhesion = adhesion - 2.0 * slowing / GRAVITY * (mean[:, SPEED] - told) / told
    roughness = (
        roughness_of(config, bank.kind) ** 2 * rough_added
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
    partial = max(braking.applied, float(bank.weight @ used.value)) < ahead.PARTIAL * whole and braking.told <= 1.0
    borne = used.value * (ROLLED[0] / ROLLED[1] if partial else 1.0)
    least = min(known.lower, whole) if partial else 0.0
    foreseen, more = np.where(sliding, foreseen, foreseen + borne - used.value), ~sliding & (borne < least)
    foreseen, std = np.where(more, least, foreseen), np.where(more, 1e-6, std)
    middle = np.maximum(foreseen, ahead.LEAST_AHEAD)
    variance = np.log1p(np.square(std / middle))  # of the logarithm: so much may be taken away, but not all
    # where nothing tells which, sliding since the brake was applied is as likely as rolling beforehand
    since = sliding & np.isneginf(bank.born_s) & (not partial) & (abs(braking.told) <= 1.0)
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
