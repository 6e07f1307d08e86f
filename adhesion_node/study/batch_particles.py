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


def stack(priors: Sequence[Gaussian], windows: Sequence[Window]) -> Windows:
    """Put windows of equal length together."""
    names = ("dt_s", "brake", "position_m", "variance_m2", "speed_mps", "speed_variance")
    return Windows(
        mean=np.stack([prior.mean for prior in priors]),
        root=np.linalg.cholesky(np.stack([prior.covariance for prior in priors])),
        log_constant=np.array([window.log_constant for window in windows]),
        **{name: np.stack([getattr(window, name) for window in windows], axis=1)[:, :, None] for name in names},
    )


def draw(rngs: Sequence[np.random.Generator], steps: int, count: int) -> Draws:
    """Draw what one filter run takes, in the core's order; runs that share a generator share its numbers."""
    own = list(dict.fromkeys(rngs))
    draws = Draws(*(np.empty((len(own), *shape)) for shape in ((2, steps, count), (steps,), (count, 2))))
    for run, rng in enumerate(own):
        rng.standard_normal(out=draws.normal[run])
        rng.random(out=draws.uniform[run])
        rng.standard_normal(out=draws.start[run])
    shares = [own.index(rng) for rng in rngs]
    return draws if len(own) == len(rngs) else Draws(*(column[shares] for column in draws))


def particle_filter(
    motion: Motion, windows: Windows, mu: Array, draws: Draws
) -> tuple[Array, Array, Array, Array, Array]:
    """Bootstrap filter: positions, speeds and log weights (K + 1, R, N), log likelihoods and smallest ESS (R,)."""
    steps, runs, _ = windows.dt_s.shape
    count = draws.start.shape[1]
    position, speed, log_weights = np.empty((3, steps + 1, runs, count))
    spread_s, spread_v = (np.sqrt(np.asarray(variance)) for variance in motion.noise(windows.dt_s))
    first = windows.mean[:, None, :] + draws.start @ windows.root.transpose(0, 2, 1)
    position[0], speed[0], log_weights[0] = first[..., 0], first[..., 1], 0.0
    ess, log_likelihood = np.full(runs, float(count)), np.zeros(runs)
    smallest_ess = ess
    measured_speed = np.isfinite(windows.speed_variance)
    for k in range(steps):
        s, v, log_w = position[k], speed[k], log_weights[k]
        poor = np.flatnonzero(ess < count / 2)
        if poor.size:
            weights, log_mean = normalised(log_w[poor])
            log_likelihood[poor] += log_mean
            parents = _parents(weights, draws.uniform[poor, k])
            s, v, log_w = s.copy(), v.copy(), log_w.copy()
            s[poor], v[poor] = (np.take_along_axis(x[poor], parents, axis=1) for x in (s, v))
            log_w[poor] = 0.0
        s, v = motion.advance(s, v, windows.dt_s[k], windows.brake[k], mu)
        s += spread_s[k] * draws.normal[:, 0, k]
        v += spread_v[k] * draws.normal[:, 1, k]
        log_w = log_w + (-0.5 / windows.variance_m2[k]) * (windows.position_m[k] - s) ** 2
        if measured_speed[k].any():
            log_w -= (0.5 / windows.speed_variance[k]) * (windows.speed_mps[k] - v) ** 2
        relative = np.exp(log_w - log_w.max(axis=1, keepdims=True))
        ess = np.einsum("rn->r", relative) ** 2 / np.einsum("rn,rn->r", relative, relative)
        smallest_ess = np.minimum(smallest_ess, ess)
        position[k + 1], speed[k + 1], log_weights[k + 1] = s, v, log_w
    log_likelihood += normalised(log_weights[-1])[1] + windows.log_constant
    return position, speed, log_weights, log_likelihood, smallest_ess


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
    weights = np.exp(log_weights - top)
    total = weights.sum(axis=1, keepdims=True)
    return weights / total, (top + np.log(total / weights.shape[1]))[:, 0]
