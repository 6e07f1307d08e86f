# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a window's findings mean: what limits the motion, what is known of the rail, and how much at least."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...belief.rail import Rail, learn_bound, lower_bound
from ...belief.regime import Regime
from ...belief.window import WindowSample
from ...physics.train import Array
from .hypotheses import Hypothesis, probabilities

if TYPE_CHECKING:
    from ...config import Config


ROLLING = 0.5
"""Part of the creep that slides below which wheels roll, in the median; between the two they tell nothing."""


def most_used(config: Config, samples: Sequence[WindowSample], speeds_mps: Array, mu: float) -> float:
    """The most that the brake can use at the newest sample, as far as the wheels do not tell better.

    `speeds_mps` are the train's at the samples, `mu` the adhesion identified.

    Sliding wheels show that adhesion limits, whatever the brake; rolling ones that the brake does, however weak.
    """
    recent = np.array([sample.wheel_mps for sample in samples[-config.creep_samples :]])
    creep = 1.0 - recent / speeds_mps[-recent.size :]
    measured = creep[np.isfinite(creep)]
    if measured.size == 0:
        return samples[-1].brake
    typical = float(np.median(measured))
    if typical >= config.sliding_creep:
        return math.inf
    return mu if typical < ROLLING * config.sliding_creep else samples[-1].brake


def judge(
    config: Config, now: Sequence[Hypothesis], before: Rail, known: Rail | None, limit: float
) -> tuple[Regime, Rail]:
    """Regime and rail at the newest sample, over all hypotheses; `limit` is the most that the brake can use.

    The bound holds under every hypothesis that is plausible. A braking begins with that of `known`, and must not
    withdraw it before it has seen anything.
    """
    weights, mus = probabilities(now), np.array([each.mu for each in now])
    variances = np.array([each.variance for each in now]) + config.grade_std**2
    mu = max(float(weights @ mus), 0.0)
    std = math.sqrt(float(weights @ (variances + (mus - mu) ** 2)))
    limit_std = config.brake_error * limit if math.isfinite(limit) else 0.0
    spreads = np.sqrt(variances + np.where(mus < limit, 0.0, limit_std**2))
    bounds = lower_bound(np.minimum(mus, limit), spreads, known, config.confidence)
    lower = min(max(float(np.min(bounds[weights >= min(config.plausible_probability, weights.max())])), 0.0), mu)
    if std > config.undecided_share * config.unknown_std:
        return Regime.COASTING, Rail(mu, std, lower) if known is None else before
    if mu + math.hypot(std, limit_std) < limit:
        return Regime.ADHESION_LIMITED, Rail(mu, std, lower)
    return Regime.BRAKE_LIMITED, learn_bound(before, Rail(min(mu, limit), std, min(lower, limit)))
