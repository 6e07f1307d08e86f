"""A change of the rail within a window: when, how likely, and what is known after it.

Every instant is tried with a jump of kappa as one more unknown of the window's normal equations, as Willsky and Jones
(1976) have it; the instants are then averaged by their probability instead of betting on the likeliest one, because
half a second of doubt is 0.2 m/s of speed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .smoother import Smoothed
from .train import Array
from .window_model import Belief, Problem, Steps

Indices = NDArray[np.intp]

FAR = 6.0
"""Deviation in standard deviations that no change explains."""


class Change(NamedTuple):
    """A window whose kappa has jumped."""

    step: int
    """Likeliest first step with the other kappa."""
    log_odds: float
    """Logarithm of the odds that the measurements give it against no change (Bayes factor)."""
    belief: Belief
    """Joint law of the last state and the new kappa, over all instants."""


class _Tried(NamedTuple):
    """All candidates: log odds and joint laws of the last state and the new kappa, and the likeliest trajectory."""

    log_odds: Array
    total: float
    """Logarithm of the sum of the odds."""
    means: Array
    per_jump: Array
    """How far a jump moves that law, shape (3, C)."""
    variances: Array
    """Of the jump, shape (C,)."""
    rest: Array
    """Covariance at a known jump, shape (3, 3)."""
    trajectory: Array


def change(problem: Problem, smoothed: Smoothed, candidates: Indices, jump_std: float) -> Change:
    """A jump of kappa of standard deviation `jump_std` at one of the steps of `candidates`, all equally likely.

    Behind a change the measurements drift away together, so at first only what is far off counts as an outlier;
    if that makes a change likely, the measurements are weighted as the likeliest change has them.
    """
    good = problem.model.weights(np.zeros(problem.window.steps))
    far = problem.squared(smoothed.trajectory) > FAR**2
    tried = _try(problem, smoothed._replace(weights=np.where(far, smoothed.weights, good)), candidates, jump_std)
    if tried.total > 0.0:
        weights = problem.model.weights(problem.squared(tried.trajectory))
        tried = _try(problem, smoothed._replace(weights=weights), candidates, jump_std)
    if not math.isfinite(tried.total):
        return Change(int(candidates[0]), tried.total, problem.prior)
    likely = np.exp(tried.log_odds - tried.total)
    mean = tried.means @ likely
    apart = tried.means - mean[:, None]
    covariance = tried.rest + apart * likely @ apart.T + tried.per_jump * (likely * tried.variances) @ tried.per_jump.T
    step = int(candidates[np.argmax(likely)])
    return Change(step, tried.total - math.log(candidates.size), Belief(mean, covariance))


def _try(problem: Problem, smoothed: Smoothed, candidates: Indices, jump_std: float) -> _Tried:
    trajectory, kappa = smoothed.trajectory, smoothed.kappa
    steps = problem.linearise(trajectory, kappa)
    normal = problem.normal(steps, trajectory, kappa, smoothed.weights)
    border, shared, own, pull = _jumps(problem, steps, candidates)
    still, still_kappa = normal.factor.solve(normal.states, normal.kappa)
    moved, moved_kappa = normal.factor.solve(border, shared)
    information = own + 1.0 / jump_std**2 - np.sum(border * moved, axis=0) - shared * moved_kappa
    sizes = (pull - border.T @ still - shared * still_kappa) / information
    # while the brake limits, only a fall of the adhesion could be seen
    seen = (sizes < 0.0) | (steps.headroom[candidates] > 0.0)
    log_odds = np.where(seen, 0.5 * sizes**2 * information - 0.5 * np.log(information * jump_std**2), -np.inf)
    per_jump = np.stack([-moved[-2], -moved[-1], 1.0 - moved_kappa])
    base = np.array([*(trajectory[-1] + still[-2:]), kappa + still_kappa])
    best = int(np.argmax(log_odds))
    return _Tried(
        log_odds=log_odds,
        total=float(np.logaddexp.reduce(log_odds)),
        means=base[:, None] + per_jump * sizes,
        per_jump=per_jump,
        variances=1.0 / information,
        rest=normal.factor.law_at_end(),
        trajectory=trajectory + (still - moved[:, best] * sizes[best]).reshape(-1, 2),
    )


def _jumps(problem: Problem, steps: Steps, candidates: Indices) -> tuple[Array, Array, Array, Array]:
    """What a jump adds to the normal equations: to the states, to kappa, to itself, and its gradient."""
    before, after, own, pull = problem.effects(steps)
    count = problem.window.steps
    single = np.zeros((count, count + 1, 2))
    diagonal = np.arange(count)
    single[diagonal, diagonal] = before.T
    single[diagonal, diagonal + 1] = after.T
    border = _from_then_on(single)[candidates].reshape(candidates.size, -1).T
    shared = _from_then_on(own * (steps.headroom > 0.0))[candidates]
    return border, shared, _from_then_on(own)[candidates], _from_then_on(pull)[candidates]


def _from_then_on(steps: Array) -> Array:
    """Sums over each step and all later ones."""
    result: Array = np.cumsum(steps[::-1], axis=0)[::-1]
    return result
