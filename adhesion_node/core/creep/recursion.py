# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""One run's recursive identification, or that of many runs at once: steps 2 to 7 of He et al. 2017."""

import math
from typing import NamedTuple

import numpy as np

from ..physics.train import Array
from . import fit as creep_fit
from .config import DFP, EXACT, FIXED, VARYING, CreepConfig, Peak
from .curve import adhesion, peak, peak_jacobian, regression
from .fit import Sums

SOLVERS = {EXACT: creep_fit.solve_exact, DFP: creep_fit.solve_dfp}

DRIFT_MEMORY = 0.05
"""Weight of the newest residual in the running means that show a change of the surface: about 20 samples."""

DRIFT_LEVEL = 0.7
"""Running mean of the residuals over their running rms; noise alone gives 0.16."""

DRIFT_SHARE = 0.02
"""A drift below this share of the adhesion is no change of the surface, however small the noise is."""


class Recursion(NamedTuple):
    """The recursive identification of one run, or of many at once with leading axes."""

    sums: Sums
    theta: Array
    """Minimum of (11), shape (..., 2); the start while there are no data."""
    eta: Array
    """Forgetting factor for the next sample, shape (...)."""
    drift: Array
    """Running mean of the residuals of mu, shape (...)."""
    power: Array
    """Running mean of their squares."""


def begin(config: CreepConfig, shape: tuple[int, ...] = (), start: Array | None = None) -> Recursion:
    """Recursion before the first sample, `shape` being that of the runs; it starts from `start` or the setting's."""
    theta = np.broadcast_to(config.start if start is None else start, (*shape, 2))
    first = config.eta if config.forgetting == FIXED else config.eta_max
    zero = np.zeros(shape)
    return Recursion(creep_fit.nothing(shape), theta, np.full(shape, first), zero, zero)


def advance(
    config: CreepConfig, before: Recursion, creeps: Array, adhesions: Array, noise: Array | float = 0.0
) -> Recursion:
    """Take in one sample per run: steps 2 to 7 of the paper's algorithm; `noise` as in `creep_fit.add`."""
    sums = creep_fit.add(before.sums, regression(creeps, adhesions, config.slope), before.eta, noise)
    solved = SOLVERS[config.solver](sums.hessian, sums.target, before.theta)
    theta = creep_fit.keep_positive(sums.hessian, sums.target, solved)
    error = adhesions - adhesion(creeps, config.slope, theta)
    eta = before.eta
    if config.forgetting == VARYING:
        eta = creep_fit.forgetting_factor(error, config.gain, config.eta_max, config.eta_min)
    drift = before.drift + DRIFT_MEMORY * (error - before.drift)
    power = before.power + DRIFT_MEMORY * (error**2 - before.power)
    return Recursion(sums, theta, eta, drift, power)


def judge(config: CreepConfig, recursion: Recursion, relative_std: float) -> Peak:
    """Whether the data tell the peak; `relative_std` is that of mu_max.

    A bound of 3 % on it withholds the peaks that data of too little creep only seem to tell: `study creep` counts
    them. A second bound on the creep reached over lambda_m would withhold nothing more.
    """
    theta, sums = recursion.theta, recursion.sums
    if sums.weight < config.min_samples:
        return Peak.FEW
    if not (theta > 0.0).all():
        return Peak.NO_PEAK
    if not relative_std <= config.max_relative_std:
        return Peak.UNSURE
    return Peak.CHANGING if is_changing(config, recursion) else Peak.KNOWN


def is_changing(config: CreepConfig, recursion: Recursion) -> bool:
    """Whether the newest samples lie on one side of the curve, further than noise and by more than a trifle."""
    drift = abs(float(recursion.drift))
    large = drift > DRIFT_SHARE * float(peak(config.slope, recursion.theta)[0])
    return large and drift > DRIFT_LEVEL * math.sqrt(float(recursion.power))


def full_covariance(slope: float, theta: Array, spread: Array) -> Array:
    """Covariance of (p1, p2, mu_max, lambda_m), shape (..., 4, 4), by the delta method from that of (p1, p2)."""
    jacobian = np.concatenate([np.broadcast_to(np.eye(2), spread.shape), peak_jacobian(slope, theta)], axis=-2)
    return np.asarray(jacobian @ spread @ np.swapaxes(jacobian, -1, -2))
