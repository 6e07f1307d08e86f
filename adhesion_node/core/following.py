# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What one measurement in its turn does: it is judged, the train is followed with it, the window grows or ends."""

import math

from .belief import tracker
from .belief.gaussian import Gaussian, coast
from .belief.window import WindowSample
from .config import Config
from .estimate import Estimate, blind_estimate, estimate_of, judge
from .intake.outcome import Event, Outcome, counted
from .intake.plausibility import is_kmh
from .intake.samples import Measurement
from .methods.protocol import Verdict
from .state import State


def follow(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """Judge the next measurement in time; follow the train with it where it is good."""
    seen = state.seen
    repeated = state.repeated.after(measurement, seen)
    if repeated.is_stuck(measurement):
        return _unseen(config, state, measurement)
    state = state._replace(repeated=repeated, unseen=0)
    if measurement.speed_mps is not None and seen is not None and is_kmh(measurement.speed_mps, seen.speed_mps):
        detail = f"speed x = {measurement.speed_mps:g} at {seen.speed_mps:.3g} m/s"
        state, measurement = state.told(Event(Outcome.SPEED_IN_KMH, detail)), measurement._replace(speed_mps=None)
    if state.newest is None or state.belief is None:
        return _accept(config, state, measurement, tracker.meet(measurement, config.unknown_speed_mps), 0.0)
    dt_s = (measurement.t_ns - state.newest.t_ns) * 1e-9
    braked = config.brake(state.newest.brake_pressure_pa) > 0.0
    belief = coast(state.belief, dt_s, config.speed_noise_rate(braked))
    innovation = tracker.innovation(belief, measurement)
    if innovation > config.gate_sigma:
        detail = f"position x = {measurement.position_m:.12g}, innovation {innovation:.3g} standard deviations"
        if state.outliers + 1 < config.max_outliers:
            return state._replace(outliers=state.outliers + 1).told(Event(Outcome.OUTLIER, detail)), None
        state = state.forgotten()._replace(seen=seen, repeated=repeated)
        state = state.told(Event(Outcome.RESET, detail))
        return _accept(config, state, measurement, tracker.meet(measurement, config.unknown_speed_mps), 0.0)
    belief = tracker.correct(belief, measurement, _speed_variance(config, measurement))
    return _accept(config, state, measurement, belief, dt_s)


def _unseen(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """The position is stuck: as often as there are estimates, say what holds without it."""
    before, due = state.repeated.before, state.unseen % config.step == 0
    event = Event(Outcome.STUCK, f"position x = {measurement.position_m:.12g}")
    state = state._replace(unseen=state.unseen + 1).told(event)
    return state, blind_estimate(config, before, measurement.t_ns) if due and before else None


def _accept(
    config: Config, state: State, measurement: Measurement, belief: Gaussian, dt_s: float
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
        belief=belief,
        window=window,
        outliers=0,
        since_estimate=state.since_estimate + 1,
    )
    if brake == 0.0 or belief.mean[1] < config.slowest_mps:
        return _release(config, state)
    if window is None and tracker.is_settled(
        belief, measurement.variance_m2 * dt_s, config.speed_noise_rate(True), config.settled_ratio
    ):
        state = state._replace(window=state.method.open(belief, sample))
    if state.since_estimate < config.step:
        return state, None
    state, _, estimate = _estimate(config, state)
    return state, estimate


def _release(config: Config, state: State) -> tuple[State, Estimate | None]:
    """Coast, or end a braking with its last, short window."""
    if state.window is None and state.since_estimate < config.step:
        return state, None
    state, verdict, estimate = _estimate(config, state)
    return state._replace(window=None, belief=verdict.belief), estimate


def _estimate(config: Config, state: State) -> tuple[State, Verdict, Estimate]:
    newest, belief, knowledge = state.newest, state.belief, state.knowledge
    assert newest is not None  # an estimate follows an accepted measurement
    assert belief is not None
    verdict, knowledge = judge(config, state.method, state.seed, newest, belief, state.window, knowledge)
    estimate = estimate_of(newest.t_ns, verdict, knowledge.changes)
    state = state._replace(window=verdict.window, knowledge=knowledge, since_estimate=0, seen=estimate)
    return state, verdict, estimate


def _speed_variance(config: Config, measurement: Measurement) -> float:
    """Variance of the measured speed; infinite where there is none or a braked axle may slide."""
    if measurement.speed_mps is None:
        return math.inf
    rolling = config.speed_while_braking or config.brake(measurement.brake_pressure_pa) == 0.0
    return config.speed_std_mps**2 if rolling else math.inf


def last_window(config: Config, state: State) -> tuple[State, tuple[Estimate, ...]]:
    """Evaluate the last, short window, at the end of a time or of the data."""
    if state.newest is None or not state.since_estimate:
        return state, ()
    state, _, last = _estimate(config, state)
    return state, (last,)
