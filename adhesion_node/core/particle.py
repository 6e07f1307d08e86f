"""Bootstrap particle filter and marginal smoother of one window, Xie et al. 2019, (24)-(27).

Times run 0..K: time 0 is the prior, times 1..K carry the window's measurements. N particles; weights are kept as
logarithms. Loops run over time only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .gaussian import Gaussian
from .motion import Motion, measurement_log_density
from .train import Array
from .window import Observation, Window


class Particles(NamedTuple):
    """The filter's particles and log weights up to a constant per time, each of shape (K + 1, N)."""

    position_m: Array
    speed_mps: Array
    log_weights: Array
    log_likelihood: float
    """ln p(y_1:K) at the filter's adhesion (14)(15)."""
    smallest_ess: float
    """Smallest effective sample size over the window, 1..N."""


class Smoothed(NamedTuple):
    """Smoothed weights of the filter's particles."""

    marginal: Array
    """w_t|S, shape (K + 1, N)."""
    kernel: Array
    """Backward kernel p(x_t = i | x_t+1 = j, y), shape (K, N, N): columns sum to one."""

    @property
    def pairwise(self) -> Array:
        """Pairwise weights w^ij_t|S (27), shape (K, N, N)."""
        return self.kernel * self.marginal[1:, None, :]


def particle_filter(
    motion: Motion, prior: Gaussian, window: Window, mu: float, count: int, rng: np.random.Generator
) -> Particles:
    """Bootstrap filter of Y (13) with `count` particles: p(y_t|Y_1:t-1) (16) is the mean weight.

    Resamples systematically where the effective sample size falls below half of the particles.
    """
    steps = window.steps
    position, speed, log_weights = np.empty((3, steps + 1, count))
    var_s, var_v = motion.noise(window.dt_s[:, None])
    jitter_s = np.sqrt(var_s) * rng.standard_normal((steps, count))
    jitter_v = np.sqrt(var_v) * rng.standard_normal((steps, count))
    offsets = rng.random(steps)
    grid = np.arange(count)
    dt, brake = window.dt_s.tolist(), window.brake.tolist()
    position[0], speed[0] = prior.draw(count, rng).T
    log_weights[0] = 0.0
    s, v, log_w, ess = position[0], speed[0], log_weights[0], float(count)
    log_likelihood, smallest_ess = 0.0, ess
    for k in range(steps):
        if ess < count / 2:
            weights, log_mean = _normalised(log_w)
            log_likelihood += log_mean
            # The weights sum to one only up to rounding, hence the clip.
            parents = np.minimum(np.searchsorted(np.cumsum(weights), (grid + offsets[k]) / count), count - 1)
            s, v, log_w = s[parents], v[parents], log_weights[0]
        s, v = motion.advance(s, v, dt[k], brake[k], mu)
        s, v = s + jitter_s[k], v + jitter_v[k]
        log_w = log_w + _relative_log_density(window.observations[k], s, v)
        relative = np.exp(log_w - log_w.max())
        ess = float(relative.sum()) ** 2 / float(relative @ relative)
        smallest_ess = min(smallest_ess, ess)
        position[k + 1], speed[k + 1], log_weights[k + 1] = s, v, log_w
    log_likelihood += _normalised(log_w)[1] + window.log_constant
    return Particles(position, speed, log_weights, log_likelihood, smallest_ess)


def particle_smoother(motion: Motion, particles: Particles, window: Window, mu: float) -> Smoothed:
    """Marginal and pairwise smoothing weights (27) of the filter's particles.

    The backward kernel is normalised in logarithms, so a step that no particle explains well is still a law.
    """
    kernel = _log_kernel(motion, particles, window, mu)
    kernel -= kernel.max(axis=1, keepdims=True)
    np.exp(kernel, out=kernel)
    kernel /= kernel.sum(axis=1, keepdims=True)
    marginal = np.empty_like(particles.log_weights)
    marginal[-1], _ = _normalised(particles.log_weights[-1])
    for k in range(window.steps - 1, -1, -1):
        marginal[k] = kernel[k] @ marginal[k + 1]
    return Smoothed(marginal, kernel)


def _log_kernel(motion: Motion, particles: Particles, window: Window, mu: float) -> Array:
    """ln w_t^i p(x_t+1^j | x_t^i) up to a term of j, which cancels in the normalisation; shape (K, N, N).

    -(x - m)^2/2q = x m/q - m^2/2q - x^2/2q with m the step of i and x = x_t+1^j: without the last term this is one
    product of matrices (N, 3) and (3, N). Counted from the middle of the cloud, it keeps all its digits.
    """
    position, speed = particles.position_m[1:], particles.speed_mps[1:]
    middle_s, middle_v = position.mean(axis=1, keepdims=True), speed.mean(axis=1, keepdims=True)
    step_s, step_v = motion.advance(
        particles.position_m[:-1], particles.speed_mps[:-1], window.dt_s[:, None], window.brake[:, None], mu
    )
    step_s, step_v = step_s - middle_s, step_v - middle_v
    var_s, var_v = motion.noise(window.dt_s[:, None])
    scaled_s, scaled_v = step_s / var_s, step_v / var_v
    own = particles.log_weights[:-1] - 0.5 * (step_s * scaled_s + step_v * scaled_v)
    before = np.stack([scaled_s, scaled_v, own], axis=2)
    after = np.stack([position - middle_s, speed - middle_v, np.ones_like(speed)], axis=1)
    return np.asarray(before @ after, dtype=np.float64)


def pairwise_errors(motion: Motion, particles: Particles, window: Window, mu: float) -> tuple[Array, Array]:
    """Deviations of every particle j at t + 1 from the noise-free step of every i at t, each (K, N, N)."""
    position, speed = motion.advance(
        particles.position_m[:-1], particles.speed_mps[:-1], window.dt_s[:, None], window.brake[:, None], mu
    )
    return (
        particles.position_m[1:, None, :] - position[:, :, None],
        particles.speed_mps[1:, None, :] - speed[:, :, None],
    )


def expected_log_likelihood(
    motion: Motion, prior: Gaussian, particles: Particles, smoothed: Smoothed, window: Window, mu: float
) -> tuple[float, float, float]:
    """The parts I1, I2 and I3 of Q(mu, mu_k) (18)-(20), (28): the integrals (21)-(23) as sums (24)-(26).

    Prior, steps and measurements are the three factors of the joint density (17)(19).
    """
    states = np.stack([particles.position_m[0], particles.speed_mps[0]], axis=-1)
    errors = pairwise_errors(motion, particles, window, mu)
    log_steps = motion.transition_log_density(*errors, window.dt_s[:, None, None])
    log_measured = measurement_log_density(
        particles.position_m[1:], window.position_m[:, None], window.variance_m2[:, None]
    )
    with_speed = np.isfinite(window.speed_variance)
    log_measured[with_speed] += measurement_log_density(
        particles.speed_mps[1:][with_speed],
        window.speed_mps[with_speed, None],
        window.speed_variance[with_speed, None],
    )
    return (
        float(smoothed.marginal[0] @ prior.log_density(states)),
        float(np.sum(smoothed.pairwise * log_steps)),
        float(np.sum(smoothed.marginal[1:] * log_measured)),
    )


def _relative_log_density(observed: Sequence[Observation], position: Array, speed: Array) -> Array:
    """ln p(y|x) (11) without its constant, which no weight depends on."""
    (_, measured, variance), *others = observed
    density = (-0.5 / variance) * (measured - position) ** 2
    for _, measured, variance in others:
        density = density - (0.5 / variance) * (measured - speed) ** 2
    return density


def _normalised(log_weights: Array) -> tuple[Array, float]:
    """Normalised weights and the logarithm of the mean weight."""
    top = float(log_weights.max())
    weights = np.exp(log_weights - top)
    total = float(weights.sum())
    return weights / total, top + math.log(total / weights.size)
