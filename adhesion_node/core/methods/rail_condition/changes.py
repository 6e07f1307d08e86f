# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A change within a window, of the rail or of the positions' origin: when, how likely, and what is known after it.

Every instant is tried with a jump as one more unknown of the window's normal equations, as Willsky and Jones
(1976) have it; the instants are then averaged by their probability instead of betting on the likeliest one, because
half a second of doubt is 0.2 m/s of speed.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels import equation, jumps
from .problem import Belief, Problem
from .smoother import Smoothed

Indices = NDArray[np.intp]

OUTLIER_SIGMA = 6.0
"""Deviation, in standard deviations, that no change explains; it only chooses the weights to begin with."""


class Change(NamedTuple):
    """Something may have jumped within a window, at one of the candidates."""

    candidates: Indices
    smoothed: Smoothed
    """The window without a jump."""
    equation: equation.Solved
    tried: jumps.Tried
    of_rail: bool
    """Of kappa, or of the positions' origin."""
    total: float
    """Logarithm of the sum of the odds."""

    @property
    def best(self) -> int:
        """The likeliest candidate's number."""
        return int(np.argmax(self.tried.odds))

    @property
    def step(self) -> int:
        """Likeliest first step after the change."""
        return int(self.candidates[self.best])

    @property
    def size(self) -> float:
        """The likeliest candidate's most probable jump."""
        return float(self.tried.sizes[self.best])

    @property
    def log_odds(self) -> float:
        """Logarithm of the odds that the measurements give a change against none (Bayes factor)."""
        return self.total - math.log(self.candidates.size)

    @property
    def belief(self) -> Belief:
        """Joint belief of the last state and kappa as they are now, over all instants."""
        now, per_jump = self.equation, self.tried.per_jump.copy()
        per_jump[2 if self.of_rail else 0] += 1.0  # what the jump moves by itself
        base = np.array([*(self.smoothed.trajectory[-1] + now.moved[-2:]), self.smoothed.kappa + now.change])
        means = base[:, None] + per_jump * self.tried.sizes
        if self.of_rail:  # it counts from the brake's limit
            means[2] -= np.maximum(-now.steps[self.candidates, equation.HEADROOM], 0.0)
        likely = np.exp(self.tried.odds - self.total)
        mean = means @ likely
        apart = means - mean[:, None]
        spread = apart * likely @ apart.T + per_jump * (likely / self.tried.information) @ per_jump.T
        return Belief(mean, equation.covariance_at_end(now) + spread)


def change(problem: Problem, smoothed: Smoothed, candidates: Indices, jump_std: float) -> Change:
    """A jump of kappa of standard deviation `jump_std` at one of the steps of `candidates`, all equally likely."""
    return _likeliest(problem, smoothed, candidates, jump_std, of_rail=True)


def position_step(problem: Problem, smoothed: Smoothed, candidates: Indices, step_std: float) -> Change:
    """A step of the measured positions (a balise corrects them) after one of the `candidates`, as `change`."""
    return _likeliest(problem, smoothed, candidates, step_std, of_rail=False)


def _likeliest(problem: Problem, smoothed: Smoothed, candidates: Indices, std: float, *, of_rail: bool) -> Change:
    """Try all candidates, with the jumps that the weights of the measurements make.

    Behind a change the measurements drift away together, so at first only what is far off counts as an outlier;
    if that makes a change likely, the measurements are weighted as the likeliest change has them.
    """
    window, trajectory = problem.window, smoothed.trajectory
    good = problem.model.weights(np.zeros(window.steps))
    weights = np.where(problem.squared(trajectory) > OUTLIER_SIGMA**2, smoothed.weights, good)
    for again in (True, False):
        now = problem.solved(trajectory, smoothed.kappa, weights)
        if of_rail:
            parts = jumps.of_kappa(now, problem.certainty)
        else:
            parts = jumps.of_positions(weights / window.variance_m2, window.position_m - trajectory[1:, 0])
        # while the brake limits, only a fall of the adhesion could be seen
        tried = jumps.tried(now, parts, candidates, std, of_rail)
        found = Change(candidates, smoothed, now, tried, of_rail, float(np.logaddexp.reduce(tried.odds)))
        if again and found.log_odds > 0.0:
            moved = jumps.moved(now, parts, found.step, found.size).reshape(-1, 2)
            shift = np.where(np.arange(window.steps) < found.step, 0.0, 0.0 if of_rail else found.size)
            weights = problem.model.weights(problem.squared(trajectory + moved, shift))
        else:
            break
    return found
