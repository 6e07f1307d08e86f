# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The sliding window of one braking: grows to S measurements, then moves on by L (steps 1, 4 and 5 of the paper)."""

from __future__ import annotations

from typing import NamedTuple

from ..belief.gaussian import Gaussian
from ..belief.outcome import Regime
from ..belief.rail import Rail
from ..belief.window import Sample
from ..config import Config
from ..physics.adhesion import SpeedLaw
from ..physics.train import Array
from .rail_condition.hypotheses import Hypothesis
from .rail_condition.noise import Noise


class BrakingWindow(NamedTuple):
    """Samples of the window and the law of (s, v) at the first one, which the first one's measurement shaped."""

    prior: Gaussian
    samples: tuple[Sample, ...]
    hypotheses: tuple[Hypothesis, ...] = ()
    """Joint laws with the rail condition at the first sample; empty until such a window is evaluated."""
    noise: Noise = Noise()
    """Identified so far."""
    trajectory: Array | None = None
    """Smoothed positions and speeds of its first samples, from the last evaluation; where the next one begins."""
    known: Rail | None = None
    """The rail as it was known when the braking began; None when it has changed since."""

    def extended(self, sample: Sample) -> BrakingWindow:
        """The window with one more sample."""
        return self._replace(samples=(*self.samples, sample))

    def spent(self, config: Config) -> int:
        """Samples to leave behind, so that L more fill the window again; 0 while it still grows."""
        spent = len(self.samples) - config.window + config.step
        return spent if spent >= config.step else 0


class Verdict(NamedTuple):
    """What a method makes of a window."""

    regime: Regime
    rail: Rail
    law: Gaussian
    """Of (s, v) at the newest sample."""
    following: BrakingWindow
    """The window to go on with."""
    mu: float
    """Adhesion for the next window to start from (12)."""
    iterations: int
    converged: bool
    log_likelihood: float
    shape: SpeedLaw | None = None
    """How the adhesion goes on as the train slows down; None where a method says nothing of it."""
    ess: float = 0.0
    """Smallest effective sample size in the window; 0 where no particles were used."""
    changed: bool = False
    """Whether the rail has changed within the window."""
