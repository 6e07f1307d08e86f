# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What one measurement in its turn does: it is judged, the train is followed with it, the window grows or ends."""

import math
from statistics import median

from .belief import tracker
from .belief.gaussian import Gaussian, coast
from .belief.window import WindowSample
from .config import Config
from .estimate import Estimate, blind_estimate, estimate_of, judge
from .intake.outcome import Event, Outcome, counted
from .intake.plausibility import in_mps, is_kmh
from .intake.samples import MAX_VARIANCE_M2, Measurement
from .methods.protocol import Verdict
from .state import State

SAYS_NOTHING_M2 = 1e14
"""Variance of a position that was not measured, for the methods: it says nothing and keeps every formula finite."""


def follow(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """Judge the next measurement in time; follow the train with it where it is good."""
    seen = state.seen
    repeated = state.repeated
    if measurement.has_position:
        repeated = repeated.after(measurement, seen)
        if repeated.is_stuck(measurement):
            return _unseen(config, state, measurement)
        state = state._replace(repeated=repeated, unseen=0)
    pace = state.pace.after(measurement)
    measurement, refused = in_mps(measurement, (pace.speed_mps, math.nan if seen is None else seen.speed_mps))
    state = state._replace(pace=pace).told(*refused)
    if refused and state.belief is not None and is_kmh(float(state.belief.mean[1]), pace.speed_mps):
        detail = f"speed x = {float(state.belief.mean[1]):.3g}, positions at {pace.speed_mps:.3g} m/s"
        state, seen = state.forgotten()._replace(pace=pace).told(Event(Outcome.RESET, detail)), None
    if state.newest is None or state.belief is None:
        return _accept(config, state, measurement, _met(config, measurement), 0.0)
    dt_s = (measurement.t_ns - state.newest.t_ns) * 1e-9
    braked = config.brake(state.newest.brake_pressure_pa) > 0.0
    belief = coast(state.belief, dt_s, config.speed_noise_rate(braked))
    if measurement.has_position and belief.covariance[0, 0] > 0.5 * MAX_VARIANCE_M2:
        state, belief = state._replace(window=None), tracker.place(belief, measurement)
    innovation = tracker.innovation(belief, measurement)
    if innovation > config.gate_sigma:
        detail = f"position x = {measurement.position_m:.12g}, innovation {innovation:.3g} standard deviations"
        if state.outliers + 1 < config.max_outliers:
            return state._replace(outliers=state.outliers + 1).told(Event(Outcome.OUTLIER, detail)), None
        state = state.forgotten()._replace(seen=seen, repeated=repeated, pace=pace)
        state = state.told(Event(Outcome.RESET, detail))
        return _accept(config, state, measurement, _met(config, measurement), 0.0)
    belief = tracker.correct(belief, measurement, _speed_variance(config, measurement))
    return _accept(config, state, measurement, belief, dt_s)


def _met(config: Config, measurement: Measurement) -> Gaussian:
    """Belief of a train just met; by its speed alone where there is no position."""
    belief = tracker.meet(measurement, config.unknown_speed_mps)
    if measurement.has_position:
        return belief
    return tracker.correct(belief, measurement, _speed_variance(config, measurement))


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
        measurement.position_m if measurement.has_position else float(belief.mean[0]),
        min(measurement.variance_m2, SAYS_NOTHING_M2),
        measurement.speed_mps or 0.0,
        _speed_variance(config, measurement),
        _wheel_mps(config, measurement),
    )
    window = state.window if dt_s <= config.max_gap_s else None
    if window is not None:
        window = state.method.extend(window, sample)
    state = state._replace(
        counts=counted(state.counts, Event(Outcome.ACCEPTED if measurement.has_position else Outcome.TICK)),
        newest=measurement,
        belief=belief,
        window=window,
        outliers=0 if measurement.has_position else state.outliers,
        since_estimate=state.since_estimate + 1,
    )
    if brake == 0.0 or belief.mean[1] < config.slowest_mps:
        return _release(config, state)
    settled = (
        tracker.is_settled(belief, measurement.variance_m2 * dt_s, config.speed_noise_rate(True), config.settled_ratio)
        if measurement.has_position
        else math.isfinite(sample.speed_variance)
    )
    if window is None and settled:
        state = state._replace(window=state.method.open(belief, sample))
    if state.since_estimate < config.step and measurement.has_position:
        return state, None
    state, _, estimate = _estimate(config, state)
    return state, estimate


def _release(config: Config, state: State) -> tuple[State, Estimate | None]:
    """Coast, or end a braking with its last, short window."""
    if state.window is None and state.since_estimate < config.step and state.newest and state.newest.has_position:
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
    if config.speed_source == "axle" and config.brake(measurement.brake_pressure_pa) > 0.0:
        return math.inf
    variance = measurement.speeds[-1].variance if measurement.speeds else None
    return config.speed_std_mps**2 if variance is None else variance


def _wheel_mps(config: Config, measurement: Measurement) -> float:
    """Speed of the median axle's rim; NaN where no axle was measured of late."""
    newest = measurement.wheels[-1] if measurement.wheels else None
    if newest is None or measurement.t_ns - newest.t_ns > round(config.pressure_wait_s * 1e9):
        return math.nan
    return median(newest.known_radps) * config.train.wheel_radius_m


def last_window(config: Config, state: State) -> tuple[State, tuple[Estimate, ...]]:
    """Evaluate the last, short window, at the end of a time or of the data."""
    if state.newest is None or not state.since_estimate:
        return state, ()
    state, _, last = _estimate(config, state)
    return state, (last,)
