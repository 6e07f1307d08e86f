# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Bootstrap particle filter of R windows of K steps with N particles each, Xie et al. 2019, (13)-(16).

Times run 0..K: time 0 is the prior, times 1..K carry the measurements. Weights are kept as logarithms; loops run
over time only. Every run draws from its own generator, so its numbers are the same whichever runs stand beside it.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...physics.motion import Motion
from ...physics.train import Array
from .windows import Windows


class Particles(NamedTuple):
    """The filter's particles and what the smoother takes of them."""

    states: Array
    """Positions and speeds, (2, K + 1, R, N)."""
    stepped: Array
    """Where the noise-free step leads those of the times 0..K-1, (2, K, R, N)."""
    log_weights: Array
    """Up to a constant per time and run, (K + 1, R, N)."""
    log_likelihood: Array
    """ln p(y_1:K) at the filter's adhesion (14)(15), (R,)."""
    smallest_ess: Array
    """Smallest effective sample size over the window, 1..N, (R,)."""


class Step(NamedTuple):
    """What one step of the filter works on: numbers or (R, 1), and views of the arrays that a pass fills."""

    dt: Any
    brake: Any
    measured: Any
    precision: Any
    """-1/(2 r) of the measured position."""
    with_speed: bool
    before: tuple[Array, Array]
    """Positions and speeds before it, (R, N) each."""
    moved: Array
    """Where it leads them without noise, (2, R, N)."""
    after: Array
    """States after it, (2, R, N); a pass begins with the noise alone in them."""
    log_before: Array
    """Log weights before it, (R, N), and after it."""
    log_after: Array
    highest: Array
    """Largest of those after it, (R, 1)."""
    sums: Array
    """Of the weights relative to it, and of their squares, (2, R)."""


class ParticleFilter:
    """The bootstrap filter, prepared for windows and a number of particles; every pass uses the same memory."""

    def __init__(self, motion: Motion, windows: Windows, count: int) -> None:
        steps, runs, _ = windows.dt_s.shape
        self.motion, self.windows = motion, windows
        self.root = np.linalg.cholesky(windows.covariance).transpose(0, 2, 1)
        self.spread = np.sqrt(np.stack(motion.noise(windows.dt_s)))
        self.draws = np.empty((runs, 2, steps, count)), np.empty((runs, steps)), np.empty((runs, count, 2))
        self.states, self.stepped = np.empty((2, steps + 1, runs, count)), np.empty((2, steps, runs, count))
        self.log_weights = np.zeros((steps + 1, runs, count))
        self.top, self.sums = np.zeros((steps + 1, runs, 1)), np.full((2, steps + 1, runs), float(count))
        columns = (windows.dt_s, windows.brake, windows.position_m, -0.5 / windows.variance_m2)
        by_step = zip(
            *map(_by_step, columns),
            [bool(seen.any()) for seen in np.isfinite(windows.speed_variance)],
            zip(*self.states[:, :-1], strict=True),
            self.stepped.swapaxes(0, 1),
            self.states.swapaxes(0, 1)[1:],
            self.log_weights[:-1],
            self.log_weights[1:],
            self.top[1:],
            self.sums.swapaxes(0, 1)[1:],
            strict=True,
        )
        self.steps = list(map(Step._make, by_step))

    def run(self, mu: Array, rngs: Sequence[np.random.Generator]) -> Particles:
        """Filter Y (13) at adhesions `mu`, shape (R,): p(y_t|Y_1:t-1) (16) is the mean weight.

        Resamples systematically where the effective sample size falls below half of the particles. The next pass
        writes over what is returned.
        """
        offsets, windows = self._begin(rngs), self.windows
        (runs, count), (used,) = self.stepped.shape[2:], _by_step(mu[None, :, None])
        relative, (total, square) = np.ones((2, runs, count)), self.sums[:, 0]
        (weights, squares), half = relative, 0.5 * count
        ends = np.zeros((len(self.steps) + 1, runs), dtype=bool)  # of the stretches between two resamplings
        ends[-1] = True
        for k, step in enumerate(self.steps):
            dt, brake, measured, precision, with_speed, before, moved, after, log_w, log_after, highest, sums = step
            moved[0], moved[1] = self.motion.advance(*before, dt, brake, used)
            poor = (total * total < half * square).nonzero()[0]
            if poor.size:
                ends[k, poor] = True
                parents = systematic(weights[poor], offsets[poor, k])
                moved, log_w = moved.copy(), log_w.copy()
                moved[:, poor], log_w[poor] = moved[:, poor[:, None], parents], 0.0
            s, v = np.add(after, moved, out=after)
            np.add(log_w, precision * (measured - s) ** 2, out=log_after)
            if with_speed:
                log_after -= (0.5 / windows.speed_variance[k]) * (windows.speed_mps[k] - v) ** 2
            np.maximum.reduce(log_after, axis=1, keepdims=True, out=highest)
            np.exp(np.subtract(log_after, highest, out=weights), out=weights)
            np.multiply(weights, weights, out=squares)
            total, square = np.add.reduce(relative, axis=2, out=sums)
        totals, squares = self.sums
        log_means = self.top[:, :, 0] + np.log(totals / count)
        log_likelihood = np.sum(log_means, axis=0, where=ends) + windows.log_constant
        ess = (totals**2 / squares).min(axis=0)
        return Particles(self.states, self.stepped, self.log_weights, log_likelihood, ess)

    def _begin(self, rngs: Sequence[np.random.Generator]) -> Array:
        """Draw the first states, and for the later ones the process noise; return the offsets of the resampling."""
        first: dict[np.random.Generator, int] = {}
        for run, rng in enumerate(rngs):
            drawn = first.setdefault(rng, run)
            for index, numbers in enumerate(self.draws):
                if drawn != run:  # runs that share a generator share its numbers
                    numbers[run] = numbers[drawn]
                elif index == 1:
                    rng.random(out=numbers[run])
                else:
                    rng.standard_normal(out=numbers[run])
        normal, uniform, start = self.draws
        self.states[:, 0] = (self.windows.mean[:, None, :] + start @ self.root).transpose(2, 0, 1)
        np.multiply(self.spread, normal.transpose(1, 2, 0, 3), out=self.states[:, 1:])
        return uniform


def systematic(relative: Array, offsets: Array) -> NDArray[np.intp]:
    """Systematic resampling by relative weights, (P, N): the particles on which the numbers (j + offset)/N fall."""
    count = relative.shape[1]
    upto = np.cumsum(relative, axis=1)
    reached = upto * (count / upto[:, -1:]) + (1.0 - offsets[:, None])  # so many of the N numbers, rounded down
    children = np.minimum(reached, count).astype(np.intp)
    children[:, -1] = count  # also where a sum was rounded
    children[:, 1:] -= children[:, :-1]
    return np.repeat(np.arange(relative.size) % count, children.ravel()).reshape(relative.shape)


def _by_step(column: Array) -> list[Any]:
    """(K, R, 1) taken apart: of each step (R, 1), or, which is quicker, a number where all runs have the same."""
    return column[:, 0, 0].tolist() if (column == column[:, :1]).all() else list(column)
