# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The one way in, live and offline: `init`, `step` for every measurement, `finish` at the end of the data.

A measurement is put in order, gated, and joins the window of the present braking; every L accepted measurements
give an `Estimate`. Randomness comes from the seed and the window's number alone, so the same measurements give the
same bits whoever feeds them.
"""

from __future__ import annotations

import math
from bisect import bisect_right, insort
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from .belief import tracker
from .belief.gaussian import Gaussian
from .belief.outcome import Outcome
from .belief.window import Sample
from .config import Config
from .estimate import Estimate, Knowledge, estimate_of, judge
from .intake.samples import Measurement
from .methods import METHODS
from .methods.protocol import AnyMethod, MethodWindow, Verdict

SLOWEST_MPS = 3.0
"""Speed below which the windows stop: a train about to stand still says nothing of the adhesion."""


MOST_WAITING = 12_000
"""Measurements that wait for late ones at most, 60 s of 200 Hz: stamps that scatter about one time let none go."""


class State(NamedTuple):
    """Everything the estimator remembers. Immutable: `step` returns a new one."""

    seed: int
    method: AnyMethod
    """How the adhesion is identified; another value may be put here."""
    counts: Mapping[Outcome, int] = MappingProxyType(dict.fromkeys(Outcome, 0))
    outcome: Outcome = Outcome.ACCEPTED
    """What became of the measurement that came last."""
    pending: tuple[Measurement, ...] = ()
    """Measurements that wait, sorted, for late ones."""
    newest: Measurement | None = None
    """The newest measurement that was accepted."""
    law: Gaussian | None = None
    """Law of (s, v) at the newest accepted measurement, from the tracker."""
    window: MethodWindow | None = None
    """The present braking; None while coasting or while the speed is not known."""
    knowledge: Knowledge = Knowledge()
    outliers: int = 0
    """Outliers in a row."""
    since_estimate: int = 0
    """Measurements accepted since the last estimate."""


def init(config: Config, seed: int) -> State:
    """State before the first measurement. Raises ValueError for a negative seed."""
    if seed < 0:
        raise ValueError(f"seed = {seed}: give an integer of at least 0")
    return State(seed, METHODS[config.method])


def step(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """Take one measurement; every `config.step` accepted ones return an estimate.

    What became of the measurement stands in `State.outcome` and is counted in `State.counts`. With `max_lag_s`
    above 0 a measurement waits for late ones to be sorted in, and is judged when its turn comes; should several
    estimates fall due at once, after a gap, the newest is returned.
    """
    newest = _newest(state)
    if not measurement.is_valid():
        return _counted(state, Outcome.INVALID), None
    estimates: list[Estimate] = []
    if newest is not None and abs(measurement.t_ns - newest.t_ns) > config.reset_s * 1e9:
        state, estimates = _take_all(config, state._replace(pending=()), state.pending)
        state = _reset(state)
    if any(waiting.t_ns == measurement.t_ns for waiting in state.pending):
        return _counted(state, Outcome.DUPLICATE), None
    pending = list(state.pending)
    insort(pending, measurement, key=lambda waiting: waiting.t_ns)
    due_ns = pending[-1].t_ns - round(config.max_lag_s * 1e9)
    due = max(bisect_right(pending, due_ns, key=lambda waiting: waiting.t_ns), len(pending) - MOST_WAITING)
    state = state._replace(pending=tuple(pending[due:]), outcome=Outcome.ACCEPTED)
    state, later = _take_all(config, state, pending[:due])
    return state, next(reversed(estimates + later), None)


def finish(config: Config, state: State) -> tuple[State, tuple[Estimate, ...]]:
    """End of the data: take what still waits and evaluate the last, short window (step 5 of the paper)."""
    state, estimates = _take_all(config, state._replace(pending=()), state.pending)
    if state.newest is not None and state.since_estimate:
        state, _, last = _estimate(config, state)
        estimates.append(last)
    return state, tuple(estimates)


def _newest(state: State) -> Measurement | None:
    return state.pending[-1] if state.pending else state.newest


def _counted(state: State, outcome: Outcome) -> State:
    counts = MappingProxyType({**state.counts, outcome: state.counts[outcome] + 1})
    return state._replace(counts=counts, outcome=outcome)


def _reset(state: State) -> State:
    """Forget all but the counts, what still waits, and the number of windows, which keeps the random streams apart."""
    knowledge = Knowledge(windows=state.knowledge.windows)
    new = State(state.seed, state.method, counts=state.counts, pending=state.pending, knowledge=knowledge)
    return _counted(new, Outcome.RESET)


def _take_all(config: Config, state: State, waiting: Iterable[Measurement]) -> tuple[State, list[Estimate]]:
    estimates = []
    for measurement in waiting:
        state, result = _take(config, state, measurement)
        estimates += [] if result is None else [result]
    return state, estimates


def _take(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """Judge the next measurement in time; follow the train with it where it is good."""
    if state.newest is None or state.law is None:
        return _accept(config, state, measurement, tracker.meet(measurement), 0.0)
    if measurement.t_ns <= state.newest.t_ns:
        same = measurement.t_ns == state.newest.t_ns
        return _counted(state, Outcome.DUPLICATE if same else Outcome.LATE), None
    dt_s = (measurement.t_ns - state.newest.t_ns) * 1e-9
    braked = config.brake(state.newest.brake_pressure_pa) > 0.0
    law = tracker.predict(state.law, dt_s, braked, config.coasting_noise_mps**2 / 0.1)
    if tracker.innovation(law, measurement) > config.gate_sigma:
        if state.outliers + 1 < config.max_outliers:
            return _counted(state._replace(outliers=state.outliers + 1), Outcome.OUTLIER), None
        return _accept(config, _reset(state), measurement, tracker.meet(measurement), 0.0)
    law = tracker.correct(law, measurement, _speed_variance(config, measurement))
    return _accept(config, state, measurement, law, dt_s)


def _accept(
    config: Config, state: State, measurement: Measurement, law: Gaussian, dt_s: float
) -> tuple[State, Estimate | None]:
    """Let an accepted measurement join or open the window; give an estimate when one is due."""
    brake = config.brake(measurement.brake_pressure_pa)
    sample = Sample(
        measurement.t_ns,
        brake,
        measurement.position_m,
        measurement.variance_m2,
        measurement.speed_mps or 0.0,
        _speed_variance(config, measurement),
        math.nan if measurement.wheel_radps is None else measurement.wheel_radps * config.train.wheel_radius_m,
    )
    window = state.window if dt_s <= config.max_gap_s else None
    if window is not None:
        window = state.method.extend(window, sample)
    state = _counted(state, Outcome.ACCEPTED)._replace(
        newest=measurement,
        law=law,
        window=window,
        outliers=0,
        since_estimate=state.since_estimate + 1,
    )
    if brake == 0.0 or law.mean[1] < SLOWEST_MPS:
        return _release(config, state)
    if window is None and tracker.is_settled(law, measurement.variance_m2 * dt_s):
        state = state._replace(window=state.method.open(law, sample))
    if state.since_estimate < config.step:
        return state, None
    state, _, estimate = _estimate(config, state)
    return state, estimate


def _release(config: Config, state: State) -> tuple[State, Estimate | None]:
    """Coast, or end a braking with its last, short window."""
    if state.window is None and state.since_estimate < config.step:
        return state, None
    state, verdict, estimate = _estimate(config, state)
    return state._replace(window=None, law=verdict.belief), estimate


def _estimate(config: Config, state: State) -> tuple[State, Verdict, Estimate]:
    newest, law, knowledge = state.newest, state.law, state.knowledge
    assert newest is not None  # an estimate follows an accepted measurement
    assert law is not None
    verdict = judge(config, state.method, state.seed, newest, law, state.window, knowledge)
    knowledge = knowledge.after(newest.t_ns, verdict)
    state = state._replace(window=verdict.window, knowledge=knowledge, since_estimate=0)
    return state, verdict, estimate_of(newest.t_ns, verdict, knowledge.changes)


def _speed_variance(config: Config, measurement: Measurement) -> float:
    """Variance of the measured speed; infinite where there is none or a braked axle may slide."""
    if measurement.speed_mps is None:
        return math.inf
    rolling = config.speed_while_braking or config.brake(measurement.brake_pressure_pa) == 0.0
    return config.speed_std_mps**2 if rolling else math.inf
