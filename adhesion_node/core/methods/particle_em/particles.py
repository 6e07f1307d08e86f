# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Bootstrap particle filter of a window of K steps with N particles, Xie et al. 2019, (13)-(16).

Times run 0..K: time 0 is the prior, times 1..K carry the measurements. Weights are kept as logarithms.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...belief.gaussian import Gaussian
from ...belief.window import Window
from ...physics.motion import Motion
from ..kernels import filtering
from ..kernels.filtering import Particles


class Pass(NamedTuple):
    """A pass of the filter."""

    particles: Particles
    """The next pass writes over them."""
    log_likelihood: float
    """ln p(y_1:K) at the filter's adhesion (14)(15)."""
    smallest_ess: float
    """Smallest effective sample size over the window, 1..N."""


def given(motion: Motion, prior: Gaussian, window: Window) -> filtering.Given:
    """What the compiled loops need to know."""
    breaks, levels = motion.track.steps
    columns = window.dt_s, window.brake, window.position_m, window.variance_m2, window.speed_mps, window.speed_variance
    return filtering.Given(
        rotating=float(motion.train.rotating_mass_fraction),
        resistance=np.array(motion.train.resistance_si),
        breaks=breaks,
        levels=levels,
        mean=np.ascontiguousarray(prior.mean),
        covariance=np.ascontiguousarray(prior.covariance),
        root=np.asarray(np.linalg.cholesky(prior.covariance), dtype=np.float64),
        window=np.array(columns),
        spread=np.sqrt(np.array(motion.noise(window.dt_s))),
    )


class ParticleFilter:
    """The bootstrap filter, prepared for a window and a number of particles; every pass uses the same memory."""

    def __init__(self, motion: Motion, prior: Gaussian, window: Window, count: int) -> None:
        steps, variances = window.steps, np.concatenate((window.variance_m2, window.speed_variance))
        self.given = given(motion, prior, window)
        self.log_constant = -0.5 * float(np.log(2.0 * math.pi * variances[np.isfinite(variances)]).sum())
        self.passes = 0
        self.draws = filtering.Draws(np.empty((2, steps, count)), np.empty(steps), np.empty((count, 2)))
        self.particles = Particles(
            np.empty((2, steps + 1, count)), np.empty((2, steps, count)), np.empty((steps + 1, count))
        )

    def run(self, mu: float, rng: np.random.Generator) -> Pass:
        """Filter Y (13) at an adhesion: p(y_t|Y_1:t-1) (16) is the mean weight.

        Resamples systematically where the effective sample size falls below half of the particles.
        """
        self._draw(rng)
        log_likelihood, ess = filtering.filtered(self.given, float(mu), self.draws, self.particles)
        return Pass(self.particles, log_likelihood + self.log_constant, ess)

    def _draw(self, rng: np.random.Generator) -> None:
        """New noise for every fourth pass, which the next three mirror: in both components, in one, in the other.

        So errors that are odd in the noise cancel over four passes, for a quarter of the drawing.
        """
        normal, uniform, start = self.draws
        rng.random(out=uniform)
        if self.passes % 4 == 0:
            rng.standard_normal(out=normal)
            rng.standard_normal(out=start)
        else:
            mirrored = 1 if self.passes % 4 == 2 else 2
            for noise in (normal[:mirrored], start[:, :mirrored]):
                np.negative(noise, out=noise)
        self.passes += 1
