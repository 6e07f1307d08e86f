# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Measurement noise identified by EM: a factor on the variances that the positions come with.

The M-step of a variance is the mean of its expected squared noise over the smoothed window (Shumway and Stoffer 1982).
Only the steps that leave the window count, each once. The process noise is not identified so: positions of 0.5 m
hold next to nothing of 0.02 km/h per step, and EM would stay where it starts.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..kernels import equation
from .problem import Model, Problem
from .smoother import Smoothed

if TYPE_CHECKING:
    from ...config import Config


class Noise(NamedTuple):
    """Factor on the variance of the measured positions, and the steps that it was learnt from."""

    factor: float = 1.0
    steps: float = 0.0


def learn_noise(config: Config, noise: Noise, problem: Problem, smoothed: Smoothed, spent: int) -> Noise:
    """Take in the first `spent` steps of a smoothed window, whose variances already have the factor of `noise`."""
    now = problem.solved(smoothed.trajectory, smoothed.kappa, smoothed.weights)
    variances = equation.position_variances(now)[1 : spent + 1] / problem.window.variance_m2[:spent]
    squared = problem.squared(smoothed.trajectory)[:spent] + variances
    found = float(np.mean(smoothed.weights[:spent] * squared)) / _expected(problem.model)
    share = spent / (config.noise_trust_steps + noise.steps + spent)
    return Noise(noise.factor * (1.0 + share * (found - 1.0)), min(noise.steps + spent, config.noise_memory_steps))


@cache
def _expected(model: Model) -> float:
    """Mean weighted square of Gaussian measurements whose variance is right."""
    points, weights = np.polynomial.hermite_e.hermegauss(40)
    return float(weights @ (model.weights(points**2) * points**2) / np.sum(weights))
