# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Gaussian smoother of a window and its EM for the rail condition kappa.

E-step: all states of the window at once, as one banded system. M-step: kappa. For a linear Gaussian model EM moves
kappa by score/complete information in every iteration; divided by the observed information instead (Louis 1982) the
step ends where EM would converge to. Both informations fall out of the bordered system, so an iteration here is one
solve, and it repeats only because the motion is a little nonlinear, because the brake's limit bends it, and because
heavy-tailed measurements are weighted anew (EM weights of Student's t).
"""

from typing import NamedTuple

import numpy as np

from ...physics.train import Array
from ..kernels import equation
from .problem import Belief, Problem


class KappaSearch(NamedTuple):
    """Where the search for kappa starts, and when it stops."""

    start: float
    lowest: float
    tolerance: float
    """Change of kappa below which it has converged."""
    iterations: int


class Smoothed(NamedTuple):
    """A smoothed window."""

    trajectory: Array
    """Position, m, and speed, m/s, at the K + 1 times, shape (K + 1, 2)."""
    kappa: float
    weights: Array
    """Of the K positions, shape (K,)."""
    headroom: Array
    """kappa at which the brake begins to limit each step, less the present kappa, shape (K,)."""
    iterations: int
    converged: bool


class Posterior(NamedTuple):
    """What a window leaves: the joint belief of its last state and kappa, and the evidence for its speed law."""

    belief: Belief
    log_evidence: float
    """ln p(y), up to a term that all speed laws share."""


def smooth(problem: Problem, search: KappaSearch, near: Array | None = None) -> Smoothed:
    """Iterate E- and M-step to the most probable trajectory and kappa.

    `near` is where to begin: a trajectory of the window or of its beginning, from an earlier or a similar one. Raises
    numpy.linalg.LinAlgError where a covariance is not positive definite.
    """
    start = problem.prior.mean[None, :2] if near is None else near
    found = equation.smoothed(problem.given, search, np.ascontiguousarray(start), near is None)
    problem.check(found[-1])
    return Smoothed(*found[:-1])


def posterior(problem: Problem, smoothed: Smoothed, margin: float) -> Posterior:
    """Joint belief of the last state and kappa, and evidence, of a window or the beginning of one.

    `smoothed` may be of a longer window: then it is where the beginning is linearised and weighted, with hindsight,
    but the measurements behind the beginning do not enter the law. `margin` as in `Problem.solved`.
    """
    trajectory, kappa, weights = smoothed[:3]
    mean, covariance, log_evidence, failed = equation.posterior(problem.given, trajectory, kappa, weights, margin)
    problem.check(failed)
    return Posterior(Belief(mean, covariance), log_evidence)
