# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Bootstrap particle filter and marginal smoother of one window, Xie et al. 2019, (24)-(27).

Times run 0..K: time 0 is the prior, times 1..K carry the window's measurements. N particles; weights are kept as
logarithms. Loops run over time only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...belief.gaussian import Gaussian
from ...belief.window import Observation, Window
from ...physics.motion import Motion, measurement_log_density
from ...physics.train import Array

LEAST_EXPONENT = -300.0
"""Weights below exp of this are no part of any sum, but arithmetic with denormal numbers is slow."""

SMALLEST_TOTAL = 1e-100
"""Column sums of the kernel below this have lost digits; they are formed again, counted from their maximum."""


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
    """Smoothed weights of the filter's particles, and what the backward kernel is made of."""

    marginal: Array
    """w_t|S, shape (K + 1, N)."""
    before: Array
    after: Array
    """ln w_t^i p(x_t+1^j | x_t^i) up to a constant per step is before[t, :, i] . after[t, :, j]; (K, 4, N) each."""

    @property
    def kernel(self) -> Array:
        """Backward kernel p(x_t = i | x_t+1 = j, y), shape (K, N, N): columns sum to one."""
        return _columns(self.before.transpose(0, 2, 1) @ self.after)

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
    """Marginal smoothing weights of the filter's particles, the sums over j of the pairwise ones (27).

    The backward kernel is formed one step at a time, so that it stays in the processor's cache. A step that no
    particle explains well is normalised in logarithms: it is still a law.
    """
    before, after = _exponent(motion, particles, window, mu)
    marginal = np.empty_like(particles.log_weights)
    marginal[-1], _ = _normalised(particles.log_weights[-1])
    count = marginal.shape[1]
    kernel, total, ones = np.empty((count, count)), np.empty(count), np.ones(count)
    least = np.full_like(kernel, LEAST_EXPONENT)  # against an array the maximum takes half the time
    for k in range(window.steps - 1, -1, -1):
        np.matmul(before[k].T, after[k], out=kernel)
        np.maximum(kernel, least, out=kernel)
        np.exp(kernel, out=kernel)
        np.matmul(ones, kernel, out=total)
        if total.min() < SMALLEST_TOTAL:
            kernel, total[:] = _columns(before[k].T @ after[k]), 1.0
        marginal[k] = kernel @ (marginal[k + 1] / total)
    return Smoothed(marginal, before, after)


def _exponent(motion: Motion, particles: Particles, window: Window, mu: float) -> tuple[Array, Array]:
    """Factors a and b, (K, 4, N) each, of ln w_t^i p(x_t+1^j | x_t^i) = a^i . b^j, which they keep at most 0.

    With m the step of i and x = x_t+1^j in standard deviations, -(x - m)^2/2 = m x - m^2/2 - x^2/2. Counted from
    the middle of the cloud it keeps all its digits.
    """
    before, after = np.ones((2, window.steps, 4, particles.position_m.shape[1]))
    before[:, 0], before[:, 1] = motion.advance(
        particles.position_m[:-1], particles.speed_mps[:-1], window.dt_s[:, None], window.brake[:, None], mu
    )
    after[:, 0], after[:, 1] = particles.position_m[1:], particles.speed_mps[1:]
    middle = after[:, :2].mean(axis=2, keepdims=True)
    spread = np.sqrt(np.stack(motion.noise(window.dt_s), axis=1))[:, :, None]
    for states in (before[:, :2], after[:, :2]):
        np.subtract(states, middle, out=states)
        np.divide(states, spread, out=states)
    log_weights = particles.log_weights[:-1] - particles.log_weights[:-1].max(axis=1, keepdims=True)
    before[:, 2] = log_weights - 0.5 * np.einsum("kcn,kcn->kn", before[:, :2], before[:, :2])
    after[:, 3] = -0.5 * np.einsum("kcn,kcn->kn", after[:, :2], after[:, :2])
    return before, after


def _columns(exponent: Array) -> Array:
    """exp of matrices, their columns normalised to sum to one, however far below 0 they are."""
    kernel = np.exp(exponent - exponent.max(axis=-2, keepdims=True))
    return np.asarray(kernel / kernel.sum(axis=-2, keepdims=True))


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
