# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Gaussian smoother of a window and its EM for the rail condition kappa.

E-step: all states of the window at once, as one banded system. M-step: kappa. For a linear Gaussian model EM moves
kappa by score/complete information in every iteration; divided by the observed information instead (Louis 1982) the
step ends where EM would converge to. Both informations fall out of the bordered system, so an iteration here is one
solve, and it repeats only because the motion is a little nonlinear, because the brake's limit bends it, and because
heavy-tailed measurements are weighted anew (EM weights of Student's t).
"""

import math
from typing import NamedTuple

import numpy as np

from ...physics.train import GRAVITY, Array
from .problem import Belief, Problem, Steps

WEIGHT_TOLERANCE = 1e-2
"""Change of a measurement's weight below which it has converged; what is left moves kappa by far less than sigma."""

LIMIT_TOLERANCE = 1e-3
"""Relative width of the interval in which kappa is known to end at the brake's limit: bisection stops there."""


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
    steps: Steps
    """Linearised about the trajectory and kappa."""
    iterations: int
    converged: bool


class Posterior(NamedTuple):
    """What a window leaves: the joint belief of its last state and kappa, and the evidence for its speed law."""

    belief: Belief
    log_evidence: float
    """ln p(y), up to a term that all speed laws share."""


def smooth(problem: Problem, search: KappaSearch, near: Array | None = None) -> Smoothed:
    """Iterate E- and M-step to the most probable trajectory and kappa.

    `near` is where to begin: a trajectory of the window or of its beginning, from an earlier or a similar one.
    The search begins where adhesion limits: beyond the brake's limit nothing would pull kappa back. Where it ends at
    that limit, Newton's steps leap to and fro across it; then the interval between them is halved.
    """
    trajectory, kappa = _begin(problem, search.start, problem.prior.mean[None, :2] if near is None else near)
    weights = problem.model.weights(np.zeros(problem.window.steps) if near is None else problem.squared(trajectory))
    steps = problem.linearise(trajectory, kappa)
    low, high = search.lowest, math.inf
    for iteration in range(1, search.iterations + 1):
        moved, change = problem.normal(steps, trajectory, kappa, weights).step()
        limits = kappa + float(steps.headroom.min()), kappa + float(steps.headroom.max())
        if change > 0.0:
            low = max(low, kappa)
        elif kappa >= limits[0]:
            high = min(high, kappa)
        following = max(kappa + change, search.lowest)
        crossing = max(kappa, following) >= limits[0] and abs(change) > search.tolerance
        if crossing and not low < following < high:
            following = 0.5 * (max(low, min(limits[0], high)) + min(high, max(limits[1], low)))
        trajectory, change, kappa = trajectory + moved, following - kappa, following
        steps = problem.linearise(trajectory, kappa)
        before, weights = weights, problem.model.weights(problem.squared(trajectory))
        settled = abs(change) <= search.tolerance or high - low <= LIMIT_TOLERANCE * kappa
        if settled and float(np.abs(weights - before).max()) <= WEIGHT_TOLERANCE:
            return Smoothed(trajectory, kappa, weights, steps, iteration, True)
    return Smoothed(trajectory, kappa, weights, steps, search.iterations, False)


def posterior(problem: Problem, smoothed: Smoothed, margin: float) -> Posterior:
    """Joint belief of the last state and kappa, and evidence, of a window or the beginning of one.

    `smoothed` may be of a longer window: then it is where the beginning is linearised and weighted, with hindsight,
    but the measurements behind the beginning do not enter the law. `margin` as in `Problem.normal`.
    """
    window, count, kappa = problem.window, problem.window.steps, smoothed.kappa
    trajectory, weights = smoothed.trajectory[: count + 1], smoothed.weights[:count]
    normal = problem.normal(smoothed.steps.beginning(count), trajectory, kappa, weights, margin)
    moved, change = normal.step()
    mean = np.array([*(trajectory[-1] + moved[-1]), kappa + change])
    misfit = normal.misfit + problem.model.loss(problem.squared(trajectory))
    misfit += 0.5 * float(window.information[:, 1] @ (window.speed_mps - trajectory[1:, 1]) ** 2)
    misfit -= 0.5 * (float(normal.states @ moved.ravel()) + normal.kappa * change)
    spread = normal.factor.log_determinant - 2.0 * float(np.log(problem.whitening.diagonal()).sum())
    return Posterior(Belief(mean, normal.factor.covariance_at_end()), -misfit - 0.5 * spread)


def _begin(problem: Problem, kappa: float, near: Array) -> tuple[Array, float]:
    """The trajectory `near` drawn out at constant deceleration, and a kappa that some step can use."""
    motion, dt, brake = problem.model.motion, problem.window.dt_s, problem.window.brake
    known = near.shape[0] - 1
    position, speed = near[-1:].T
    law, resistance = problem.model.law(speed), motion.resistance(position, speed)
    limit = motion.train.used_adhesion(np.inf, brake, resistance)
    kappa = min(kappa, 0.98 * float(limit.max()) / float(law[0]))
    if known == problem.window.steps:
        return near, kappa
    lost = GRAVITY * dt[known:] * (np.minimum(kappa * law, limit[known:]) + resistance)
    speeds = np.concatenate((speed, speed - np.cumsum(lost)))
    positions = position + np.cumsum(0.5 * dt[known:] * (speeds[:-1] + speeds[1:]))
    return np.concatenate((near, np.stack((positions, speeds[1:]), axis=1))), kappa
