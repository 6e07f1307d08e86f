# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A change within a window, of the rail or of the positions' origin: when, how likely, and what is known after it.

Every instant is tried with a jump as one more unknown of the window's normal equations, as Willsky and Jones
(1976) have it; the instants are then averaged by their probability instead of betting on the likeliest one, because
half a second of doubt is 0.2 m/s of speed.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...belief.window import Window
from ...physics.train import Array
from .problem import Belief, Normal, Problem, Steps
from .smoother import Smoothed

Indices = NDArray[np.intp]

OUTLIER_SIGMA = 6.0
"""Deviation, in standard deviations, that no change explains; it only chooses the weights to begin with."""


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


class Change(NamedTuple):
    """Something may have jumped within a window, at one of the candidates."""

    candidates: Indices
    smoothed: Smoothed
    """The window without a jump."""
    normal: Normal
    jumps: _Jumps
    half: Array
    """The jumps' border, solved half way, shape (2K + 2, C)."""
    on_kappa: Array
    """How far a jump moves kappa, with minus sign, shape (C,) as the following."""
    information: Array
    """On the jump."""
    sizes: Array
    """The most probable jumps."""
    odds: Array
    """Logarithms of the odds against no jump."""
    total: float
    """Logarithm of the sum of the odds."""

    @property
    def best(self) -> int:
        """The likeliest candidate's number."""
        return int(np.argmax(self.odds))

    @property
    def step(self) -> int:
        """Likeliest first step after the change."""
        return int(self.candidates[self.best])

    @property
    def log_odds(self) -> float:
        """Logarithm of the odds that the measurements give a change against none (Bayes factor)."""
        return self.total - math.log(self.candidates.size)

    @property
    def belief(self) -> Belief:
        """Joint belief of the last state and kappa as they are now, over all instants."""
        factor, jumps = self.normal.factor, self.jumps
        per_jump = -np.vstack((factor.end(self.half, self.on_kappa), self.on_kappa))
        per_jump[jumps.adds_to] += 1.0
        moved, change = self.normal.step()
        base = np.array([*(self.smoothed.trajectory[-1] + moved[-1]), self.smoothed.kappa + change])
        means = base[:, None] + per_jump * self.sizes
        means[2] -= jumps.unused
        likely = np.exp(self.odds - self.total)
        mean = means @ likely
        apart = means - mean[:, None]
        spread = apart * likely @ apart.T + per_jump * (likely / self.information) @ per_jump.T
        return Belief(mean, factor.covariance_at_end() + spread)

    def squared(self, problem: Problem) -> Array:
        """Squared deviations of the positions from the likeliest trajectory, in variances, shape (K,)."""
        normal, jumps, best, size = self.normal, self.jumps, self.best, self.sizes[self.best]
        states, kappa = normal.states - size * jumps.border[:, best], normal.kappa - size * jumps.shared[best]
        moved = normal.factor.solve(states, kappa)[0].reshape(-1, 2)
        return problem.squared(self.smoothed.trajectory + moved, size * jumps.shifts[:, best])


def change(problem: Problem, smoothed: Smoothed, candidates: Indices, jump_std: float) -> Change:
    """A jump of kappa of standard deviation `jump_std` at one of the steps of `candidates`, all equally likely."""
    jumps = _of_kappa(smoothed.steps, candidates, jump_std)
    return _likeliest(problem, smoothed, candidates, lambda _: jumps)


def position_step(problem: Problem, smoothed: Smoothed, candidates: Indices, step_std: float) -> Change:
    """A step of the measured positions (a balise corrects them) after one of the `candidates`, as `change`."""
    return _likeliest(
        problem,
        smoothed,
        candidates,
        lambda weights: _of_positions(problem.window, smoothed.trajectory, weights, candidates, step_std),
    )


def _likeliest(problem: Problem, smoothed: Smoothed, candidates: Indices, jumps: Callable[[Array], _Jumps]) -> Change:
    """Try all candidates, with the jumps that the weights of the measurements make.

    Behind a change the measurements drift away together, so at first only what is far off counts as an outlier;
    if that makes a change likely, the measurements are weighted as the likeliest change has them.
    """
    good = problem.model.weights(np.zeros(problem.window.steps))
    weights = np.where(problem.squared(smoothed.trajectory) > OUTLIER_SIGMA**2, smoothed.weights, good)
    found = _try(problem, smoothed, candidates, weights, jumps(weights))
    if found.log_odds > 0.0:
        weights = problem.model.weights(found.squared(problem))
        found = _try(problem, smoothed, candidates, weights, jumps(weights))
    return found


def _try(problem: Problem, smoothed: Smoothed, candidates: Indices, weights: Array, jumps: _Jumps) -> Change:
    normal = problem.normal(smoothed.steps, smoothed.trajectory, smoothed.kappa, weights)
    factor = normal.factor
    still, still_kappa = factor.solve(normal.states, normal.kappa)
    half = factor.forward(jumps.border)
    on_kappa = (jumps.shared - factor.solved @ jumps.border) / factor.information
    explained = np.einsum("ij,ij->j", half, half) + factor.information * on_kappa**2
    information = jumps.own + jumps.std**-2 - explained
    sizes = (jumps.pull - still @ jumps.border - jumps.shared * still_kappa) / information
    seen = np.where(sizes < 0.0, *jumps.seen)
    odds = np.where(seen, 0.5 * sizes**2 * information - 0.5 * np.log(information * jumps.std**2), -np.inf)
    total = float(np.logaddexp.reduce(odds))
    return Change(candidates, smoothed, normal, jumps, half, on_kappa, information, sizes, odds, total)


def _of_kappa(steps: Steps, candidates: Indices, std: float) -> _Jumps:
    (to_s, to_v), on_speed = steps.weighted[1], steps.on_speed[1]
    later = _later(to_s.size, candidates)
    border = np.zeros((to_s.size + 1, 2, candidates.size))
    border[:-1, 0] = moved = to_s[:, None] * later
    border[:-1, 1] = on_speed[:, None] * later
    border[1:, 0] -= moved
    border[1:, 1] -= to_v[:, None] * later
    free = steps.headroom > 0.0
    own, pull = (steps.weighted[1] * steps.moving[1:]).sum(axis=1)
    return _Jumps(
        border=border.reshape(-1, candidates.size),
        shared=(own * free) @ later,
        own=own @ later,
        pull=pull @ later,
        # while the brake limits, only a fall of the adhesion could be seen
        seen=np.array([np.ones(candidates.size, dtype=np.bool_), free[candidates]]),
        std=std,
        adds_to=2,
        shifts=np.zeros_like(later),
        unused=np.maximum(-steps.headroom[candidates], 0.0),  # it counts from the brake's limit
    )


def _of_positions(window: Window, trajectory: Array, weights: Array, candidates: Indices, std: float) -> _Jumps:
    seen, later = weights * window.information[:, 0], _later(window.steps, candidates)
    border = np.zeros((window.steps + 1, 2, candidates.size))
    border[1:, 0] = seen[:, None] * later
    return _Jumps(
        border=border.reshape(-1, candidates.size),
        shared=np.zeros(candidates.size),
        own=seen @ later,
        pull=seen * (window.position_m - trajectory[1:, 0]) @ later,
        seen=np.ones((2, candidates.size), dtype=np.bool_),
        std=std,
        adds_to=0,
        shifts=later,
        unused=np.zeros(candidates.size),
    )


def _later(count: int, candidates: Indices) -> Array:
    """1 for each of `count` steps from each candidate on, else 0: shape (K, C)."""
    return (np.arange(count)[:, None] >= candidates).astype(np.float64)
