"""The core's particle filter with a leading axis of runs.

R runs whose windows have K steps each; N particles. Every run draws from its own generator in the core's order, so
its numbers are the core's, whichever runs share a batch, but for the rounding of sums.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.gaussian import Gaussian
from ..core.motion import Motion
from ..core.train import Array
from ..core.window import Window

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


def particle_filter(motion: Motion, windows: Windows, mu: Array, draws: Draws, particles: Array) -> tuple[Array, Array]:
    """Bootstrap filter: log likelihoods and smallest ESS (R,).

    Positions, speeds and log weights are written to `particles`, (3, K + 1, R, N).
    """
    _begin(motion, windows, draws, particles)
    position, speed, log_weights = particles
    steps, (runs, count) = len(windows.dt_s), position.shape[1:]
    precision, measured_speed = -0.5 / windows.variance_m2, np.isfinite(windows.speed_variance)
    top, relative = np.zeros((runs, 1)), np.ones((runs, count))
    ess, log_likelihood = np.full((steps + 1, runs), float(count)), np.zeros(runs)
    for k in range(steps):
        s, v, log_w = position[k], speed[k], log_weights[k]
        poor = np.flatnonzero(ess[k] < count / 2)
        if poor.size:
            weights, log_mean = _normalised(top[poor], relative[poor])
            log_likelihood[poor] += log_mean
            parents = poor[:, None], _parents(weights, draws.uniform[poor, k])
            s, v, log_w = s.copy(), v.copy(), log_w.copy()
            s[poor], v[poor], log_w[poor] = s[parents], v[parents], 0.0
        s, v = motion.advance(s, v, windows.dt_s[k], windows.brake[k], mu)
        s, v = np.add(position[k + 1], s, out=position[k + 1]), np.add(speed[k + 1], v, out=speed[k + 1])
        log_w = np.add(log_w, precision[k] * (windows.position_m[k] - s) ** 2, out=log_weights[k + 1])
        if measured_speed[k].any():
            log_w -= (0.5 / windows.speed_variance[k]) * (windows.speed_mps[k] - v) ** 2
        top = log_w.max(axis=1, keepdims=True)
        relative = np.exp(log_w - top)
        ess[k + 1] = np.einsum("rn->r", relative) ** 2 / np.einsum("rn,rn->r", relative, relative)
    log_likelihood += _normalised(top, relative)[1] + windows.log_constant
    return log_likelihood, ess.min(axis=0)


def _begin(motion: Motion, windows: Windows, draws: Draws, particles: Array) -> None:
    """Write the first positions, speeds and log weights, and of the later ones the noise alone."""
    first = windows.mean[:, None, :] + draws.start @ windows.root.transpose(0, 2, 1)
    particles[0, 0], particles[1, 0], particles[2, 0] = first[..., 0], first[..., 1], 0.0
    for index, variance in enumerate(motion.noise(windows.dt_s)):
        np.multiply(np.sqrt(variance), draws.normal[:, index].transpose(1, 0, 2), out=particles[index, 1:])


def _parents(weights: Array, offsets: Array) -> Indices:
    """Systematic resampling: the particle that each of the N evenly spaced numbers falls on."""
    count = weights.shape[1]
    numbers = (np.arange(count) + offsets[:, None]) / count
    below = np.cumsum(weights, axis=1)[:, None, :] < numbers[:, :, None]
    parents: Indices = np.minimum(below.sum(axis=2), count - 1)
    return parents


def normalised(log_weights: Array) -> tuple[Array, Array]:
    """Normalised weights and the logarithms of the mean weights."""
    top = log_weights.max(axis=1, keepdims=True)
    return _normalised(top, np.exp(log_weights - top))


def _normalised(top: Array, relative: Array) -> tuple[Array, Array]:
    """The same of weights exp(top) * relative."""
    total = relative.sum(axis=1, keepdims=True)
    return relative / total, (top + np.log(total / relative.shape[1]))[:, 0]
