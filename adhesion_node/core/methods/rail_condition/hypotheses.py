# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the rail's adhesion may do while the train slows down: follow a speed law, or stay as it is.

Either way a factor kappa scales it. Each hypothesis has its own Gaussian belief of (s, v, kappa) and a weight, which
the measurements shift by their evidence.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...belief.gaussian import Gaussian
from ...belief.rail import Rail
from ...physics.adhesion import SpeedLaw
from ...physics.train import Array
from .problem import Belief

NEGLIGIBLE_PROBABILITY = 1e-4
"""Below it a hypothesis is given up until the rail changes: it could not move an estimate, but costs a smoother."""


class Hypothesis(NamedTuple):
    """One shape of the adhesion over speed."""

    law: SpeedLaw
    belief: Belief
    """Belief of (s, v, kappa) at some instant."""
    log_weight: float

    @property
    def mu(self) -> float:
        """Adhesion at that instant."""
        _, speed, kappa = self.belief.mean
        return float(kappa * self.law(speed))

    @property
    def variance(self) -> float:
        """Variance of `mu`."""
        _, speed, kappa = self.belief.mean
        slope = np.array([kappa * self.law.slope(speed), self.law(speed)])
        return float(slope @ self.belief.covariance[1:, 1:] @ slope)


def hypotheses(law: SpeedLaw, other: SpeedLaw, probability: float, belief: Belief) -> tuple[Hypothesis, ...]:
    """The speed law with that probability, another one and constant adhesion; all know the same of mu.

    `belief` is that of (s, v, mu).
    """
    constant = SpeedLaw(float(law(belief.mean[1])))
    rest = (1.0 - probability) / 2.0
    return tuple(
        Hypothesis(shape, scaled(belief, 1.0 / float(shape(belief.mean[1]))), math.log(weight))
        for shape, weight in ((law, probability), (other, rest), (constant, rest))
        if weight > 0.0
    )


def scaled(belief: Belief, factor: float) -> Belief:
    """Belief of (s, v, factor x) of the belief of (s, v, x)."""
    by = np.array([1.0, 1.0, factor])
    return Belief(belief.mean * by, belief.covariance * np.outer(by, by))


def with_rail(state: Gaussian, rail: Rail) -> Belief:
    """Belief of (s, v, mu) where the state tells nothing of the rail."""
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = state.covariance
    covariance[2, 2] = rail.std**2
    return Belief(np.array([*state.mean, rail.mu]), covariance)


def probabilities(hypotheses: Sequence[Hypothesis]) -> Array:
    """Normalised weights, shape (H,)."""
    logs = np.array([hypothesis.log_weight for hypothesis in hypotheses])
    weights = np.exp(logs - np.max(logs))
    result: Array = weights / np.sum(weights)
    return result


def widened(belief: Belief, component: int, variance: float) -> Belief:
    """Add a variance to one component of a belief of (s, v, x)."""
    covariance = belief.covariance.copy()
    covariance[component, component] += variance
    return belief._replace(covariance=covariance)
