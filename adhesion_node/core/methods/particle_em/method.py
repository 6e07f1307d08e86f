# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The paper's method for one window: mu constant, identified by EM with particles, Xie et al. 2019."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np
from scipy.special import ndtri

from ...belief.gaussian import Gaussian, filter_window
from ...belief.outcome import Regime
from ...belief.rail import Finding, Rail, kept_of_start, learn, learn_bound
from ...belief.window import window_of
from ...config import Config
from ..protocol import BrakingWindow, Verdict
from .em import Identified, ParticleSmoother, Search, identify

UNDECIDED = 0.5
"""Share of the EM's start in its result above which a window has seen too little to tell what limits the motion."""


class Evaluation(NamedTuple):
    """What a window says."""

    identified: Identified
    std: float
    """Standard deviation of mu from this window alone, from the observed information."""
    kept: float
    """Share of the EM's start that is left in mu."""
    law: Gaussian
    """Filtered law of (s, v) at the newest sample, the uncertainty of mu included."""
    following: BrakingWindow
    """The window to go on with."""


class Evaluate(Protocol):
    """Evaluates a window: `evaluate`, or what stands for it where many estimators run side by side."""

    def __call__(
        self, config: Config, window: BrakingWindow, search: Search, rng: np.random.Generator
    ) -> Evaluation: ...


def evaluate(config: Config, window: BrakingWindow, search: Search, rng: np.random.Generator) -> Evaluation:
    """Identify mu in the window by EM and filter the state with the result.

    A full window moves on so far that L more measurements fill it again. The filtered law at its new first sample
    holds nothing of the samples behind it, so the overlap is not counted twice.
    """
    motion, arrays = config.motion, window_of(window.samples)
    identified = identify(ParticleSmoother(config.particles), motion, window.prior, arrays, search, rng)
    filtered = filter_window(motion, window.prior, arrays, identified.mu)
    std = 1.0 / math.sqrt(filtered.information) if filtered.information > 0.0 else math.inf
    kept = kept_of_start(filtered.information, identified.weight, identified.iterations)
    spread = filtered.sensitivity * min(std, config.unknown_std)
    law = filtered.laws[-1]
    spent = window.spent(config)
    following = BrakingWindow(filtered.laws[spent - 1], window.samples[spent:]) if spent else window
    return Evaluation(identified, std, kept, Gaussian(law.mean, law.covariance + np.outer(spread, spread)), following)


def judge(config: Config, evaluation: Evaluation, before: Rail, start: float, unmeasured: bool) -> Verdict:
    """What the window shows: no brake, the brake's limit, or the adhesion; `before` is the rail as it was known."""
    identified = evaluation.identified
    finding = Finding(identified.mu, evaluation.std, min(start, identified.limit), evaluation.kept)
    learnt = learn(before, finding, float(ndtri(config.confidence)))
    if unmeasured and learnt.mu <= 2.0 * learnt.std:
        regime, rail = Regime.COASTING, before
    elif finding.kept > UNDECIDED:
        regime, rail = Regime.COASTING, learnt
    elif learnt.mu + learnt.std < identified.limit:
        regime, rail = Regime.ADHESION_LIMITED, learnt
    else:
        regime, rail = Regime.BRAKE_LIMITED, learn_bound(before, learnt)
    return Verdict(
        regime=regime,
        rail=rail,
        law=evaluation.law,
        following=evaluation.following,
        mu=identified.mu,
        iterations=identified.iterations,
        converged=identified.converged,
        log_likelihood=identified.log_likelihood,
        ess=identified.ess,
    )
