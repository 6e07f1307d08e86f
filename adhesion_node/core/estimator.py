# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The one way in, live and offline: `init`, `step` for every sample, `finish` at the end of the data.

A sample passes the gate for time, which pairs it into a measurement; that is judged, and joins the window of the
present braking; every L accepted measurements give an `Estimate`. Randomness comes from the seed and the window's
number alone, so the same samples give the same bits whoever feeds them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from statistics import median
from typing import NamedTuple

from .belief import tracker
from .belief.gaussian import Gaussian
from .belief.window import Sample as WindowSample
from .config import Config
from .estimate import Estimate, Knowledge, blind_estimate, estimate_of, judge
from .intake import inbox as gate
from .intake.outcome import NO_COUNTS, Event, Outcome, counted
from .intake.pairing import Gate, Inbox, Matched, Source
from .intake.plausibility import Repeated, is_kmh
from .intake.samples import Measurement, PositionSample, PressureSample, Sample, SpeedSample, WheelSample
from .methods import METHODS
from .methods.protocol import AnyMethod, MethodWindow, Verdict

SLOWEST_MPS = 3.0
"""Speed below which the windows stop: a train about to stand still says nothing of the adhesion."""


class State(NamedTuple):
    """Everything the estimator remembers. Immutable: `step` returns a new one."""

    seed: int
    gate: Gate
    method: AnyMethod
    """How the adhesion is identified; another value may be put here."""
    counts: Mapping[Outcome, int] = NO_COUNTS
    events: tuple[Event, ...] = ()
    """What the sample that came last brought about, other than that samples were accepted."""
    inbox: Inbox = Inbox()
    """Samples that wait."""
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
    seen: Estimate | None = None
    """The last estimate that positions have borne out."""
    repeated: Repeated[Estimate] = Repeated(math.nan, 0, None)
    unseen: int = 0
    """Measurements in a row of a position sensor that is stuck."""

    @property
    def outcome(self) -> Outcome:
        """What became of the sample that came last."""
        return self.events[-1].outcome if self.events else Outcome.ACCEPTED

    @property
    def stuck(self) -> bool:
        """Whether the position sensor repeats itself while the train moves."""
        return self.unseen > 0


def init(config: Config, seed: int) -> State:
    """State before the first measurement. Raises ValueError for a negative seed."""
    if seed < 0:
        raise ValueError(f"seed = {seed}: give an integer of at least 0")
    return State(seed, gate_of(config), METHODS[config.method])


def gate_of(config: Config) -> Gate:
    """How the sensors are paired: a further one is a line here and a field of `Measurement`."""
    wait, age = round(config.pressure_wait_s * 1e9), round(config.pressure_age_s * 1e9)
    return Gate(
        anchor=PositionSample,
        sources=(
            Source(PressureSample, wait, age),
            Source(SpeedSample, wait, wait, once=True),
            Source(WheelSample, wait, wait),
        ),
        max_lag_ns=round(config.max_lag_s * 1e9),
        far_ns=round(config.max_gap_s * 1e9),
        reset_ns=round(config.reset_s * 1e9),
        late_run=config.max_outliers,
    )


def step(config: Config, state: State, sample: Sample) -> tuple[State, Estimate | None]:
    """Take one sample, or a measurement made elsewhere; every `config.step` accepted measurements return an estimate.

    What became of it stands in `State.events` and is counted in `State.counts`. With `max_lag_s` above 0 positions
    wait for late ones to be sorted in, and are judged when their turn comes; should several estimates fall due at
    once, after a gap, the newest is returned (`advance` returns all).
    """
    state, estimates = advance(config, state, sample)
    return state, estimates[-1] if estimates else None


def advance(config: Config, state: State, sample: Sample) -> tuple[State, tuple[Estimate, ...]]:
    """Take one sample as `step` does; return every estimate that falls due."""
    state = state._replace(events=())
    if not sample.is_valid():
        return _told(state, Event(Outcome.INVALID, repr(sample))), ()
    return _passed(config, state, gate.push(state.gate, state.inbox, sample))


def settle(config: Config, state: State) -> tuple[State, tuple[Estimate, ...]]:
    """Silence: what waits for others of its time waits no longer."""
    return _passed(config, state._replace(events=()), gate.settle(state.gate, state.inbox))


def finish(config: Config, state: State) -> tuple[State, tuple[Estimate, ...]]:
    """End of the data: take what still waits and evaluate the last, short window (step 5 of the paper)."""
    state, estimates = _passed(config, state._replace(events=()), gate.drain(state.gate, state.inbox))
    state, last = _last_window(config, state)
    return state, estimates + last


def paired(config: Config, samples: Iterable[Sample]) -> Iterator[Measurement]:
    """The measurements that samples make, in order: for estimators that do no more than the gate did."""
    by, inbox = gate_of(config), Inbox()
    for sample in samples:
        pushed = gate.push(by, inbox, sample)
        inbox = pushed.inbox
        yield from map(_measurement, pushed.ended + pushed.matched)
    yield from map(_measurement, gate.drain(by, inbox).matched)


def _passed(config: Config, state: State, pushed: gate.Pushed) -> tuple[State, tuple[Estimate, ...]]:
    """Use what the gate has let through."""
    before: tuple[Estimate, ...] = ()
    if any(event.outcome is Outcome.RESET for event in pushed.events):
        state, before = _take_all(config, state, pushed.ended)
        state, last = _last_window(config, state)
        state, before = _forgotten(state), before + last
    state = _told(state._replace(inbox=pushed.inbox), *pushed.events)
    state, estimates = _take_all(config, state, pushed.matched)
    return state, before + estimates


def _last_window(config: Config, state: State) -> tuple[State, tuple[Estimate, ...]]:
    if state.newest is None or not state.since_estimate:
        return state, ()
    state, _, last = _estimate(config, state)
    return state, (last,)


def _told(state: State, *events: Event) -> State:
    return state._replace(counts=counted(state.counts, *events), events=state.events + events)


def _forgotten(state: State) -> State:
    """Forget all but the counts, what still waits, and the number of windows, which keeps the random streams apart."""
    knowledge = Knowledge(windows=state.knowledge.windows)
    seed, gate, method, counts, events, inbox, *_ = state
    return State(seed, gate, method, counts, events, inbox, knowledge=knowledge)


def _take_all(config: Config, state: State, matched: Iterable[Matched]) -> tuple[State, tuple[Estimate, ...]]:
    estimates = []
    for each in matched:
        state, estimate = _take(config, state, _measurement(each))
        estimates += [] if estimate is None else [estimate]
    return state, tuple(estimates)


def _measurement(matched: Matched) -> Measurement:
    if isinstance(matched.anchor, Measurement):
        return matched.anchor
    t_ns, position_m, variance_m2 = matched.anchor
    pressure, speed, wheels = matched.values
    return Measurement(
        t_ns,
        position_m,
        variance_m2,
        brake_pressure_pa=pressure and pressure.pressure_pa,
        speed_mps=speed and speed.speed_mps,
        wheel_radps=wheels and median(wheels.speeds_radps),
    )


def _take(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """Judge the next measurement in time; follow the train with it where it is good."""
    seen = state.seen
    repeated = state.repeated.after(measurement, seen)
    if repeated.is_stuck(measurement):
        return _unseen(config, state, measurement)
    state = state._replace(repeated=repeated, unseen=0)
    if measurement.speed_mps is not None and seen is not None and is_kmh(measurement.speed_mps, seen.speed_mps):
        detail = f"speed x = {measurement.speed_mps:g} at {seen.speed_mps:.3g} m/s"
        state, measurement = _told(state, Event(Outcome.SPEED_IN_KMH, detail)), measurement._replace(speed_mps=None)
    if state.newest is None or state.law is None:
        return _accept(config, state, measurement, tracker.meet(measurement), 0.0)
    dt_s = (measurement.t_ns - state.newest.t_ns) * 1e-9
    braked = config.brake(state.newest.brake_pressure_pa) > 0.0
    law = tracker.predict(state.law, dt_s, braked, config.coasting_noise_mps**2 / 0.1)
    innovation = tracker.innovation(law, measurement)
    if innovation > config.gate_sigma:
        detail = f"position x = {measurement.position_m:.12g}, innovation {innovation:.3g} standard deviations"
        if state.outliers + 1 < config.max_outliers:
            return _told(state._replace(outliers=state.outliers + 1), Event(Outcome.OUTLIER, detail)), None
        state = _forgotten(state)._replace(seen=seen, repeated=repeated)
        state = _told(state, Event(Outcome.RESET, detail))
        return _accept(config, state, measurement, tracker.meet(measurement), 0.0)
    law = tracker.correct(law, measurement, _speed_variance(config, measurement))
    return _accept(config, state, measurement, law, dt_s)


def _unseen(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """The position is stuck: as often as there are estimates, say what holds without it."""
    before, due = state.repeated.before, state.unseen % config.step == 0
    event = Event(Outcome.STUCK, f"position x = {measurement.position_m:.12g}")
    state = _told(state._replace(unseen=state.unseen + 1), event)
    return state, blind_estimate(config, before, measurement.t_ns) if due and before else None


def _accept(
    config: Config, state: State, measurement: Measurement, law: Gaussian, dt_s: float
) -> tuple[State, Estimate | None]:
    """Let an accepted measurement join or open the window; give an estimate when one is due."""
    brake = config.brake(measurement.brake_pressure_pa)
    sample = WindowSample(
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
    state = state._replace(
        counts=counted(state.counts, Event(Outcome.ACCEPTED)),
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
    estimate = estimate_of(newest.t_ns, verdict, knowledge.changes)
    state = state._replace(window=verdict.window, knowledge=knowledge, since_estimate=0, seen=estimate)
    return state, verdict, estimate


def _speed_variance(config: Config, measurement: Measurement) -> float:
    """Variance of the measured speed; infinite where there is none or a braked axle may slide."""
    if measurement.speed_mps is None:
        return math.inf
    rolling = config.speed_while_braking or config.brake(measurement.brake_pressure_pa) == 0.0
    return config.speed_std_mps**2 if rolling else math.inf
