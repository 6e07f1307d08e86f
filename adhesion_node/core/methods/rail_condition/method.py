# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The default method for one window: the rail condition kappa in mu(v) = kappa law(v), and the changes of the rail.

The window's prior is the joint law of (s, v, kappa) that the measurements behind it left, so nothing is counted
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
from ...belief.window import Sample, window_of
from ...physics.train import Array
from ..protocol import Context, Fit, Verdict, spent
from .changes import Change, change, position_step
from .hypotheses import NEGLIGIBLE, Hypothesis, drifted, hypotheses, probabilities, scaled, with_rail
from .judgement import judge, most_used
from .noise import Noise, learn_noise
from .problem import Belief, Model, Problem
from .smoother import Search, Smoothed, posterior, smooth

if TYPE_CHECKING:
    from ...config import Config

EDGE = 5
"""Steps at either end of a window in which a change of the rail is not looked for."""

STEP_STD_M = 3.0
"""By how much a balise may correct the positions."""

RARER = 5.0
"""Log odds that such a correction needs beyond those of a change of the rail; heavy tails look like one."""

CLEARLY = 2.0
"""By how much the log odds of one must exceed those of the other; else the next windows decide."""

CLEAR = 2.0
"""Standard deviations by which kappa must stay below the brake's limit for a step to tell of it."""


SHORT_S = 4.5
"""Time up to which a window grows beyond S measurements while it cannot yet tell kappa from the brake's limit."""


class ConditionWindow(NamedTuple):
    """Samples of the window and the belief of (s, v) at the first one, which the first one's measurement shaped."""

    prior: Gaussian
    samples: tuple[Sample, ...]
    hypotheses: tuple[Hypothesis, ...] = ()
    """Joint beliefs with the rail condition at the first sample; empty until such a window is evaluated."""
    noise: Noise = Noise()
    """Identified so far."""
    trajectory: Array | None = None
    """Smoothed positions and speeds of its first samples, from the last evaluation; where the next one begins."""
    known: Rail | None = None
    """The rail as it was known when the braking began; None when it has changed since."""


class Found(NamedTuple):
    """What a window says under one hypothesis."""

    before: Hypothesis
    """As it stood at the window's first sample."""
    problem: Problem
    smoothed: Smoothed
    now: Hypothesis
    """As it stands at the newest one."""

    @property
    def margin(self) -> float:
        """Headroom from which a step tells of kappa."""
        return CLEAR * math.sqrt(self.now.belief.covariance[2, 2])


@dataclass(frozen=True, slots=True)
class RailCondition:
    """The method."""

    summary: str = "a factor on the speed law, by a Gaussian smoother"

    def open(self, prior: Gaussian, sample: Sample) -> ConditionWindow:
        """Open a window at the sample, of which `prior` holds the position already."""
        return ConditionWindow(prior, (sample,))

    def extend(self, window: ConditionWindow, sample: Sample) -> ConditionWindow:
        """Return the window with one more sample."""
        return window._replace(samples=(*window.samples, sample))

    def evaluate(self, config: Config, window: ConditionWindow, context: Context) -> Verdict:
        """Identify the rail condition; where the rail has changed within the window, from the change on.

        A new braking begins with the rail as it was known.
        """
        if not window.hypotheses:
            before = with_rail(window.prior, context.rail)
            window = window._replace(hypotheses=_opened(config, before), known=context.rail)
        arrays = window_of(window.samples, window.noise.factor)
        start = config.start_mu if context.mu is None else None
        found = list[Found]()
        for hypothesis in window.hypotheses:
            near = found[0].smoothed.trajectory if found else window.trajectory
            model = Model(config.motion, hypothesis.law, config.tail_dof)
            problem = Problem(model, arrays, hypothesis.belief)
            found.append(_find(config, problem, hypothesis, (start, context.lowest_mu), near))
        leading = max(found, key=lambda each: each.now.log_weight)
        changed = _changed(config, found, leading)
        now = tuple(each.now for each in found) if changed is None else changed.hypotheses
        belief = _state(leading.now.belief if changed is None else now[0].belief)
        if changed is not None and changed.certain:
            known = None if changed.of_rail else window.known
            following = ConditionWindow(belief, window.samples[-1:], now, window.noise, known=known)
        else:
            following = _following(config, window, found)
        limit = most_used(config, window.samples, leading.smoothed.trajectory[:, 1], leading.now.mu)
        regime, rail = judge(config, now, context.rail, following.known, limit)
        if not context.pressure_measured and rail.mu <= 2.0 * rail.std:
            regime, rail = Regime.COASTING, context.rail
        fit = Fit(
            window=len(window.samples),
            iterations=leading.smoothed.iterations,
            converged=leading.smoothed.converged,
            log_likelihood=leading.now.log_weight,
            shape=leading.now.law,
        )
        rail_changed = changed is not None and changed.of_rail
        return Verdict(regime, rail, belief, following, mu=leading.now.mu, changed=rail_changed, fit=fit)


def _opened(config: Config, belief: Belief) -> tuple[Hypothesis, ...]:
    """All hypotheses, from the law of (s, v, mu)."""
    return hypotheses(config.speed_law, config.low_law, config.law_probability, belief)


def _state(belief: Belief) -> Gaussian:
    return Gaussian(belief.mean[:2], belief.covariance[:2, :2])


def _find(
    config: Config, problem: Problem, before: Hypothesis, search: tuple[float | None, float], near: Array | None
) -> Found:
    start, lowest = search
    _, speed, kappa = before.belief.mean
    scale = float(before.law(speed))
    smoothed = smooth(
        problem,
        Search(
            start=kappa if start is None else start / scale,
            lowest=lowest / scale,
            tolerance=config.tolerance / scale,
            iterations=config.iterations,
        ),
        near,
    )
    # Where the brake limits, this is the law of the adhesion that it uses.
    now = posterior(problem, smoothed, -math.inf)
    return Found(before, problem, smoothed, Hypothesis(before.law, now.belief, before.log_weight + now.log_evidence))


class Changed(NamedTuple):
    """A change within the window."""

    hypotheses: tuple[Hypothesis, ...]
    """At the newest sample."""
    of_rail: bool
    """Of the rail, or only of the positions' origin."""
    certain: bool
    """Whether it has happened; else the rail is taken as it was, until the next windows tell."""


def _changed(config: Config, found: Sequence[Found], leading: Found) -> Changed | None:
    """The change that the window has seen, of the rail or of the positions, whichever explains it better."""
    if leading.problem.window.steps < 2 * EDGE:
        return None
    rail, place = _rail_change(config, leading), _place_step(leading)
    if max(rail.log_odds, place.log_odds) < config.change_threshold:
        return None
    if rail.log_odds > place.log_odds + CLEARLY:
        belief = scaled(rail.belief, float(leading.before.law(rail.belief.mean[1])))
        return Changed(_opened(config, belief), of_rail=True, certain=True)
    # the laws as they weighed before: each explains a part of the step as best it can
    stepped = tuple(each.before._replace(belief=_place_step(each).belief) for each in found)
    needed = max(config.change_threshold + RARER, rail.log_odds + CLEARLY)
    return Changed(stepped, of_rail=False, certain=place.log_odds > needed)


def _rail_change(config: Config, found: Found) -> Change:
    before, last = found.before, found.problem.window.steps - EDGE
    jump_std = config.unknown_std / float(before.law(before.belief.mean[1]))
    return change(found.problem, found.smoothed, np.arange(EDGE, last + 1, dtype=np.intp), jump_std)


def _place_step(found: Found) -> Change:
    last = found.problem.window.steps - EDGE + 2
    return position_step(found.problem, found.smoothed, np.arange(EDGE, last + 1, dtype=np.intp), STEP_STD_M)


def _following(config: Config, window: ConditionWindow, found: Sequence[Found]) -> ConditionWindow:
    """The window moved on, each hypothesis with the law that the samples left behind give."""
    count, trajectory = spent(config, window.samples), found[0].smoothed.trajectory
    if not count or _waits(window, found):
        return window._replace(trajectory=trajectory)
    gone = found[0].problem.window.beginning(count)
    drift = config.rail_drift**2 * float(np.sum(gone.dt_s))
    passed = []
    for each in found:
        left = posterior(replace(each.problem, window=gone), each.smoothed, each.margin)
        weight = each.before.log_weight + left.log_evidence
        passed.append(Hypothesis(each.before.law, drifted(left.belief, drift), weight))
    kept = tuple(
        hypothesis._replace(log_weight=math.log(probability))
        for hypothesis, probability in zip(passed, probabilities(passed), strict=True)
        if probability >= NEGLIGIBLE
    )
    noise = (
        learn_noise(window.noise, found[0].problem, found[0].smoothed, count) if config.identify_noise else window.noise
    )
    prior = _state(kept[0].belief)
    return ConditionWindow(prior, window.samples[count:], kept, noise, trajectory[count:], window.known)


def _waits(window: ConditionWindow, found: Sequence[Found]) -> bool:
    """Whether to leave nothing behind yet, as no step would tell of kappa: S measurements at 50 Hz are but a second."""
    lasts_s = (window.samples[-1].t_ns - window.samples[0].t_ns) * 1e-9
    return lasts_s < SHORT_S and all(np.max(each.smoothed.steps.headroom) < each.margin for each in found)
