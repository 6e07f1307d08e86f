# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Many estimators side by side: the core's own `step`, with the windows that fall due together evaluated as one batch.

`step` is pure. Where it comes to a window it is stopped, the windows of all runs are evaluated at once, and the
step is taken again with the answer at hand; so every rule of the estimator holds here without being written twice.
"""

from __future__ import annotations

import math
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple, TypeVar

import numpy as np

from ...core import Config, Estimate, Measurement, State, finish, init, step
from ...core.belief.gaussian import Gaussian
from ...core.belief.rail import kept_of_start
from ...core.belief.window import Window, window_of
from ...core.methods.particle_em.em import Search
from ...core.methods.particle_em.method import Evaluate, Evaluation, ParticleEm, ParticleWindow
from ...core.methods.protocol import spent
from . import batch
from .batch_filter import filter_windows
from .batch_particles import stack

Taken = TypeVar("Taken")


class Due(NamedTuple):
    """A window to evaluate: the arguments of `particle_em.method.evaluate`."""

    window: ParticleWindow
    search: Search
    rng: np.random.Generator


class Run(NamedTuple):
    """An estimator's configuration, seed and measurements."""

    config: Config
    seed: int
    measurements: Sequence[Measurement]


class _Stopped(Exception):
    def __init__(self, due: Due) -> None:
        super().__init__()
        self.due = due


def drive(runs: Sequence[Run], window_ms: list[float] | None = None) -> list[list[Estimate]]:
    """Take every run to its end and return its estimates; the runs' configurations may differ in `start_mu` only.

    The time per window of every batch, in ms, is added to `window_ms`.
    """
    evaluate = partial(_timed, [] if window_ms is None else window_ms, runs[0].config)
    states = [init(run.config, run.seed) for run in runs]
    estimates: list[list[Estimate]] = [[] for _ in runs]
    for tick in range(max(len(run.measurements) for run in runs)):
        going = [index for index, run in enumerate(runs) if tick < len(run.measurements)]
        taken = _together([_stepping(runs[index], states[index], tick) for index in going], evaluate)
        for index, (state, estimate) in zip(going, taken, strict=True):
            states[index] = state
            estimates[index] += [] if estimate is None else [estimate]
    endings = [_finishing(run.config, state) for run, state in zip(runs, states, strict=True)]
    for index, (_, last) in enumerate(_together(endings, evaluate)):
        estimates[index] += last
    return estimates


def evaluate_all(config: Config, dues: Sequence[Due]) -> list[Evaluation]:
    """`particle_em.method.evaluate` of many windows; those of equal length go together."""
    windows = [window_of(due.window.samples) for due in dues]
    groups: dict[int, list[int]] = defaultdict(list)
    for index, window in enumerate(windows):
        groups[window.steps].append(index)
    evaluations: dict[int, Evaluation] = {}
    for members in groups.values():
        some = _evaluate_equal(config, [dues[i] for i in members], [windows[i] for i in members])
        evaluations |= zip(members, some, strict=True)
    return [evaluations[index] for index in range(len(dues))]


def _evaluate_equal(config: Config, dues: Sequence[Due], windows: Sequence[Window]) -> list[Evaluation]:
    priors = [due.window.prior for due in dues]
    stacked = stack(priors, windows)
    searches, rngs = [due.search for due in dues], _shared([due.rng for due in dues])
    found = batch.identify(config.motion, stacked, searches, config.particles, rngs)
    gone = spent(config, dues[0].window.samples)
    covariances = np.stack([prior.covariance for prior in priors])
    mu = np.array([identified.mu for identified in found])
    filtered = filter_windows(config.motion, stacked, covariances, mu, gone or windows[0].steps)
    evaluations = []
    for run, (due, identified) in enumerate(zip(dues, found, strict=True)):
        information = float(filtered.information[run])
        std = 1.0 / math.sqrt(information) if information > 0.0 else math.inf
        spread = filtered.sensitivity[run] * min(std, config.unknown_std)
        last = Gaussian(filtered.mean[run], filtered.covariance[run] + np.outer(spread, spread))
        passed = Gaussian(filtered.passed_mean[run], filtered.passed_covariance[run])
        evaluations.append(
            Evaluation(
                identified,
                std,
                kept_of_start(information, identified.weight, identified.iterations),
                last,
                ParticleWindow(passed, due.window.samples[gone:]) if gone else due.window,
            )
        )
    return evaluations


def _shared(rngs: Sequence[np.random.Generator]) -> list[np.random.Generator]:
    """Let generators in one state be one: runs that differ in their start only draw the same numbers."""
    first: dict[str, np.random.Generator] = {}
    return [first.setdefault(repr(rng.bit_generator.state), rng) for rng in rngs]


def _stepping(run: Run, state: State, tick: int) -> Callable[[Evaluate], tuple[State, Estimate | None]]:
    return lambda evaluate: step(run.config, _by(state, evaluate), run.measurements[tick])


def _finishing(config: Config, state: State) -> Callable[[Evaluate], tuple[State, tuple[Estimate, ...]]]:
    return lambda evaluate: finish(config, _by(state, evaluate))


def _by(state: State, evaluate: Evaluate) -> State:
    """The state with windows evaluated that way."""
    return state._replace(method=ParticleEm(evaluate))


def _timed(window_ms: list[float], config: Config, dues: Sequence[Due]) -> list[Evaluation]:
    started = time.perf_counter()
    evaluations = evaluate_all(config, dues)
    window_ms.append(1e3 * (time.perf_counter() - started) / len(dues))
    return evaluations


def _together(
    calls: Sequence[Callable[[Evaluate], Taken]], evaluate: Callable[[Sequence[Due]], list[Evaluation]]
) -> list[Taken]:
    """Make calls that may each need windows evaluated; evaluate them in batches until every call gets through."""
    answers: list[list[Evaluation]] = [[] for _ in calls]
    results: dict[int, Taken] = {}
    while len(results) < len(calls):
        stopped: dict[int, Due] = {}
        for index in range(len(calls)):
            if index in results:
                continue
            try:
                results[index] = calls[index](_Ask(iter(answers[index])))
            except _Stopped as stop:
                stopped[index] = stop.due
        if stopped:
            for index, evaluation in zip(stopped, evaluate(list(stopped.values())), strict=True):
                answers[index].append(evaluation)
    return [results[index] for index in range(len(calls))]


class _Ask(NamedTuple):
    """Stands for the method's own `evaluate`: gives the answers at hand, and stops the call where they end."""

    answers: Iterator[Evaluation]

    def __call__(self, config: Config, window: ParticleWindow, search: Search, rng: np.random.Generator) -> Evaluation:
        del config
        answer = next(self.answers, None)
        if answer is None:
            raise _Stopped(Due(window, search, rng))
        return answer
