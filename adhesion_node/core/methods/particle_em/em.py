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

import math
from typing import NamedTuple, Protocol

import numpy as np

from ...belief.gaussian import Gaussian
from ...belief.rail import kept_of_start
from ...belief.window import Window
from ...physics.motion import Motion
from ...physics.train import Array
from ..kernels import expecting, maximising, smoothing
from .particles import ParticleFilter


class Expectation(NamedTuple):
    """Result of an E-step: the statistics of Q that depend on mu, and diagnostics."""

    statistics: Array
    """Of each step, (3, K): u_t, smoothed adhesion used in it; c_t, its information, which is the complete-data
    information on mu; and the largest adhesion that the brake could use."""
    observed: float
    """Information on mu that the window's measurements hold, at that adhesion, or the largest that the brake could use
    in any step where that is less."""
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
        """Filter, smooth and reduce to the statistics of Q; what is observed is that of the extended Kalman filter."""
        particles, log_likelihood, ess = self.filter.run(mu, self.rng)
        self.marginal = smoothing.smoothed(particles, self.filter.given.spread)
        statistics, observed = expecting.expected(self.filter.given, float(mu), particles, self.marginal)
        return Expectation(statistics, observed, log_likelihood, ess)


PASSES = 0.5
"""For each iteration where EM arrives; where it stays at its start, 1. With the paper's settings, 20 particles and
50 iterations, chance moves mu by 7e-4 then; by 5.5e-4 with an iteration each, where a window leaves 3e-3 open."""


class Search(NamedTuple):
    """Where EM starts and when it stops."""

    start: float
    iterations: int
    """At most; as far as these, but in fewer passes."""
    tolerance: float
    """``|mu_k+1 - mu_k|`` below which it has converged (34)."""
    lowest: float = 0.0
    """Least mu: 0, or a negative number where traction may be at work."""


class Identified(NamedTuple):
    """Result of EM in one window."""

    mu: float
    iterations: int
    """Passes."""
    converged: bool
    """Whether ``|mu_k+1 - mu_k|`` fell below the tolerance (34)."""
    kept: float
    """Share of the start that is still in mu."""
    limit: float
    """Largest adhesion that any step of the window could use."""
    log_likelihood: float
    ess: float


def maximise(expected: Expectation, lowest: float) -> float:
    """Adhesion of at least `lowest` that maximises Q, the goal of (33)."""
    return maximising.maximised(expected.statistics, float(lowest))[0]


def identify(e_step: EStep, search: Search) -> Identified:
    """Pass by E and M step until mu moves by no more than the tolerance (34), or to where I iterations of EM move it.

    An iteration keeps a share r of the error (`kept_of_start`), I of them q = r^I: together they move mu by
    1 + r + ... + r^(I-1) = (1 - q)/(1 - r) times what the first one does. So of n passes number j moves mu by

        (1 - q)/(1 - r) 2j / (n (n+1) q + j (j+1) (1 - q))

    times its M-step (Robbins and Monro 1951). That leaves the same share q of the start, averages the noise of the
    passes instead of keeping that of the last ones, and gives pass j the weight j, as the first ones are farthest off.
    """
    mu, done = search.start, 0
    while True:
        expected = e_step(mu)
        done += 1
        best, top = maximising.maximised(expected.statistics, float(search.lowest))
        mu = min(mu, top)  # what is beyond the brakes makes no difference
        seen = min(expected.observed / float(expected.weight.dot(expected.limit >= mu)), 1.0)
        left = kept_of_start(seen, 1.0, search.iterations)
        leap = (1.0 - left) / seen if left < 1.0 else search.iterations
        passes = math.ceil((PASSES + (1.0 - PASSES) * left) * search.iterations)
        kept = passes * (passes + 1) * left
        slowness = kept + done * (done + 1) * (1.0 - left)
        aim = mu + leap * 2.0 * done / slowness * (best - mu)
        previous, mu = mu, max(min(aim, top), search.lowest)
        # At either end of its range mu stands still for the end's sake, not because EM has arrived.
        moved = abs(mu - previous) if search.lowest < mu < top else np.inf
        if moved <= search.tolerance or done >= passes:
            break
    return Identified(
        mu=mu,
        iterations=done,
        converged=moved <= search.tolerance,
        kept=kept / slowness,
        limit=top,
        log_likelihood=expected.log_likelihood,
        ess=expected.ess,
    )
