# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Expectation maximisation of the adhesion in one window, Xie et al. 2019, (18)-(34).

The E-step comes in behind the `Smoother` protocol. What the M-step needs of it is small: while adhesion limits,
the model is linear in mu, so Q(mu, mu_k) depends on mu through

    Q = const - 1/2 sum_t c_t (min(mu, limit_t) - u_t)^2

with u_t the smoothed adhesion used in step t, c_t its weight and limit_t what the brake could use at most. This
is a parabola between two limits, so its maximum is found exactly where the paper iterates a gradient (33).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from ...belief.gaussian import Gaussian
from ...belief.window import Window
from ...physics.motion import Motion
from ...physics.train import GRAVITY, Array
from .particles import Particles, Smoothed, particle_filter, particle_smoother


class Expectation(NamedTuple):
    """Result of an E-step: the statistics of Q that depend on mu, each of shape (K,), and diagnostics."""

    used: Array
    """u_t, smoothed adhesion used in each step."""
    weight: Array
    """c_t, its information: the complete-data information on mu."""
    limit: Array
    """Largest adhesion the brake could use in each step."""
    log_likelihood: float
    ess: float


class Smoother(Protocol):
    """An E-step: smooths the window at adhesion `mu` from the law of its first state."""

    def __call__(
        self, motion: Motion, prior: Gaussian, window: Window, mu: float, rng: np.random.Generator
    ) -> Expectation: ...


@dataclass(frozen=True, slots=True)
class ParticleSmoother:
    """The paper's E-step: bootstrap filter and marginal smoother with so many particles."""

    particles: int

    def __call__(
        self, motion: Motion, prior: Gaussian, window: Window, mu: float, rng: np.random.Generator
    ) -> Expectation:
        """Filter, smooth and reduce to the statistics of Q."""
        particles = particle_filter(motion, prior, window, mu, self.particles, rng)
        smoothed = particle_smoother(motion, particles, window, mu)
        return expectation(motion, particles, smoothed, window)


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


def expectation(motion: Motion, particles: Particles, smoothed: Smoothed, window: Window) -> Expectation:
    """Reduce the smoothed particles to the statistics of I2 (26) that depend on mu.

    I2 is quadratic in the step's deviations and these are sums of a term in x_t and a term in x_t+1, so the
    double sum over pairs collapses to the marginal weights.
    """
    dt = window.dt_s
    resistance = motion.resistance(particles.position_m[:-1], particles.speed_mps[:-1])
    unbraked_v = particles.speed_mps[:-1] - GRAVITY * dt[:, None] * resistance
    unbraked_s = particles.position_m[:-1] + 0.5 * dt[:, None] * (particles.speed_mps[:-1] + unbraked_v)
    position, speed, before_s, before_v, mean_resistance = (
        np.einsum("tn,tn->t", weights, values)
        for weights, values in (
            (smoothed.marginal[1:], particles.position_m[1:]),
            (smoothed.marginal[1:], particles.speed_mps[1:]),
            (smoothed.marginal[:-1], unbraked_s),
            (smoothed.marginal[:-1], unbraked_v),
            (smoothed.marginal[:-1], resistance),
        )
    )
    effect_v, effect_s = GRAVITY * dt, 0.5 * GRAVITY * dt**2
    var_s, var_v = motion.noise(dt)
    weight = effect_v**2 / var_v + effect_s**2 / var_s
    lost = effect_v * (before_v - speed) / var_v + effect_s * (before_s - position) / var_s
    return Expectation(
        used=lost / weight,
        weight=weight,
        limit=np.broadcast_to(motion.train.used_adhesion(np.inf, window.brake, mean_resistance), dt.shape),
        log_likelihood=particles.log_likelihood,
        ess=particles.smallest_ess,
    )


def gradient(expected: Expectation, mu: float) -> float:
    """dQ/dmu (29)-(32): only I2 depends on mu, and only through the steps that adhesion limits."""
    active = expected.limit > mu
    return float(np.sum((expected.weight * (expected.used - mu))[active]))


def maximise(expected: Expectation, lowest: float) -> float:
    """Adhesion of at least `lowest` that maximises Q, the goal of (33): exact, also at the kink.

    Between two neighbouring limits Q is a parabola; beyond the largest limit it is flat, so the answer never
    exceeds that limit: "at least this much adhesion".
    """
    order = np.argsort(expected.limit)
    limit, used, weight = expected.limit[order], expected.used[order], expected.weight[order]
    # With the j lowest limits below mu, the steps j.. are active and the others keep their limit.
    active_weight = np.cumsum(weight[::-1])[::-1]
    active_moment = np.cumsum((weight * used)[::-1])[::-1]
    bottoms = np.maximum(np.concatenate(([lowest], limit[:-1])), lowest)
    tops = np.maximum(limit, lowest)
    candidates = np.clip(active_moment / active_weight, bottoms, tops)
    deviation = np.minimum(candidates[:, None], limit) - used
    return float(candidates[np.argmax(-np.sum(weight * deviation**2, axis=1))])


def identify(
    smoother: Smoother, motion: Motion, prior: Gaussian, window: Window, search: Search, rng: np.random.Generator
) -> Identified:
    """Alternate E and M steps until they move mu by no more than the tolerance (34)."""
    mu, moved, done = search.start, np.inf, 0
    while done < search.iterations and moved > search.tolerance:
        expected = smoother(motion, prior, window, mu, rng)
        previous, mu = mu, maximise(expected, search.lowest)
        # At either end of its range mu stands still for the end's sake, not because EM has arrived.
        inside = search.lowest < mu < float(np.max(expected.limit))
        moved = abs(mu - previous) if inside else np.inf
        done += 1
    return Identified(
        mu=mu,
        iterations=done,
        converged=bool(moved <= search.tolerance),
        weight=float(np.sum(expected.weight[expected.limit >= mu])),
        limit=float(np.max(expected.limit)),
        log_likelihood=expected.log_likelihood,
        ess=expected.ess,
    )
