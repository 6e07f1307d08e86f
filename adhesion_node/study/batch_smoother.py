"""The core's particle smoother and the statistics of its E-step, with a leading axis of runs.

The backward kernels are formed for as many steps at a time as stay in the processor's cache.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.motion import Motion
from ..core.particle import LEAST_EXPONENT, SMALLEST_TOTAL
from ..core.train import GRAVITY, Array
from .batch_particles import Draws, Windows, normalised, particle_filter

CACHED = 60_000
"""Numbers in the kernels that are formed at a time."""


class Expectations(NamedTuple):
    """`core.em.Expectation` of R runs: (R, K) each, then (R,)."""

    used: Array
    weight: Array
    limit: Array
    log_likelihood: Array
    ess: Array


class Kernels(NamedTuple):
    """Backward kernels of B steps, and what they are formed from."""

    least: Array
    """`LEAST_EXPONENT`, (B, R, N, N): numpy's maximum of two arrays is faster than that of an array and a number."""
    before: Array
    """Factors of the exponents, (B, R, N, 4) and (B, R, 4, N)."""
    after: Array
    kernel: Array
    """(B, R, N, N)."""
    total: Array
    """Its column sums, (B, R, 1, N)."""

    @classmethod
    def room(cls, steps: int, runs: int, count: int) -> Kernels:
        """Make room; what is constant is set."""
        return cls(
            np.full((steps, runs, count, count), LEAST_EXPONENT),
            np.ones((steps, runs, count, 4)),
            np.ones((steps, runs, 4, count)),
            np.empty((steps, runs, count, count)),
            np.empty((steps, runs, 1, count)),
        )


class Room(NamedTuple):
    """Room for the E-step of R runs, K steps and N particles, to be used again: fresh memory costs time."""

    draws: Draws
    particles: Array
    """Positions, speeds and log weights, (3, K + 1, R, N)."""
    marginal: Array
    """Smoothed weights, (K + 1, R, N)."""
    kernels: Kernels

    @classmethod
    def of(cls, runs: int, steps: int, count: int) -> Room:
        """Make room; that of the kernels stays in the processor's cache."""
        return cls(
            Draws.empty(runs, steps, count),
            np.empty((3, steps + 1, runs, count)),
            np.empty((steps + 1, runs, count)),
            Kernels.room(min(max(CACHED // (runs * count * count), 1), steps), runs, count),
        )


def expectations(motion: Motion, windows: Windows, mu: Array, room: Room) -> Expectations:
    """E-step of `core.em.ParticleSmoother` by the draws in `room`; `mu` has shape (R,)."""
    log_likelihood, ess = particle_filter(motion, windows, mu[:, None], room.draws, room.particles)
    _smooth(motion, windows, mu[:, None], room)
    return _reduce(motion, windows, room, log_likelihood, ess)


def _smooth(motion: Motion, windows: Windows, mu: Array, room: Room) -> None:
    """Write the smoothed marginal weights w_t|S."""
    marginal, at_once = room.marginal, len(room.kernels.kernel)
    marginal[-1], _ = normalised(room.particles[2, -1])
    for end in range(len(windows.dt_s), 0, -at_once):
        block = range(max(end - at_once, 0), end)
        kernels, totals = _kernels(motion, windows, mu, room, block)
        for k, kernel, total in zip(reversed(block), kernels[::-1], totals[::-1], strict=True):
            marginal[k] = (kernel @ (marginal[k + 1] / total[:, 0])[:, :, None])[:, :, 0]


def _kernels(motion: Motion, windows: Windows, mu: Array, room: Room, block: range) -> tuple[Array, Array]:
    """The kernels of some steps, up to a factor for each column, and their column sums.

    ln w_t^i p(x_t+1^j | x_t^i) up to a constant is a product of matrices (N, 4) and (4, N), as in `core.particle`;
    the fourth column keeps it at most 0, so that no maximum is needed.
    """
    position, speed, log_weights = room.particles
    now, later = slice(block.start, block.stop), slice(block.start + 1, block.stop + 1)
    least, before, after, kernel, total = (buffer[: len(block)] for buffer in room.kernels)
    var_s, var_v = motion.noise(windows.dt_s[now])
    step_s, step_v = motion.advance(position[now], speed[now], windows.dt_s[now], windows.brake[now], mu)
    # Counted from one of the cloud's members the products keep their digits.
    origin_s, origin_v = position[later, :, :1], speed[later, :, :1]
    step_s, step_v = step_s - origin_s, step_v - origin_v
    next_s, next_v = position[later] - origin_s, speed[later] - origin_v
    scaled_s, scaled_v = step_s / var_s, step_v / var_v
    before[..., 0], before[..., 1] = scaled_s, scaled_v
    before[..., 2] = log_weights[now] - 0.5 * (step_s * scaled_s + step_v * scaled_v)
    after[:, :, 0], after[:, :, 1] = next_s, next_v
    after[:, :, 3] = (-0.5 / var_s) * next_s**2 - (0.5 / var_v) * next_v**2
    np.matmul(before, after, out=kernel)
    np.maximum(kernel, least, out=kernel)
    np.exp(kernel, out=kernel)
    ones = np.ones((1, kernel.shape[-1]))
    np.matmul(ones, kernel, out=total)
    for k in np.flatnonzero(total.min(axis=(1, 2, 3)) < SMALLEST_TOTAL):
        exponent = before[k] @ after[k]
        np.exp(exponent - exponent.max(axis=1, keepdims=True), out=kernel[k])
        np.matmul(ones, kernel[k], out=total[k])
    return kernel, total


def _reduce(motion: Motion, windows: Windows, room: Room, log_likelihood: Array, ess: Array) -> Expectations:
    """Statistics of I2 that depend on mu, as `core.em.expectation`."""
    dt = windows.dt_s[..., 0]
    steps, (runs, count) = len(dt), room.marginal.shape[1:]
    at_once = max(CACHED // (runs * count), 1)
    blocks = [slice(begin, min(begin + at_once, steps)) for begin in range(0, steps, at_once)]
    moments = [_moments(motion, windows, room, block) for block in blocks]
    after_s, after_v, before_s, before_v, resistance = np.concatenate(moments, axis=1)
    effect_v, effect_s = GRAVITY * dt, 0.5 * GRAVITY * dt**2
    var_s, var_v = motion.noise(dt)
    weight = effect_v**2 / var_v + effect_s**2 / var_s
    lost = effect_v * (before_v - after_v) / var_v + effect_s * (before_s - after_s) / var_s
    limit = np.broadcast_to(motion.train.used_adhesion(np.inf, windows.brake[..., 0], resistance), dt.shape)
    return Expectations((lost / weight).T, weight.T, limit.T, log_likelihood, ess)


def _moments(motion: Motion, windows: Windows, room: Room, block: slice) -> Array:
    """Smoothed means (5, B, R) over some steps.

    Position and speed after a step, both as an unbraked step from before leads to them, and the resistance before.
    """
    later = slice(block.start + 1, block.stop + 1)
    position, speed, _ = room.particles
    dt = windows.dt_s[block]
    resistance = motion.resistance(position[block], speed[block])
    unbraked_v = speed[block] - GRAVITY * dt * resistance
    unbraked_s = position[block] + 0.5 * dt * (speed[block] + unbraked_v)
    after, before = room.marginal[later], room.marginal[block]
    pairs = [(after, position[later]), (after, speed[later])]
    pairs += [(before, values) for values in (unbraked_s, unbraked_v, resistance)]
    return np.stack([np.einsum("krn,krn->kr", weights, values) for weights, values in pairs])
