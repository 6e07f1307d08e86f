# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a consumer brakes by: an estimate with its two braking curves."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from .bank.findings.ahead import Ahead
from .config import Config
from .estimate import Estimate
from .physics.adhesion import AdhesionLaw
from .physics.braking import BrakingCurve, Slowdown, slowdown
from .physics.train import Train

LEAST_EFFICIENCY = 1e-3
"""A brake of which nothing may be counted on presses with so much of its force: a curve needs one."""


REACH_S, SIGMA = 60.0, 3.0
"""Time of travel within which whoever brakes by a curve surely begins to, as reactions and the build-up take less; and
standard deviations of the position within which the train is."""


class Prediction(NamedTuple):
    """An estimate and the emergency braking from there to a standstill."""

    estimate: Estimate
    safe: BrakingCurve | None
    """Built on mu_lower; None where the train would not slow down with so little adhesion."""
    nominal: BrakingCurve | None
    """Built on mu; None also where mu is withheld."""


def predict(config: Config, estimate: Estimate) -> Prediction:
    """Braking curves from the estimate's speed on the least favourable resistance of the way that they take.

    The safe curve holds the bound at its present value: on the published laws adhesion only rises while the train
    slows down. Its brake is that of the configured confidence. The nominal curve follows the identified law.
    """
    bound = (_cautious(config), estimate.mu_lower) if estimate.ahead is None else (config.train, estimate.ahead)
    return Prediction(
        estimate,
        _curve(config, estimate, *bound),
        None if estimate.withheld else _curve(config, estimate, config.train, _expected(estimate)),
    )


def _cautious(config: Config) -> Train:
    """The train with the weakest brake that it may have."""
    weakest = max(1.0 - float(ndtri(config.confidence)) * config.brake_error, 0.0)
    return replace(config.train, rigging_efficiency=max(config.train.rigging_efficiency * weakest, LEAST_EFFICIENCY))


def _expected(estimate: Estimate) -> float | AdhesionLaw:
    """Adhesion from here on: the identified law through the estimate, or the present value."""
    shape = estimate.shape
    if shape is None:
        return max(estimate.mu, 0.0)
    now = float(shape(np.asarray(abs(estimate.speed_mps))))
    return replace(shape, scale=shape.scale * max(estimate.mu, 1e-6) / now)


def _slowed(slowing: Slowdown, mu: float | AdhesionLaw | Ahead) -> BrakingCurve:
    """The curve by an adhesion, which may depend on what else slows the train down."""
    return slowing.curve(mu.against(slowing.train, slowing.resistance) if isinstance(mu, Ahead) else mu)


def _curve(config: Config, estimate: Estimate, train: Train, mu: float | AdhesionLaw | Ahead) -> BrakingCurve | None:
    """The curve from wherever the train may be, or comes in `REACH_S` of travel.

    A fall that begins beyond its end does not count, one on the way counts from here on.
    """
    speed_mps, unsure_m, curve, least = abs(estimate.speed_mps), SIGMA * estimate.position_std_m, None, math.inf
    rear_m, front_m = estimate.position_m - unsure_m, estimate.position_m + unsure_m + REACH_S * speed_mps
    end_m = front_m
    while (grade := config.track.least_resistance(rear_m, end_m)) < least:
        try:
            curve = _slowed(slowdown(train, speed_mps, 0.0, grade), mu)
        except ValueError:  # more downgrade than brake: no curve is the honest answer, and consumers brake on silence
            return None
        least, end_m = grade, front_m + float(curve.distance_m[-1])
    return curve
