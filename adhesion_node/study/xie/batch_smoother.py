# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The core's particle smoother and the statistics of its E-step, with a leading axis of runs.

The backward kernels are formed for as many steps at a time as stay in the processor's cache.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.methods.particle_em.particles import LEAST_EXPONENT, SMALLEST_TOTAL
from ...core.physics.motion import Motion
from ...core.physics.train import GRAVITY, Array
from .batch_particles import Cloud, Draws, Windows, particle_filter

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

    kernel: Array
    """(B, R, N, N)."""
    total: Array
    """Its column sums, (B, R, 1, N)."""
    factors: Array
    """Of the exponents, those before and after the step, (2, 4, B, R, N)."""

    @classmethod
    def room(cls, steps: int, runs: int, count: int) -> Kernels:
        """Make room; what is constant is set."""
        return cls(
            np.empty((steps, runs, count, count)),
            np.empty((steps, runs, 1, count)),
            np.ones((2, 4, steps, runs, count)),
        )


class Room(NamedTuple):
    """Room for the E-step of R runs, K steps and N particles, to be used again: fresh memory costs time."""

    draws: Draws
    cloud: Cloud
    marginal: Array
    """Smoothed weights, (K + 1, R, N)."""
    kernels: Kernels

    @classmethod
    def of(cls, runs: int, steps: int, count: int) -> Room:
        """Make room; that of the kernels stays in the processor's cache."""
        return cls(
            Draws.empty(runs, steps, count),
            Cloud.empty(runs, steps, count),
            np.empty((steps + 1, runs, count)),
            Kernels.room(min(max(CACHED // (runs * count * count), 1), steps), runs, count),
        )


def expectations(motion: Motion, windows: Windows, mu: Array, room: Room) -> Expectations:
    """E-step of `core.em.ParticleSmoother` by the draws in `room`; `mu` has shape (R,)."""
    log_likelihood, ess = particle_filter(motion, windows, mu[:, None], room.draws, room.cloud)
    _smooth(motion, windows.dt_s, room)
    return Expectations(*_reduce(motion, windows, mu[:, None], room), log_likelihood, ess)


def _smooth(motion: Motion, dt_s: Array, room: Room) -> None:
    """Write the smoothed marginal weights w_t|S."""
    marginal, at_once = room.marginal, len(room.kernels.kernel)
    last = room.cloud.log_weights[-1]
    relative = np.exp(last - last.max(axis=1, keepdims=True))
    np.divide(relative, relative.sum(axis=1, keepdims=True), out=marginal[-1])
    scale = 1.0 / np.sqrt(np.stack(motion.noise(dt_s)))
    for end in range(len(dt_s), 0, -at_once):
        block = slice(max(end - at_once, 0), end)
        kernels, totals = _kernels(scale[:, block], room, block)
        for k in reversed(range(len(kernels))):
            later, now = marginal[block.start + k + 1], marginal[block.start + k]
            np.matmul(kernels[k], (later / totals[k, :, 0])[:, :, None], out=now[:, :, None])


def _kernels(scale: Array, room: Room, block: slice) -> tuple[Array, Array]:
    """The kernels of some steps, up to a factor for each column, and their column sums.

    ln w_t^i p(x_t+1^j | x_t^i) up to a constant is a product of matrices (N, 4) and (4, N), as in `core.particle`;
    the fourth column keeps it at most 0, so that no maximum is needed.
    """
    states, stepped, log_weights = room.cloud
    kernel, total = (buffer[: block.stop - block.start] for buffer in room.kernels[:2])
    before, after = room.kernels.factors[:, :, : len(kernel)]
    later = slice(block.start + 1, block.stop + 1)
    origin = states[:, later, :, :1]  # counted from one of the cloud's members the products keep their digits
    for reached, factor in ((stepped[:, block], before[:2]), (states[:, later], after[:2])):
        np.subtract(reached, origin, out=factor)
        np.multiply(factor, scale, out=factor)
    before[2] = log_weights[block] - 0.5 * np.einsum("cbrn,cbrn->brn", before[:2], before[:2])
    after[3] = -0.5 * np.einsum("cbrn,cbrn->brn", after[:2], after[:2])
    rows, columns = before.transpose(1, 2, 3, 0), after.transpose(1, 2, 0, 3)
    np.matmul(rows, columns, out=kernel)
    np.maximum(kernel, LEAST_EXPONENT, out=kernel)
    np.exp(kernel, out=kernel)
    ones = np.ones((1, kernel.shape[-1]))
    np.matmul(ones, kernel, out=total)
    for k in np.flatnonzero(total.min(axis=(1, 2, 3)) < SMALLEST_TOTAL):
        exponent = rows[k] @ columns[k]
        np.exp(exponent - exponent.max(axis=1, keepdims=True), out=kernel[k])
        np.matmul(ones, kernel[k], out=total[k])
    return kernel, total


def _reduce(motion: Motion, windows: Windows, mu: Array, room: Room) -> tuple[Array, Array, Array]:
    """Statistics of I2 that depend on mu: the first three of `Expectations`.

    As the steps of the particles used min(mu, limit), what the smoother adds to it is what they missed.
    """
    states, stepped, _ = room.cloud
    before, after = room.marginal[:-1], room.marginal[1:]
    missed = np.einsum("ckrn,krn->ckr", stepped, before) - np.einsum("ckrn,krn->ckr", states[:, 1:], after)
    dt, brake = windows.dt_s[..., 0], windows.brake[..., 0]
    resistance = motion.resistance(states[0, :-1], states[1, :-1])
    by_step = np.sum(before * motion.train.used_adhesion(mu, windows.brake, resistance), axis=2)
    limit = motion.train.used_adhesion(np.inf, brake, np.einsum("krn,krn->kr", before, resistance))
    effect = GRAVITY * dt * np.stack([0.5 * dt, np.ones_like(dt)])
    variance = np.stack(motion.noise(dt))
    weight = np.sum(effect**2 / variance, axis=0)
    used = by_step + np.sum(effect * missed / variance, axis=0) / weight
    return used.T, weight.T, np.broadcast_to(limit, dt.shape).T
