# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The rail condition kappa in one window in mu(v) = kappa law(v), and the changes of the rail.

The window's prior is the joint belief of (s, v, kappa) that the measurements behind it left, so nothing is counted
twice: what the window finds is its answer, and only what leaves it becomes prior.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...belief.gaussian import Gaussian
from ...belief.rail import Rail
from ...belief.regime import Regime
from ...belief.window import WindowSample, window_of
from ...physics.train import Array
from ..protocol import Context, Fit, Verdict, spent
from .branch import Branch, log_likelihood, smoothed_branch
from .detection import detect
from .hypotheses import NEGLIGIBLE_PROBABILITY, Hypothesis, hypotheses, probabilities, widened, with_rail
from .judgement import judge, most_used
from .noise import Noise, learn_noise
from .problem import Belief
from .smoother import posterior

if TYPE_CHECKING:
    from ...config import Config


class ConditionWindow(NamedTuple):
    """Samples of the window and the belief of (s, v) at the first one, which the first one's measurement shaped."""

    prior: Gaussian
    samples: tuple[WindowSample, ...]
    hypotheses: tuple[Hypothesis, ...] = ()
    """Joint beliefs with the rail condition at the first sample; empty until such a window is evaluated."""
    noise: Noise = Noise()
    """Identified so far."""
    trajectory: Array | None = None
    """Smoothed positions and speeds of its first samples, from the last evaluation; where the next one begins."""
    known: Rail | None = None
    """The rail as it was known when the braking began; None when it has changed since."""
    stepped_m: float = -math.inf
    """Position of the last step of the measured positions."""


@dataclass(frozen=True, slots=True)
class RailCondition:
    """The method."""

    summary: str = "a factor on the speed law, by a Gaussian smoother"

    def open(self, prior: Gaussian, sample: WindowSample, replaced: ConditionWindow | None = None) -> ConditionWindow:
        """Open a window at the sample, of which `prior` holds the position already.

        Of a window that it takes the place of, it keeps what is known of the position sensor.
        """
        if replaced is None:
            return ConditionWindow(prior, (sample,))
        return ConditionWindow(prior, (sample,), noise=replaced.noise, stepped_m=replaced.stepped_m)

    def extend(self, window: ConditionWindow, sample: WindowSample) -> ConditionWindow:
        """Return the window with one more sample."""
        return window._replace(samples=(*window.samples, sample))

    def evaluate(self, config: Config, window: ConditionWindow, context: Context) -> Verdict:
        """Identify the rail condition; where the rail has changed within the window, from the change on.

        A new braking begins with the rail as it was known.
        """
        if not window.hypotheses:
            before = with_rail(window.prior, context.rail)
            opened = hypotheses(config.speed_law, config.low_law, config.law_probability, before)
            window = window._replace(hypotheses=opened, known=context.rail)
        branches = _branches(config, window, context)
        leading = max(branches, key=lambda each: each.now.log_weight)
        detected = detect(config, branches, leading, window.stepped_m)
        now = tuple(each.now for each in branches) if detected is None else detected.hypotheses
        belief = _state(leading.now.belief if detected is None else now[0].belief)
        if detected is not None and detected.certain:
            following = window._replace(prior=belief, samples=window.samples[-1:], hypotheses=now, trajectory=None)
            newest_m = window.samples[-1].position_m
            following = following._replace(**({"known": None} if detected.of_rail else {"stepped_m": newest_m}))
        else:
            following = _following(config, window, branches)
        limit = most_used(config, window.samples, leading.smoothed.trajectory[:, 1], leading.now.mu)
        regime, rail = judge(config, now, context.rail, following.known, limit)
        if not (context.pressure_measured or rail.brakes):
            regime, rail = Regime.COASTING, context.rail
        fit = Fit(
            window=len(window.samples),
            iterations=leading.smoothed.iterations,
            converged=leading.smoothed.converged,
            log_likelihood=log_likelihood(branches),
            shape=leading.now.law,
        )
        rail_changed = detected is not None and detected.of_rail
        return Verdict(regime, rail, belief, following, mu=leading.now.mu, changed=rail_changed, fit=fit)


def _branches(config: Config, window: ConditionWindow, context: Context) -> list[Branch]:
    """The window under each hypothesis; the first one's trajectory is where the others begin."""
    arrays = window_of(window.samples, window.noise.factor)
    start = config.start_mu if context.mu is None else None
    branches: list[Branch] = []
    for before in window.hypotheses:
        near = branches[0].smoothed.trajectory if branches else window.trajectory
        branches.append(smoothed_branch(config, arrays, before, near, start, context.lowest_mu))
    return branches


def _state(belief: Belief) -> Gaussian:
    return Gaussian(belief.mean[:2], belief.covariance[:2, :2])


def _following(config: Config, window: ConditionWindow, branches: Sequence[Branch]) -> ConditionWindow:
    """The window moved on, each hypothesis with the belief that the samples left behind give."""
    count, first = spent(config, window.samples), branches[0]
    if not count or _waits(config, window, branches):
        return window._replace(trajectory=first.smoothed.trajectory)
    gone = first.problem.window.beginning(count)
    drift = config.rail_drift**2 * float(np.sum(gone.dt_s))
    passed = []
    for each in branches:
        left = posterior(replace(each.problem, window=gone), each.smoothed, each.margin(config))
        belief = widened(left.belief, 2, drift * left.belief.mean[2] ** 2)
        passed.append(Hypothesis(each.before.law, belief, each.before.log_weight + left.log_evidence))
    kept = tuple(
        hypothesis._replace(log_weight=math.log(probability))
        for hypothesis, probability in zip(passed, probabilities(passed), strict=True)
        if probability >= NEGLIGIBLE_PROBABILITY
    )
    learnt = (
        learn_noise(config, window.noise, first.problem, first.smoothed, count)
        if config.identify_noise
        else window.noise
    )
    return window._replace(
        prior=_state(kept[0].belief),
        samples=window.samples[count:],
        hypotheses=kept,
        noise=learnt,
        trajectory=first.smoothed.trajectory[count:],
    )


def _waits(config: Config, window: ConditionWindow, branches: Sequence[Branch]) -> bool:
    """Whether to leave nothing behind yet, as no step would tell of kappa: S measurements at 50 Hz are but a second."""
    lasts_s = (window.samples[-1].t_ns - window.samples[0].t_ns) * 1e-9
    return lasts_s < config.shortest_window_s and all(
        np.max(each.smoothed.headroom) < each.margin(config) for each in branches
    )
