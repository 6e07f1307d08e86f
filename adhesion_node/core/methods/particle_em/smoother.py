# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Marginal particle smoother of R windows of K steps with N particles each, Xie et al. 2019, (27).

The backward kernels are formed for as many steps at a time as stay in the processor's cache.
"""

from typing import NamedTuple

import numpy as np

from ...physics.motion import Motion
from ...physics.train import Array
from .particles import Particles

LEAST_EXPONENT = -300.0
"""Weights below exp of this are no part of any sum, but arithmetic with denormal numbers is slow."""

SMALLEST_TOTAL = 1e-100
"""Column sums of a kernel below this have lost digits; they are formed again, counted from their maximum."""

CACHED = 60_000
"""Numbers in the kernels that are formed at a time."""


class Block(NamedTuple):
    """What B steps of the smoother work on: views of the arrays that a pass fills."""

    before: Array
    """Factors of the kernels' exponents, (B, R, N, 4)."""
    after: Array
    """(B, R, 4, N)."""
    kernel: Array
    """(B, R, N, N)."""
    least: Array
    """Least exponents, (B, R, N, N)."""
    totals: Array
    """Sums of the kernels' columns, (B, R, 1, N)."""
    steps: list[tuple[Array, Array, Array, Array]]
    """Of each step, the last one first: kernel, its sums as a column, and the smoothed weights after and before it."""


class MarginalSmoother:
    """The smoother, prepared for windows of steps `dt_s`, (K, R, 1), and a number of particles N."""

    def __init__(self, motion: Motion, dt_s: Array, count: int) -> None:
        steps, runs, _ = dt_s.shape
        self.scale = 1.0 / np.sqrt(np.stack(motion.noise(dt_s)))
        self.marginal = np.empty((steps + 1, runs, count))
        self.before, self.after = np.ones((2, steps, runs, 4, count))
        self.ones = np.ones((1, count))
        at_once = min(max(CACHED // (runs * count * count), 1), steps)
        kernels, totals = np.empty((at_once, runs, count, count)), np.empty((at_once, runs, count, 1))
        least = np.full_like(kernels, LEAST_EXPONENT)  # an array: the maximum takes a quarter of the time
        columns = self.marginal[..., None]
        self.blocks = []
        for end in range(steps, 0, -at_once):
            start = max(end - at_once, 0)
            kernel, total = kernels[: end - start], totals[: end - start]
            each = zip(kernel, total, columns[start + 1 : end + 1], columns[start:end], strict=True)
            before, after = self.before[start:end].swapaxes(2, 3), self.after[start:end]
            self.blocks.append(
                Block(before, after, kernel, least[: end - start], total.swapaxes(2, 3), list(each)[::-1])
            )

    def run(self, particles: Particles) -> Array:
        """Smoothed weights w_t|S of the particles, (K + 1, R, N); the next pass writes over them.

        With the backward kernels p(x_t = i | x_t+1 = j, y) they are the sums over j of the pairwise weights (27).
        """
        self._factorise(particles)
        last = particles.log_weights[-1]
        weights = np.exp(last - last.max(axis=1, keepdims=True))
        np.divide(weights, weights.sum(axis=1, keepdims=True), out=self.marginal[-1])
        for block in self.blocks:
            self._form(block)
            for kernel, total, later, now in block.steps:
                np.matmul(kernel, later / total, out=now)
        return self.marginal

    def _form(self, block: Block) -> None:
        """Form the backward kernels up to a factor per column, and the sums of their columns.

        A step that no particle explains well is counted from its most likely one: it is still a law.
        """
        before, after, kernel, least, totals, _ = block
        np.matmul(before, after, out=kernel)
        np.maximum(kernel, least, out=kernel)
        np.exp(kernel, out=kernel)
        np.matmul(self.ones, kernel, out=totals)
        if totals.min() < SMALLEST_TOTAL:
            for k in np.flatnonzero(totals.min(axis=(1, 2, 3)) < SMALLEST_TOTAL):
                exponent = before[k] @ after[k]
                np.exp(exponent - exponent.max(axis=1, keepdims=True), out=kernel[k])
                np.matmul(self.ones, kernel[k], out=totals[k])

    def _factorise(self, particles: Particles) -> None:
        """Form a, (K, R, 4, N), and b alike, whose product a'b is ln w_t^i p(x_t+1^j | x_t^i) up to a constant per j.

        With m the step of i and x = x_t+1^j in standard deviations, -(x - m)^2/2 = m x - m^2/2 - x^2/2. The last
        term keeps the product at most 0; counted from one of the particles it keeps all its digits.
        """
        reached = particles.states[:, 1:]
        before, after = self.before.transpose(2, 0, 1, 3), self.after.transpose(2, 0, 1, 3)
        for places, factor in ((particles.stepped, before[:2]), (reached, after[:2])):
            np.subtract(places, reached[..., :1], out=factor)
            np.multiply(factor, self.scale, out=factor)
        np.subtract(
            particles.log_weights[:-1], 0.5 * np.einsum("ckrn,ckrn->krn", before[:2], before[:2]), out=before[2]
        )
        np.multiply(-0.5, np.einsum("ckrn,ckrn->krn", after[:2], after[:2]), out=after[3])
