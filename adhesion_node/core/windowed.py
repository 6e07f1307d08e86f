# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What one measurement does where the adhesion is identified in windows: the train is followed, the window grows."""

import math
from statistics import median

import numpy as np

from .belief import tracker
from .belief.gaussian import Gaussian, coast
from .belief.window import WindowSample
from .config import Config
from .estimate import Estimate, estimate_of, judge
from .intake.outcome import ACCEPTED, TICK, Event, Outcome, counted
from .intake.samples import MAX_VARIANCE_M2, Measurement
from .methods.protocol import AnyMethod, Verdict
from .state import State

SAYS_NOTHING_M2 = 1e14
"""Variance of a position that was not measured, for the methods: it says nothing and keeps every formula finite."""


def follow_windowed(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """Follow the train with a good measurement, in windows of its braking."""
    if state.newest is None or state.belief is None:
        return _accept(config, state, measurement, _met(config, measurement), 0.0)
    dt_s = (measurement.t_ns - state.newest.t_ns) * 1e-9
    braked = config.is_braked(state.newest.brake_pressure_pa)
    belief = coast(state.belief, dt_s, config.speed_noise_rate(braked))
    if measurement.has_position and belief.covariance[0, 0] > 0.5 * MAX_VARIANCE_M2:
        state, belief = state._replace(window=None), tracker.place(belief, measurement)
    innovation = tracker.innovation(belief, measurement)
    if innovation > config.gate_sigma:
        detail = f"position x = {measurement.position_m:.12g}, innovation {innovation:.3g} standard deviations"
        if state.outliers + 1 < config.max_outliers:
            return state._replace(outliers=state.outliers + 1).told(Event(Outcome.OUTLIER, detail)), None
        anew = state.forgotten()._replace(seen=state.seen, repeated=state.repeated)
        state = anew._replace(pace=state.pace, turning=state.turning)
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
        window = _method(state).extend(window, sample)
    state = state._replace(
        counts=counted(state.counts, ACCEPTED if measurement.has_position else TICK),
        newest=measurement,
        belief=belief,
        window=window,
        outliers=0 if measurement.has_position else state.outliers,
        since_estimate=state.since_estimate + 1,
    )
    if brake == 0.0 or belief.mean[1] < config.slowest_mps:
        return _release(config, state)
    if window is None:
        settled = (
            tracker.is_settled(
                belief, measurement.variance_m2 * dt_s, config.speed_noise_rate(True), config.settled_ratio
            )
            if measurement.has_position
            else math.isfinite(sample.speed_variance)
        )
        state = state._replace(window=_method(state).open(belief, sample) if settled else None)
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
    """Judge the window; one whose numbers fail is withheld, and the next one opens with the next measurement."""
    try:
        with np.errstate(invalid="raise", over="raise"):
            return _judged(config, state)
    except (ArithmeticError, ValueError) as error:
        count = 0 if state.window is None else len(state.window.samples)
        state = state._replace(window=None).told(Event(Outcome.FAILED, f"{count} measurements ({error})"))
        return _judged(config, state)


def _judged(config: Config, state: State) -> tuple[State, Verdict, Estimate]:
    newest, belief, knowledge = state.newest, state.belief, state.knowledge
    assert newest is not None  # an estimate follows an accepted measurement
    assert belief is not None
    verdict, knowledge = judge(config, _method(state), state.seed, newest, belief, state.window, knowledge)
    estimate = estimate_of(newest.t_ns, verdict, knowledge.changes)
    if not all(math.isfinite(value) for value in estimate if isinstance(value, float)):
        raise FloatingPointError("not finite")
    state = state._replace(window=verdict.window, knowledge=knowledge, since_estimate=0, seen=estimate)
    return state, verdict, estimate


def _method(state: State) -> AnyMethod:
    assert state.method is not None  # else there are no windows
    return state.method


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
