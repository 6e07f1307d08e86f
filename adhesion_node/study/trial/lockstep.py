# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Many estimators side by side: the core's own `step`, with the windows that fall due together evaluated as one batch.

`step` is pure. Where it comes to a window it is stopped, the windows of all runs are evaluated at once, and the
step is taken again with the verdict at hand; so every rule of the estimator holds here without being written twice.
"""

import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...core import Config, Estimate, Measurement, State, finish, init, step
from ...core.belief.gaussian import Gaussian
from ...core.belief.window import WindowSample
from ...core.methods.particle_em.method import ParticleEm, ParticleWindow, evaluate
from ...core.methods.protocol import Context, Verdict

METHOD = ParticleEm()


class Run(NamedTuple):
    """An estimator's configuration, seed and measurements."""

    config: Config
    seed: int
    measurements: Sequence[Measurement]


class Due(Exception):
    """A window has to be evaluated before its run can go on."""

    def __init__(self, window: ParticleWindow, context: Context) -> None:
        super().__init__()
        self.window, self.context = window, context


class Prepared(NamedTuple):
    """The method with its verdicts at hand; raises `Due` where they end."""

    verdicts: Iterator[Verdict]
    summary: str = METHOD.summary

    def open(self, prior: Gaussian, sample: WindowSample, replaced: ParticleWindow | None = None) -> ParticleWindow:
        return METHOD.open(prior, sample, replaced)

    def extend(self, window: ParticleWindow, sample: WindowSample) -> ParticleWindow:
        return METHOD.extend(window, sample)

    def evaluate(self, config: Config, window: ParticleWindow, context: Context) -> Verdict:
        verdict = next(self.verdicts, None)
        if verdict is None:
            # every run has a start of its own
            raise Due(window, context._replace(mu=config.start_mu) if context.mu is None else context)
        return verdict


def drive(runs: Sequence[Run], window_ms: list[float] | None = None) -> list[list[Estimate]]:
    """Take every run to its end and return its estimates; the runs' configurations may differ in `start_mu` only.

    The time per window of every batch, in ms, is added to `window_ms`.
    """
    took = [] if window_ms is None else window_ms
    states = [init(run.config, run.seed) for run in runs]
    estimates: list[list[Estimate]] = [[] for _ in runs]
    for tick in range(max(len(run.measurements) for run in runs) + 1):
        verdicts: dict[int, list[Verdict]] = {i: [] for i, run in enumerate(runs) if tick <= len(run.measurements)}
        waiting = list(verdicts)
        while waiting:
            dues: dict[int, Due] = {}
            for i in waiting:
                try:
                    states[i], given = _advance(runs[i], states[i], tick, verdicts[i])
                    estimates[i] += given
                except Due as due:
                    dues[i] = due
            waiting = list(dues)
            for i, verdict in zip(waiting, _evaluate(runs[0].config, list(dues.values()), took), strict=True):
                verdicts[i].append(verdict)
    return estimates


def _advance(run: Run, state: State, tick: int, verdicts: Sequence[Verdict]) -> tuple[State, Sequence[Estimate]]:
    """Take the measurement of a tick, or behind the last one the end of the data."""
    state = state._replace(method=Prepared(iter(verdicts)))
    if tick == len(run.measurements):
        return finish(run.config, state)
    state, estimate = step(run.config, state, run.measurements[tick])
    return state, () if estimate is None else (estimate,)


def _evaluate(config: Config, dues: Sequence[Due], took_ms: list[float]) -> list[Verdict]:
    """Evaluate the windows, those of equal length together; runs that differ in their start only draw as one."""
    if not dues:
        return []
    started = time.perf_counter()
    first: dict[str, np.random.Generator] = {}
    groups: dict[int, list[int]] = defaultdict(list)
    for index, due in enumerate(dues):
        rng = first.setdefault(repr(due.context.rng.bit_generator.state), due.context.rng)
        due.context = due.context._replace(rng=rng)
        groups[len(due.window.samples)].append(index)
    verdicts: dict[int, Verdict] = {}
    for members in groups.values():
        some = [dues[index] for index in members]
        found = evaluate(config, [due.window for due in some], [due.context for due in some])
        verdicts |= zip(members, found, strict=True)
    took_ms.append(1e3 * (time.perf_counter() - started) / len(dues))
    return [verdicts[index] for index in range(len(dues))]
