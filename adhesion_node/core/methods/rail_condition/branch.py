# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A window under one hypothesis: smoothed, and what it leaves of the hypothesis at the newest sample."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...belief.window import Window
from ...physics.train import Array
from .hypotheses import Hypothesis
from .problem import Model, Problem
from .smoother import KappaSearch, Smoothed, posterior, smooth

if TYPE_CHECKING:
    from ...config import Config


class Branch(NamedTuple):
    """A window under one hypothesis."""

    before: Hypothesis
    """As it stood at the window's first sample."""
    problem: Problem
    smoothed: Smoothed
    now: Hypothesis
    """As it stands at the newest one."""

    def margin(self, config: Config) -> float:
        """Headroom below the brake's limit from which a step tells of kappa."""
        return config.limit_margin_sigma * math.sqrt(self.now.belief.covariance[2, 2])


def log_likelihood(branches: Sequence[Branch]) -> float:
    """ln p(y) of the window's measurements given all that was known before them, over all hypotheses.

    Each hypothesis' evidence by Laplace's approximation, which is exact while the motion is linear and the
    measurements are Gaussian.
    """
    before, now = (
        np.logaddexp.reduce([hypothesis.log_weight for hypothesis in each])
        for each in zip(*((branch.before, branch.now) for branch in branches), strict=True)
    )
    return float(now - before) + branches[0].problem.log_constant


def smoothed_branch(
    config: Config, window: Window, before: Hypothesis, near: Array | None, start_mu: float | None, lowest_mu: float
) -> Branch:
    """Smooth the window under a hypothesis, from `start_mu` on, or from its own mean where that is None.

    `near` is a trajectory, shape (at most K + 1, 2), to begin with. Raises numpy.linalg.LinAlgError when a covariance
    is not positive definite.
    """
    _, speed, kappa = before.belief.mean
    scale = float(before.law(speed))
    problem = Problem(Model(config.motion, before.law, config.tail_dof), window, before.belief)
    search = KappaSearch(
        start=kappa if start_mu is None else start_mu / scale,
        lowest=lowest_mu / scale,
        tolerance=config.tolerance / scale,
        iterations=config.iterations,
    )
    smoothed = smooth(problem, search, near)
    # Where the brake limits, this is the belief of the adhesion that it uses.
    now = posterior(problem, smoothed, -math.inf)
    return Branch(before, problem, smoothed, Hypothesis(before.law, now.belief, before.log_weight + now.log_evidence))
