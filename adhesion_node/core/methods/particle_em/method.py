# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The paper's method: mu constant in a window, identified by EM with particles, Xie et al. 2019."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.special import ndtri

from ...belief.gaussian import Gaussian
from ...belief.rail import Identification, Rail, learn, learn_bound
from ...belief.regime import Regime
from ...belief.window import WindowSample, window_of
from ..protocol import Context, Fit, Verdict, spent
from .em import Identified, ParticleEStep, Search, identify
from .kalman import Filtered, filtered_by

if TYPE_CHECKING:
    from ...config import Config


class ParticleWindow(NamedTuple):
    """Samples of the window and the belief of (s, v) at the first one, which the first one's measurement shaped."""

    prior: Gaussian
    samples: tuple[WindowSample, ...]


@dataclass(frozen=True, slots=True)
class ParticleEm:
    """The method."""

    summary: str = "constant mu, the paper's"

    def open(self, prior: Gaussian, sample: WindowSample, replaced: ParticleWindow | None = None) -> ParticleWindow:
        """Open a window at the sample, of which `prior` holds the position already."""
        del replaced  # it knows nothing that would outlive it
        return ParticleWindow(prior, (sample,))

    def extend(self, window: ParticleWindow, sample: WindowSample) -> ParticleWindow:
        """Return the window with one more sample."""
        return window._replace(samples=(*window.samples, sample))

    def evaluate(self, config: Config, window: ParticleWindow, context: Context) -> Verdict:
        """Identify mu by EM from that of the last window on, and judge what limits the motion."""
        prior, arrays = window.prior, window_of(window.samples)
        e_step = ParticleEStep(config.motion, config.particles, prior, arrays, context.rng)
        identified = identify(e_step, _search(config, context))
        filtered = filtered_by(e_step.filter.given, identified.mu)
        return _verdict(config, window, context, identified, filtered)


def _search(config: Config, context: Context) -> Search:
    start = config.start_mu if context.mu is None else context.mu
    return Search(start, config.iterations, config.tolerance, context.lowest_mu)


def _verdict(
    config: Config, window: ParticleWindow, context: Context, identified: Identified, filtered: Filtered
) -> Verdict:
    """Judge a window by what was identified in it and the filter's pass with that.

    A full window moves on so far that L more measurements fill it again. The filtered belief at its new first sample
    holds nothing of the samples behind it, so the overlap is not counted twice.
    """
    std = 1.0 / math.sqrt(filtered.information) if filtered.information > 0.0 else math.inf
    start = min(_search(config, context).start, identified.limit)
    regime, rail = judge(config, Identification(identified.mu, std, start, identified.kept), identified.limit, context)
    spread = filtered.sensitivity * min(std, config.unknown_std)
    gone = spent(config, window.samples)
    following = ParticleWindow(filtered.belief(gone - 1), window.samples[gone:]) if gone else window
    mean, covariance = filtered.belief(-1)
    belief = Gaussian(mean, covariance + np.outer(spread, spread))
    fit = Fit(
        window=len(window.samples),
        iterations=identified.iterations,
        converged=identified.converged,
        log_likelihood=identified.log_likelihood,
        ess=identified.ess,
    )
    return Verdict(regime, rail, belief, following, mu=identified.mu, fit=fit)


def judge(config: Config, identification: Identification, limit: float, context: Context) -> tuple[Regime, Rail]:
    """What the window shows, no brake, the brake's limit, or the adhesion, and what is known of the rail then."""
    before = context.rail
    learnt = learn(before, identification, float(ndtri(config.confidence)))
    if not (context.pressure_measured or learnt.brakes):
        return Regime.COASTING, before
    if identification.kept > config.undecided_start_share:
        return Regime.COASTING, learnt
    if learnt.mu + learnt.std < limit:
        return Regime.ADHESION_LIMITED, learnt
    return Regime.BRAKE_LIMITED, learn_bound(before, learnt)
