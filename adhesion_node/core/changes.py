"""A change within a window, of the rail or of the positions' origin: when, how likely, and what is known after it.

Every instant is tried with a jump as one more unknown of the window's normal equations, as Willsky and Jones
(1976) have it; the instants are then averaged by their probability instead of betting on the likeliest one, because
half a second of doubt is 0.2 m/s of speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
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
    """A window in which something has jumped."""

    step: int
    """Likeliest first step after it."""
    log_odds: float
    """Logarithm of the odds that the measurements give it against no change (Bayes factor)."""
    belief: Belief
    """Joint law of the last state and kappa as they are now, over all instants."""


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
    squared: Array
    """Squared deviations of the positions from the likeliest trajectory, in variances, shape (K,)."""


class _Jumps(NamedTuple):
    """What jumps of one kind add to the normal equations, a column or an entry per candidate."""

    border: Array
    """To the states, shape (2K + 2, C)."""
    shared: Array
    """To kappa, shape (C,) as the following."""
    own: Array
    pull: Array
    """Minus the gradient of -ln p with respect to the jump."""
    seen: NDArray[np.bool_]
    """Whether the jump could be seen, by its sign: rows for negative and positive ones, shape (2, C)."""
    std: float
    """Of the jump, before."""
    adds_to: int
    """Which of (s, v, kappa) at the end it moves by itself."""
    shifts: Array
    """By how much it shifts each measured position, shape (K, C)."""
    unused: Array
    """Part of kappa from which it does not count, shape (C,)."""


def change(problem: Problem, smoothed: Smoothed, candidates: Indices, jump_std: float) -> Change:
    """A jump of kappa of standard deviation `jump_std` at one of the steps of `candidates`, all equally likely."""
    return _likeliest(problem, smoothed, candidates, lambda steps, _: _of_kappa(problem, steps, candidates, jump_std))


def position_step(problem: Problem, smoothed: Smoothed, candidates: Indices, step_std: float) -> Change:
    """A step of the measured positions (a balise corrects them) after one of the `candidates`, as `change`."""
    return _likeliest(
        problem,
        smoothed,
        candidates,
        lambda _, weights: _of_positions(problem, smoothed.trajectory, weights, candidates, step_std),
    )


def _likeliest(
    problem: Problem, smoothed: Smoothed, candidates: Indices, jumps: Callable[[Steps, Array], _Jumps]
) -> Change:
    """Average over the candidates.

    Behind a change the measurements drift away together, so at first only what is far off counts as an outlier;
    if that makes a change likely, the measurements are weighted as the likeliest change has them.
    """
    good = problem.model.weights(np.zeros(problem.window.steps))
    far = problem.squared(smoothed.trajectory) > FAR**2
    tried = _try(problem, smoothed._replace(weights=np.where(far, smoothed.weights, good)), jumps)
    if tried.total > 0.0:
        tried = _try(problem, smoothed._replace(weights=problem.model.weights(tried.squared)), jumps)
    if not math.isfinite(tried.total):
        return Change(int(candidates[0]), tried.total, problem.prior)
    likely = np.exp(tried.log_odds - tried.total)
    mean = tried.means @ likely
    apart = tried.means - mean[:, None]
    covariance = tried.rest + apart * likely @ apart.T + tried.per_jump * (likely * tried.variances) @ tried.per_jump.T
    step = int(candidates[np.argmax(likely)])
    return Change(step, tried.total - math.log(candidates.size), Belief(mean, covariance))


def _try(problem: Problem, smoothed: Smoothed, jumps: Callable[[Steps, Array], _Jumps]) -> _Tried:
    trajectory, kappa = smoothed.trajectory, smoothed.kappa
    normal = problem.normal(smoothed.steps, trajectory, kappa, smoothed.weights)
    tried = jumps(smoothed.steps, smoothed.weights)
    still, still_kappa = normal.factor.solve(normal.states, normal.kappa)
    moved, moved_kappa = normal.factor.solve(tried.border, tried.shared)
    information = tried.own + tried.std**-2 - np.sum(tried.border * moved, axis=0) - tried.shared * moved_kappa
    sizes = (tried.pull - tried.border.T @ still - tried.shared * still_kappa) / information
    seen = np.where(sizes < 0.0, *tried.seen)
    log_odds = np.where(seen, 0.5 * sizes**2 * information - 0.5 * np.log(information * tried.std**2), -np.inf)
    per_jump = np.stack([-moved[-2], -moved[-1], -moved_kappa])
    per_jump[tried.adds_to] += 1.0
    base = np.array([*(trajectory[-1] + still[-2:]), kappa + still_kappa])
    means = base[:, None] + per_jump * sizes
    means[2] -= tried.unused
    best = int(np.argmax(log_odds))
    return _Tried(
        log_odds=log_odds,
        total=float(np.logaddexp.reduce(log_odds)),
        means=means,
        per_jump=per_jump,
        variances=1.0 / information,
        rest=normal.factor.law_at_end(),
        squared=problem.squared(
            trajectory + (still - moved[:, best] * sizes[best]).reshape(-1, 2), tried.shifts[:, best] * sizes[best]
        ),
    )


def _of_kappa(problem: Problem, steps: Steps, candidates: Indices, std: float) -> _Jumps:
    to_kappa, on_kappa = steps.weighted[1], steps.on_speed[1]
    own, pull = np.sum(to_kappa * steps.moving[1:], axis=1)
    count = problem.window.steps
    single = np.zeros((count, count + 1, 2))
    diagonal = np.arange(count)
    single[diagonal, diagonal] = np.array([to_kappa[0], on_kappa]).T
    single[diagonal, diagonal + 1] = -to_kappa.T
    free = steps.headroom > 0.0
    return _Jumps(
        border=_from_then_on(single)[candidates].reshape(candidates.size, -1).T,
        shared=_from_then_on(own * free)[candidates],
        own=_from_then_on(own)[candidates],
        pull=_from_then_on(pull)[candidates],
        # while the brake limits, only a fall of the adhesion could be seen
        seen=np.stack([np.ones(candidates.size, dtype=np.bool_), free[candidates]]),
        std=std,
        adds_to=2,
        shifts=np.zeros((count, candidates.size)),
        unused=np.maximum(-steps.headroom[candidates], 0.0),  # it counts from the brake's limit
    )


def _of_positions(problem: Problem, trajectory: Array, weights: Array, candidates: Indices, std: float) -> _Jumps:
    window, count = problem.window, problem.window.steps
    seen = weights / window.variance_m2
    single = np.zeros((count, count + 1, 2))
    diagonal = np.arange(count)
    single[diagonal, diagonal + 1, 0] = seen
    return _Jumps(
        border=_from_then_on(single)[candidates].reshape(candidates.size, -1).T,
        shared=np.zeros(candidates.size),
        own=_from_then_on(seen)[candidates],
        pull=_from_then_on(seen * (window.position_m - trajectory[1:, 0]))[candidates],
        seen=np.ones((2, candidates.size), dtype=np.bool_),
        std=std,
        adds_to=0,
        shifts=(np.arange(count)[:, None] >= candidates).astype(np.float64),
        unused=np.zeros(candidates.size),
    )


def _from_then_on(steps: Array) -> Array:
    """Sums over each step and all later ones."""
    result: Array = np.cumsum(steps[::-1], axis=0)[::-1]
    return result
