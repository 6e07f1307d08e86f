# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Expectation maximisation of the adhesion in R windows of K steps, Xie et al. 2019, (18)-(34).

The E-step comes in behind the `EStep` protocol. What the M-step needs of it is small: while adhesion limits,
the model is linear in mu, so Q(mu, mu_k) depends on mu through

    Q = const - 1/2 sum_t c_t (min(mu, limit_t) - u_t)^2

with u_t the smoothed adhesion used in step t, c_t its weight and limit_t what the brake could use at most. This
is a parabola between two limits, so its maximum is found exactly where the paper iterates a gradient (33).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from ...physics.motion import Motion
from ...physics.train import GRAVITY, Array
from .particles import ParticleFilter, Particles
from .smoother import MarginalSmoother
from .windows import Windows


class Expectation(NamedTuple):
    """Result of an E-step: the statistics of Q that depend on mu, each of shape (R, K), and diagnostics, (R,)."""

    used: Array
    """u_t, smoothed adhesion used in each step."""
    weight: Array
    """c_t, its information: the complete-data information on mu."""
    limit: Array
    """Largest adhesion the brake could use in each step."""
    log_likelihood: Array
    ess: Array


class EStep(Protocol):
    """An E-step, prepared for windows: smooths each at its adhesion in `mu`, shape (R,)."""

    def __call__(self, mu: Array) -> Expectation: ...


Prepare = Callable[[Windows, Sequence[np.random.Generator]], EStep]
"""Prepares an E-step for windows and the generators of their runs."""


class ParticleEStep:
    """The paper's E-step: bootstrap filter and marginal smoother with so many particles."""

    def __init__(self, motion: Motion, count: int, windows: Windows, rngs: Sequence[np.random.Generator]) -> None:
        self.filter, self.smoother = (
            ParticleFilter(motion, windows, count),
            MarginalSmoother(motion, windows.dt_s, count),
        )
        self.motion, self.windows, self.rngs = motion, windows, rngs

    def __call__(self, mu: Array) -> Expectation:
        """Filter, smooth and reduce to the statistics of Q."""
        particles = self.filter.run(mu, self.rngs)
        return expectation(self.motion, self.windows, mu, particles, self.smoother.run(particles))


class Search(NamedTuple):
    """Where EM starts and when it stops."""

    start: float
    iterations: int
    tolerance: float
    """``|mu_k+1 - mu_k|`` below which it has converged (34)."""
    lowest: float = 0.0
    """Least mu: 0, or a negative number where traction may be at work."""


class Identified(NamedTuple):
    """Result of EM in one window."""

    mu: float
    iterations: int
    converged: bool
    """Whether ``|mu_k+1 - mu_k|`` fell below the tolerance (34)."""
    weight: float
    """Complete-data information on mu, the sum of c_t over the steps that adhesion limits."""
    limit: float
    """Largest adhesion that any step of the window could use."""
    log_likelihood: float
    ess: float


def expectation(motion: Motion, windows: Windows, mu: Array, particles: Particles, marginal: Array) -> Expectation:
    """Reduce particles, filtered at `mu`, (R,), and their smoothed weights to the statistics of I2 (26).

    I2 is quadratic in the step's deviations and these are sums of a term in x_t and a term in x_t+1, so the
    double sum over pairs collapses to the marginal weights (K + 1, R, N). As the particles' steps used
    min(mu, limit), what the smoother adds to it is what they missed.
    """
    states, stepped, before = particles.states, particles.stepped, marginal[:-1]
    missed = np.einsum("ckrn,krn->ckr", stepped, before) - np.einsum("ckrn,krn->ckr", states[:, 1:], marginal[1:])
    resistance = motion.resistance(states[0, :-1], states[1, :-1])
    used = motion.train.used_adhesion(mu[:, None], windows.brake, resistance)
    used = np.einsum("krn,krn->kr", before, np.broadcast_to(used, before.shape))
    dt, brake = windows.dt_s[..., 0], windows.brake[..., 0]
    limit = motion.train.used_adhesion(np.inf, brake, np.einsum("krn,krn->kr", before, resistance))
    effect = GRAVITY * dt * np.stack([0.5 * dt, np.ones_like(dt)])
    variance = np.stack(motion.noise(dt))
    weight = np.sum(effect**2 / variance, axis=0)
    used = used + np.sum(effect * missed / variance, axis=0) / weight
    return Expectation(used.T, weight.T, limit.T, particles.log_likelihood, particles.smallest_ess)


def gradient(expected: Expectation, mu: Array) -> Array:
    """dQ/dmu (29)-(32) at `mu`, (R,): only I2 depends on mu, and only through the steps that adhesion limits."""
    active = expected.limit > mu[:, None]
    return np.asarray(np.sum(expected.weight * (expected.used - mu[:, None]), axis=1, where=active))


def maximise(expected: Expectation, lowest: Array) -> Array:
    """Adhesions, (R,), of at least `lowest`, (R,), that maximise Q, the goal of (33): exact, also at the kink.

    Between two neighbouring limits Q is a parabola; beyond the largest limit it is flat, so the answer never
    exceeds that limit: "at least this much adhesion".
    """
    runs, least = np.arange(len(lowest)), lowest[:, None]
    order = np.argsort(expected.limit, axis=1)
    used, weight, limit = (column[runs[:, None], order] for column in expected[:3])
    limit = np.maximum(limit, least)  # what depends on mu from there on is the same
    # With the j lowest limits below mu, the steps j.. are active and the others keep their limit.
    moments = np.stack((weight, weight * used, weight * used**2))
    active = np.cumsum(moments[:, :, ::-1], axis=2)[:, :, ::-1]
    kept = weight * (limit - used) ** 2
    mu = np.clip(active[1] / active[0], np.concatenate((least, limit[:, :-1]), axis=1), limit)
    loss = np.cumsum(kept, axis=1) - kept + active[2] - mu * (2.0 * active[1] - mu * active[0])
    return np.asarray(mu[runs, np.argmin(loss, axis=1)])


def identify(
    prepare: Prepare, windows: Windows, searches: Sequence[Search], rngs: Sequence[np.random.Generator]
) -> list[Identified]:
    """Alternate E and M steps in every window until they move its mu by no more than the tolerance (34)."""
    found: dict[int, Identified] = {}
    mu, iterations, tolerance, lowest = (np.array(column) for column in zip(*searches, strict=True))
    going, done, prepared = np.arange(len(searches)), 0, 0
    while going.size:
        if prepared != going.size:
            e_step, prepared = prepare(windows.of(going), [rngs[int(run)] for run in going]), going.size
        expected = e_step(mu[going])
        previous, mu[going] = mu[going], maximise(expected, lowest[going])
        # At either end of its range mu stands still for the end's sake, not because EM has arrived.
        top = expected.limit.max(axis=1)
        inside = (lowest[going] < mu[going]) & (mu[going] < top)
        moved = np.where(inside, np.abs(mu[going] - previous), np.inf)
        done += 1
        ended = (moved <= tolerance[going]) | (done >= iterations[going])
        for i in np.flatnonzero(ended):
            run = int(going[i])
            found[run] = Identified(
                mu=float(mu[run]),
                iterations=done,
                converged=bool(moved[i] <= tolerance[run]),
                weight=float(np.sum(expected.weight[i][expected.limit[i] >= mu[run]])),
                limit=float(top[i]),
                log_likelihood=float(expected.log_likelihood[i]),
                ess=float(expected.ess[i]),
            )
        going = going[~ended]
    return [found[run] for run in range(len(searches))]
