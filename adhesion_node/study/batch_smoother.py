"""The core's particle smoother and the statistics of its E-step, with a leading axis of runs.

The backward kernel is formed one step at a time, so that it stays in the processor's cache.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.motion import Motion
from ..core.particle import LEAST_EXPONENT, SMALLEST_TOTAL
from ..core.train import GRAVITY, Array
from .batch_particles import Draws, Windows, normalised, particle_filter


class Expectations(NamedTuple):
    """`core.em.Expectation` of R runs: (R, K) each, then (R,)."""

    used: Array
    weight: Array
    limit: Array
    log_likelihood: Array
    ess: Array


def expectations(motion: Motion, windows: Windows, mu: Array, draws: Draws) -> Expectations:
    """E-step of `core.em.ParticleSmoother`; `mu` has shape (R,)."""
    position, speed, log_weights, log_likelihood, ess = particle_filter(motion, windows, mu[:, None], draws)
    marginal = _smooth(motion, windows, mu[:, None], (position, speed, log_weights))
    return _reduce(motion, windows, (position, speed, marginal), log_likelihood, ess)


def _smooth(motion: Motion, windows: Windows, mu: Array, particles: tuple[Array, Array, Array]) -> Array:
    """Smoothed marginal weights w_t|S, (K + 1, R, N).

    ln w_t^i p(x_t+1^j | x_t^i) up to a constant is a product of matrices (N, 4) and (4, N), as in `core.particle`;
    the fourth column keeps it at most 0, so that no maximum is needed.
    """
    position, speed, log_weights = particles
    marginal = np.empty_like(log_weights)
    marginal[-1], _ = normalised(log_weights[-1])
    _, runs, count = marginal.shape
    before, after = np.ones((runs, count, 4)), np.ones((runs, 4, count))
    kernel, total, ones = np.empty((runs, count, count)), np.empty((runs, 1, count)), np.ones((1, count))
    least = np.full_like(kernel, LEAST_EXPONENT)
    for k in range(len(windows.dt_s) - 1, -1, -1):
        var_s, var_v = motion.noise(windows.dt_s[k])
        step_s, step_v = motion.advance(position[k], speed[k], windows.dt_s[k], windows.brake[k], mu)
        # Counted from one of the cloud's members the products keep their digits.
        origin_s, origin_v = position[k + 1, :, :1], speed[k + 1, :, :1]
        step_s, step_v = step_s - origin_s, step_v - origin_v
        next_s, next_v = position[k + 1] - origin_s, speed[k + 1] - origin_v
        scaled_s, scaled_v = step_s / var_s, step_v / var_v
        before[..., 0], before[..., 1] = scaled_s, scaled_v
        before[..., 2] = log_weights[k] - 0.5 * (step_s * scaled_s + step_v * scaled_v)
        after[:, 0], after[:, 1] = next_s, next_v
        after[:, 3] = (-0.5 / var_s) * next_s**2 - (0.5 / var_v) * next_v**2
        np.matmul(before, after, out=kernel)
        np.maximum(kernel, least, out=kernel)
        np.exp(kernel, out=kernel)
        np.matmul(ones, kernel, out=total)
        if total.min() < SMALLEST_TOTAL:
            exponent = before @ after
            np.exp(exponent - exponent.max(axis=1, keepdims=True), out=kernel)
            np.matmul(ones, kernel, out=total)
        marginal[k] = (kernel @ (marginal[k + 1] / total[:, 0])[:, :, None])[:, :, 0]
    return marginal


def _reduce(
    motion: Motion, windows: Windows, smoothed: tuple[Array, Array, Array], log_likelihood: Array, ess: Array
) -> Expectations:
    """Statistics of I2 that depend on mu, as `core.em.expectation`."""
    position, speed, marginal = smoothed
    dt = windows.dt_s
    resistance = motion.resistance(position[:-1], speed[:-1])
    unbraked_v = speed[:-1] - GRAVITY * dt * resistance
    unbraked_s = position[:-1] + 0.5 * dt * (speed[:-1] + unbraked_v)
    after = [np.einsum("krn,krn->kr", marginal[1:], values) for values in (position[1:], speed[1:])]
    before = [np.einsum("krn,krn->kr", marginal[:-1], values) for values in (unbraked_s, unbraked_v, resistance)]
    dt = dt[..., 0]
    effect_v, effect_s = GRAVITY * dt, 0.5 * GRAVITY * dt**2
    var_s, var_v = motion.noise(dt)
    weight = effect_v**2 / var_v + effect_s**2 / var_s
    lost = effect_v * (before[1] - after[1]) / var_v + effect_s * (before[0] - after[0]) / var_s
    limit = np.broadcast_to(motion.train.used_adhesion(np.inf, windows.brake[..., 0], before[2]), dt.shape)
    return Expectations((lost / weight).T, weight.T, limit.T, log_likelihood, ess)
