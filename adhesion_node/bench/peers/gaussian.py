# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Gaussian update of one window: ours as one banded system beside an RTS loop of `filterpy`.

Both look for a constant adhesion of which nothing is known before. Ours ends with the law of the last state, which
the next window wants; filterpy's RTS pass is timed alone, inside 50 EM iterations and inside as many as EM takes.
"""

import math
from functools import partial
from typing import Any

import numpy as np

from ...core.methods.rail_condition.problem import Belief, Model, Problem
from ...core.methods.rail_condition.smoother import KappaSearch, posterior, smooth
from ...core.physics.adhesion import SpeedLaw
from ..scene import Scene, Update, braking_window
from ..timing import SLOW, Contender, Timed, beside, interleave

OURS, PASS = "ours, converged", "filterpy, one RTS pass"
FIFTY, CONVERGED = "filterpy, 50 EM iterations", "filterpy, EM converged"

START_MU = 0.05
TOLERANCE = 1e-7
MOST_ITERATIONS = 2000

NOTHING_KNOWN = 1e3
"""Standard deviation of mu before the window."""


def compare(steps: int, rounds: int, seed: int) -> list[dict[str, Any]]:
    """Rows of the table for a window of so many steps."""
    from . import filterpy_smoother

    scene = braking_window(steps, np.random.default_rng(seed))
    em = partial(filterpy_smoother.em, scene, START_MU)
    timed = interleave(
        [
            Contender(OURS, partial(_ours, scene), rounds),
            Contender(PASS, partial(em, 1, TOLERANCE), rounds),
            Contender(FIFTY, partial(em, 50, TOLERANCE), rounds),
            Contender(CONVERGED, partial(em, MOST_ITERATIONS, TOLERANCE), math.ceil(rounds / SLOW)),
        ]
    )
    return [{"method": name, **_row(timed[name], timed[OURS])} for name in timed]


def _ours(scene: Scene) -> Update:
    motion, prior, window = scene
    covariance = np.diag([0.0, 0.0, NOTHING_KNOWN**2])
    covariance[:2, :2] = prior.covariance
    belief = Belief(np.append(prior.mean, START_MU), covariance)
    problem = Problem(Model(motion, SpeedLaw(1.0), tail_dof=0.0), window, belief)
    smoothed = smooth(problem, KappaSearch(START_MU, 0.0, TOLERANCE, MOST_ITERATIONS))
    posterior(problem, smoothed, -math.inf)
    return Update(smoothed.kappa, smoothed.trajectory[:, 1], smoothed.iterations)


def _row(timed: Timed[Update], ours: Timed[Update]) -> dict[str, Any]:
    """Times, their ratio to ours, and how far the result is from ours: all calls of a method give the same."""
    found, our = timed.results[0], ours.results[0]
    return {
        **beside(timed, ours),
        "iterations": found.iterations,
        "mu": found.mu,
        "mu_differs": abs(found.mu - our.mu),
        "speed_differs_mps": float(np.max(np.abs(found.speed_mps - our.speed_mps))),
    }
