# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The core's particle filter with a leading axis of runs.

R runs whose windows have K steps each; N particles. Every run draws from its own generator in the core's order, so
its numbers are the core's, whichever runs share a batch, but for the rounding of sums.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.belief.gaussian import Gaussian
from ...core.belief.window import Window
from ...core.physics.motion import Motion
from ...core.physics.train import Array

Indices = NDArray[np.intp]


class Windows(NamedTuple):
    """Windows of equal length with the law of their first states."""

    mean: Array
    """(R, 2)."""
    root: Array
    """Cholesky factors of the priors' covariances, (R, 2, 2)."""
    dt_s: Array
    """This and the following as in `core.window.Window`, with the step first: (K, R, 1)."""
    brake: Array
    position_m: Array
    variance_m2: Array
    speed_mps: Array
    speed_variance: Array
    log_constant: Array
    """(R,)."""

    def of(self, runs: Indices) -> Windows:
        """Those of some runs."""
        by_step = (name for name in self._fields if name not in ("mean", "root", "log_constant"))
        return self._replace(
            mean=self.mean[runs],
            root=self.root[runs],
            log_constant=self.log_constant[runs],
            **{name: getattr(self, name)[:, runs] for name in by_step},
        )


class Draws(NamedTuple):
    """Random numbers of one filter run."""

    normal: Array
    """Process noise of position and speed, (R, 2, K, N)."""
    uniform: Array
    """Offsets of the systematic resampling, (R, K)."""
    start: Array
    """First states, (R, N, 2)."""

    @classmethod
    def empty(cls, runs: int, steps: int, count: int) -> Draws:
        """Room for those of R runs, K steps and N particles."""
        return cls(np.empty((runs, 2, steps, count)), np.empty((runs, steps)), np.empty((runs, count, 2)))


class Cloud(NamedTuple):
    """The filter's particles at the times 0..K."""

    states: Array
    """Positions and speeds, (2, K + 1, R, N)."""
    stepped: Array
    """Where the noise-free step leads those of the times 0..K-1, (2, K, R, N)."""
    log_weights: Array
    """(K + 1, R, N)."""

    @classmethod
    def empty(cls, runs: int, steps: int, count: int) -> Cloud:
        """Room for that of R runs, K steps and N particles."""
        shape = steps, runs, count
        return cls(np.empty((2, steps + 1, *shape[1:])), np.empty((2, *shape)), np.empty((steps + 1, *shape[1:])))


def stack(priors: Sequence[Gaussian], windows: Sequence[Window]) -> Windows:
    """Put windows of equal length together."""
    names = ("dt_s", "brake", "position_m", "variance_m2", "speed_mps", "speed_variance")
    return Windows(
        mean=np.stack([prior.mean for prior in priors]),
        root=np.linalg.cholesky(np.stack([prior.covariance for prior in priors])),
        log_constant=np.array([window.log_constant for window in windows]),
        **{name: np.stack([getattr(window, name) for window in windows], axis=1)[:, :, None] for name in names},
    )


def draw(rngs: Sequence[np.random.Generator], draws: Draws) -> None:
    """Draw what one filter run takes, in the core's order; runs that share a generator share its numbers."""
    first: dict[np.random.Generator, int] = {}
    for run, rng in enumerate(rngs):
        drawn = first.setdefault(rng, run)
        if drawn == run:
            rng.standard_normal(out=draws.normal[run])
            rng.random(out=draws.uniform[run])
            rng.standard_normal(out=draws.start[run])
        else:
            for numbers in draws:
                numbers[run] = numbers[drawn]


def particle_filter(motion: Motion, windows: Windows, mu: Array, draws: Draws, cloud: Cloud) -> tuple[Array, Array]:
    """Bootstrap filter that writes the cloud: log likelihoods and smallest ESS (R,); `mu` has shape (R, 1)."""
    _begin(motion, windows, draws, cloud)
    states, stepped, log_weights = cloud
    steps, (runs, count) = len(windows.dt_s), log_weights.shape[1:]
    precision, measured_speed = -0.5 / windows.variance_m2, np.isfinite(windows.speed_variance.min(axis=(1, 2)))
    numbers = (np.arange(count) + draws.uniform.T[:, :, None]) / count
    relative, top = np.ones((runs, count)), np.zeros((steps + 1, runs, 1))
    total, square = np.full((2, steps + 1, runs), float(count))
    ends = np.zeros((steps + 1, runs), dtype=bool)  # of the stretches between two resamplings
    ends[-1] = True
    for k in range(steps):
        s, v = states[:, k]
        stepped[0, k], stepped[1, k] = motion.advance(s, v, windows.dt_s[k], windows.brake[k], mu)
        moved, log_w = stepped[:, k], log_weights[k]
        poor = (total[k] * total[k] < 0.5 * count * square[k]).nonzero()[0]
        if poor.size:
            ends[k, poor] = True
            parents = _parents(relative[poor], numbers[k, poor])
            moved, log_w = moved.copy(), log_w.copy()
            moved[:, poor], log_w[poor] = moved[:, poor[:, None], parents], 0.0
        s, v = np.add(states[:, k + 1], moved, out=states[:, k + 1])
        log_w = np.add(log_w, precision[k] * (windows.position_m[k] - s) ** 2, out=log_weights[k + 1])
        if measured_speed[k]:
            log_w -= (0.5 / windows.speed_variance[k]) * (windows.speed_mps[k] - v) ** 2
        relative = np.exp(log_w - np.maximum.reduce(log_w, axis=1, keepdims=True, out=top[k + 1]))
        np.einsum("rn->r", relative, out=total[k + 1])
        np.einsum("rn,rn->r", relative, relative, out=square[k + 1])
    log_means = top[:, :, 0] + np.log(total / count)
    return np.sum(log_means, axis=0, where=ends) + windows.log_constant, (total**2 / square).min(axis=0)


def _begin(motion: Motion, windows: Windows, draws: Draws, cloud: Cloud) -> None:
    """Write the first states and log weights, and of the later states the noise alone."""
    first = windows.mean[:, None, :] + draws.start @ windows.root.transpose(0, 2, 1)
    cloud.states[:, 0], cloud.log_weights[0] = first.transpose(2, 0, 1), 0.0
    for index, variance in enumerate(motion.noise(windows.dt_s)):
        np.multiply(np.sqrt(variance), draws.normal[:, index].swapaxes(0, 1), out=cloud.states[index, 1:])


def _parents(relative: Array, numbers: Array) -> Indices:
    """Systematic resampling: the particle on which each of N numbers falls, by relative weights; all (R, N)."""
    upto = np.cumsum(relative, axis=1)
    return np.asarray(np.argmax(upto[:, None, :] >= (upto[:, -1:] * numbers)[:, :, None], axis=2))
