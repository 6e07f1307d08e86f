"""The sliding window of one braking: grows to S measurements, then moves on by L (steps 1, 4 and 5 of the paper)."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from .config import Config
from .em import Identified, ParticleSmoother, Search, identify
from .gaussian import Gaussian, filter_window
from .rail import kept_of_start
from .window import Sample, window_of


class BrakingWindow(NamedTuple):
    """Samples of the window and the law of (s, v) at the first one, which the first one's measurement shaped."""

    prior: Gaussian
    samples: tuple[Sample, ...]

    def extended(self, sample: Sample) -> BrakingWindow:
        """The window with one more sample."""
        return self._replace(samples=(*self.samples, sample))


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
    following = window
    spent = len(window.samples) - config.window + config.step
    if spent >= config.step:
        following = BrakingWindow(filtered.laws[spent - 1], window.samples[spent:])
    return Evaluation(identified, std, kept, Gaussian(law.mean, law.covariance + np.outer(spread, spread)), following)
