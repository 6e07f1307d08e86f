# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Expectation maximisation of the adhesion in a window of K steps, Xie et al. 2019, (18)-(34).

The E-step comes in behind the `EStep` protocol. What the M-step needs of it is small: while adhesion limits,
the model is linear in mu, so Q(mu, mu_k) depends on mu through

    Q = const - 1/2 sum_t c_t (min(mu, limit_t) - u_t)^2

with u_t the smoothed adhesion used in step t, c_t its weight and limit_t what the brake could use at most. This
is a parabola between two limits, so its maximum is found exactly where the paper iterates a gradient (33).
"""

from typing import NamedTuple, Protocol

import numpy as np

from ...belief.gaussian import Gaussian
from ...belief.window import Window
from ...physics.motion import Motion
from ...physics.train import Array
from ..kernels import filtering, smoothing
from .particles import ParticleFilter


class Expectation(NamedTuple):
    """Result of an E-step: the statistics of Q that depend on mu, and diagnostics."""

    statistics: Array
    """Of each step, (3, K): u_t, smoothed adhesion used in it; c_t, its information, which is the complete-data
    information on mu; and the largest adhesion that the brake could use."""
    log_likelihood: float
    ess: float

    @property
    def used(self) -> Array:
        """u_t, (K,)."""
        return np.asarray(self.statistics[0])

    @property
    def weight(self) -> Array:
        """c_t, (K,)."""
        return np.asarray(self.statistics[1])

    @property
    def limit(self) -> Array:
        """What the brake could use, (K,)."""
        return np.asarray(self.statistics[2])


class EStep(Protocol):
    """An E-step, prepared for a window: smooths it at an adhesion."""

    def __call__(self, mu: float) -> Expectation: ...


class ParticleEStep:
    """The paper's E-step: bootstrap filter and marginal smoother with so many particles."""

    def __init__(self, motion: Motion, count: int, prior: Gaussian, window: Window, rng: np.random.Generator) -> None:
        self.filter, self.rng = ParticleFilter(motion, prior, window, count), rng
        self.marginal = np.empty((window.steps + 1, count))
        """Smoothed weights of the last call."""

    def __call__(self, mu: float) -> Expectation:
        """Filter, smooth and reduce to the statistics of Q."""
        particles, log_likelihood, ess = self.filter.run(mu, self.rng)
        self.marginal = smoothing.smoothed(particles, self.filter.given.spread)
        statistics = filtering.reduced(self.filter.given, float(mu), particles, self.marginal)
        return Expectation(statistics, log_likelihood, ess)


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


def gradient(expected: Expectation, mu: float) -> float:
    """dQ/dmu (29)-(32) at `mu`: only I2 depends on mu, and only through the steps that adhesion limits."""
    active = expected.limit > mu
    return float(np.sum(expected.weight * (expected.used - mu), where=active))


def maximise(expected: Expectation, lowest: float) -> float:
    """Adhesion of at least `lowest` that maximises Q, the goal of (33)."""
    return filtering.maximised(expected.statistics, float(lowest))


def identify(e_step: EStep, search: Search) -> Identified:
    """Alternate E and M steps until they move mu by no more than the tolerance (34)."""
    mu, done, moved = search.start, 0, np.inf
    while True:
        expected = e_step(mu)
        previous, mu = mu, maximise(expected, search.lowest)
        done += 1
        # At either end of its range mu stands still for the end's sake, not because EM has arrived.
        top = float(expected.limit.max())
        moved = abs(mu - previous) if search.lowest < mu < top else np.inf
        if moved <= search.tolerance or done >= search.iterations:
            break
    return Identified(
        mu=mu,
        iterations=done,
        converged=moved <= search.tolerance,
        weight=float(np.sum(expected.weight, where=expected.limit >= mu)),
        limit=top,
        log_likelihood=expected.log_likelihood,
        ess=expected.ess,
    )
