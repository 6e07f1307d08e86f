# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""One normal equation with its linearisation: ours beside a bare compiled loop and beside GTSAM.

Ours is timed as it is called from Python, and as the search for kappa makes it, a window's share of all that is
done for it. GTSAM is given our linearisation: what is timed is building its factors from it, and eliminating them.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ...core.methods.rail_condition.problem import Belief, Model, Problem
from ...core.methods.rail_condition.smoother import KappaSearch, smooth
from ...core.physics.adhesion import WET
from ...core.physics.train import Array
from ..scene import braking_window
from ..timing import SLOW, Contender, beside, interleave
from . import bare_loop

BARE, OURS, SEARCHED = "bare compiled loop", "ours, one call", "ours, in the search for kappa"
BUILT, ELIMINATED = "GTSAM, building it", "GTSAM, eliminating it"

AT_ONCE = 100
"""Equations that are timed together: one alone takes less than a clock can tell."""

KAPPA, KAPPA_STD, START = 0.9, 0.3, 0.8


def compare(steps: int, rounds: int, seed: int) -> list[dict[str, Any]]:
    """Rows of the table for a window of so many steps; times of one equation."""
    from . import gtsam_smoother

    problem, trajectory = _problem(steps, seed)
    weights, bare = np.ones(steps), _bare(problem, trajectory)
    solved = problem.solved(trajectory, KAPPA, weights)
    graph = gtsam_smoother.built(problem, solved, trajectory, KAPPA)
    eliminated = partial(gtsam_smoother.change, graph, steps)
    search = KappaSearch(START, 0.0, 1e-9, 50)
    found = smooth(problem, search)

    def searched() -> float:
        return smooth(problem, search).kappa

    timed = interleave(
        [
            Contender(BARE, partial(_often, bare), rounds),
            Contender(OURS, partial(_often, lambda: problem.solved(trajectory, KAPPA, weights).change), rounds),
            Contender(SEARCHED, partial(_often, searched), rounds),
            Contender(BUILT, partial(gtsam_smoother.built, problem, solved, trajectory, KAPPA), rounds),
            Contender(ELIMINATED, eliminated, math.ceil(rounds / SLOW)),
        ]
    )
    many = {BARE: AT_ONCE, OURS: AT_ONCE, SEARCHED: AT_ONCE * found.iterations, BUILT: 1, ELIMINATED: 1}
    changes = {
        BARE: bare(),
        OURS: solved.change,
        SEARCHED: found.kappa - START,
        BUILT: math.nan,
        ELIMINATED: eliminated(),
    }
    each = {name: one._replace(seconds=[s / many[name] for s in one.seconds]) for name, one in timed.items()}
    return [
        {"method": name, **_us(beside(one, each[BARE])), "kappa_moves": changes[name]} for name, one in each.items()
    ]


def _us(row: dict[str, Any]) -> dict[str, Any]:
    return {"calls": row["calls"], "median_us": 1e3 * row["median_ms"], "ratio": row["ratio"]}


def _often(run: Callable[[], float]) -> None:
    for _ in range(AT_ONCE):
        run()


def _problem(steps: int, seed: int) -> tuple[Problem, Array]:
    """A window of the wet law and a trajectory near it."""
    rng = np.random.default_rng(seed)
    motion, prior, window = braking_window(steps, rng)
    covariance = np.diag([0.0, 0.0, KAPPA_STD**2])
    covariance[:2, :2] = prior.covariance
    problem = Problem(Model(motion, WET, tail_dof=0.0), window, Belief(np.append(prior.mean, KAPPA), covariance))
    return problem, smooth(problem, KappaSearch(START, 0.0, 1e-9, 50)).trajectory + 0.05 * rng.standard_normal(
        (steps + 1, 2)
    )


def _bare(problem: Problem, trajectory: Array) -> Callable[[], float]:
    """The bare loop on arrays that are there already; it returns the step of kappa."""
    given, precision = problem.given, np.array(np.linalg.inv(problem.prior.covariance))
    model = np.array([*given.resistance, *given.law[:3], given.noise_m, given.noise_mps])
    work = np.empty((6, trajectory.size))
    return partial(bare_loop.stepped, given.window, model, given.mean, precision, trajectory, KAPPA, work)
