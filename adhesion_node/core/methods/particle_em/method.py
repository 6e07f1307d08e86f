# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The paper's method for one window: mu constant, identified by EM with particles, Xie et al. 2019."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from scipy.special import ndtri

from ...belief.gaussian import Gaussian, filter_window
from ...belief.rail import Finding, Rail, kept_of_start, learn, learn_bound
from ...belief.regime import Regime
from ...belief.window import Sample, window_of
from ..protocol import Context, Fit, Verdict, spent
from .em import Identified, ParticleSmoother, Search, identify

if TYPE_CHECKING:
    from ...config import Config

UNDECIDED = 0.5
"""Share of the EM's start in its result above which a window has seen too little to tell what limits the motion."""


class ParticleWindow(NamedTuple):
    """Samples of the window and the belief of (s, v) at the first one, which the first one's measurement shaped."""

    prior: Gaussian
    samples: tuple[Sample, ...]


class Evaluation(NamedTuple):
    """What a window says."""

    identified: Identified
    std: float
    """Standard deviation of mu from this window alone, from the observed information."""
    kept: float
    """Share of the EM's start that is left in mu."""
    belief: Gaussian
    """Filtered belief of (s, v) at the newest sample, the uncertainty of mu included."""
    following: ParticleWindow
    """The window to go on with."""


class Evaluate(Protocol):
    """Evaluates a window: `evaluate`, or what stands for it where many estimators run side by side."""

    def __call__(
        self, config: Config, window: ParticleWindow, search: Search, rng: np.random.Generator
    ) -> Evaluation: ...


def evaluate(config: Config, window: ParticleWindow, search: Search, rng: np.random.Generator) -> Evaluation:
    """Identify mu in the window by EM and filter the state with the result.

    A full window moves on so far that L more measurements fill it again. The filtered belief at its new first sample
    holds nothing of the samples behind it, so the overlap is not counted twice.
    """
    motion, arrays = config.motion, window_of(window.samples)
    identified = identify(ParticleSmoother(config.particles), motion, window.prior, arrays, search, rng)
    filtered = filter_window(motion, window.prior, arrays, identified.mu)
    std = 1.0 / math.sqrt(filtered.information) if filtered.information > 0.0 else math.inf
    kept = kept_of_start(filtered.information, identified.weight, identified.iterations)
    spread = filtered.sensitivity * min(std, config.unknown_std)
    last = filtered.laws[-1]
    gone = spent(config, window.samples)
    following = ParticleWindow(filtered.laws[gone - 1], window.samples[gone:]) if gone else window
    return Evaluation(identified, std, kept, Gaussian(last.mean, last.covariance + np.outer(spread, spread)), following)


@dataclass(frozen=True, slots=True)
class ParticleEm:
    """The method; `evaluator` makes an `Evaluation` of a window and may be another where runs share a batch."""

    evaluator: Evaluate = evaluate
    summary: str = "constant mu, the paper's"

    def open(self, prior: Gaussian, sample: Sample) -> ParticleWindow:
        """Open a window at the sample, of which `prior` holds the position already."""
        return ParticleWindow(prior, (sample,))

    def extend(self, window: ParticleWindow, sample: Sample) -> ParticleWindow:
        """Return the window with one more sample."""
        return window._replace(samples=(*window.samples, sample))

    def evaluate(self, config: Config, window: ParticleWindow, context: Context) -> Verdict:
        """Identify mu by EM from that of the last window on, and judge what limits the motion."""
        start = config.start_mu if context.mu is None else context.mu
        search = Search(start, config.iterations, config.tolerance, context.lowest_mu)
        evaluation = self.evaluator(config, window, search, context.rng)
        identified = evaluation.identified
        regime, rail = judge(config, evaluation, context, start)
        fit = Fit(
            window=len(window.samples),
            iterations=identified.iterations,
            converged=identified.converged,
            log_likelihood=identified.log_likelihood,
            ess=identified.ess,
        )
        return Verdict(regime, rail, evaluation.belief, evaluation.following, mu=identified.mu, fit=fit)


def judge(config: Config, evaluation: Evaluation, context: Context, start: float) -> tuple[Regime, Rail]:
    """What the window shows, no brake, the brake's limit, or the adhesion, and what is known of the rail then."""
    limit, before = evaluation.identified.limit, context.rail
    finding = Finding(evaluation.identified.mu, evaluation.std, min(start, limit), evaluation.kept)
    learnt = learn(before, finding, float(ndtri(config.confidence)))
    if not context.pressure_measured and learnt.mu <= 2.0 * learnt.std:
        return Regime.COASTING, before
    if finding.kept > UNDECIDED:
        return Regime.COASTING, learnt
    if learnt.mu + learnt.std < limit:
        return Regime.ADHESION_LIMITED, learnt
    return Regime.BRAKE_LIMITED, learn_bound(before, learnt)
