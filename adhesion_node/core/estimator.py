# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The one way in, live and offline: `init`, `step` for every sample, `finish` at the end of the data.

A sample passes the gate for time, which pairs it into a measurement; that is judged, and joins the window of the
present braking; every L accepted measurements give an `Estimate`. Randomness comes from the seed and the window's
number alone, so the same samples give the same bits whoever feeds them.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from numbers import Integral

from .config import Config
from .estimate import Estimate
from .following import follow, last_estimate
from .intake import inbox as gate
from .intake.clock import Read
from .intake.outcome import Event, Outcome
from .intake.pairing import Gate, Inbox, Matched, Source, Tick
from .intake.samples import (
    DemandSample,
    ImuSample,
    Measurement,
    PositionSample,
    PressureSample,
    Sample,
    SpeedSample,
    WheelSample,
)
from .methods import METHODS
from .state import State


def init(config: Config, seed: int) -> State:
    """State before the first measurement. Raises ValueError for a seed that is negative or no integer."""
    if not (isinstance(seed, Integral) and seed >= 0):
        raise ValueError(f"seed = {seed!r}: give an integer of at least 0")
    return State(seed, gate_of(config), METHODS.get(config.method))


def gate_of(config: Config) -> Gate:
    """How the sensors are paired: a further one is a line here and a field of `Measurement`."""
    wait, age = round(config.pressure_wait_s * 1e9), round(config.pressure_age_s * 1e9)
    return Gate(
        anchor=PositionSample,
        sources=(
            Source(PressureSample, wait, age),
            Source(DemandSample, wait, age),
            Source(PressureSample, wait, wait, each=True),
            Source(SpeedSample, wait, wait, each=True, leads=True),
            Source(WheelSample, wait, wait, each=True, leads=True),
            Source(ImuSample, wait, wait, each=True),
            Source(DemandSample, wait, wait, each=True),
        ),
        max_lag_ns=round(config.max_lag_s * 1e9),
        far_ns=round(config.max_gap_s * 1e9),
        reset_ns=round(config.reset_s * 1e9),
        late_run=config.max_outliers,
        tick_ns=round(config.tick_s * 1e9),
        tick_for_ns=round(config.tick_for_s * 1e9),
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
    state = state._replace(events=()) if state.events else state
    if not sample.is_valid():
        return state.told(Event(Outcome.INVALID, repr(sample))), ()
    if isinstance(sample, PositionSample):
        return _read(config, state, state.clock.read(sample))
    state, doubted = _read(config, state, state.clock.beside(sample))
    state, estimates = _passed(config, state, gate.push(state.gate, state.inbox, sample))
    return state, doubted + estimates


def settle(config: Config, state: State) -> tuple[State, tuple[Estimate, ...]]:
    """Silence: what waits for others of its time waits no longer."""
    return _passed(config, state._replace(events=()), gate.settle(state.gate, state.inbox))


def finish(config: Config, state: State) -> tuple[State, tuple[Estimate, ...]]:
    """End of the data: take what still waits and evaluate the last, short window (step 5 of the paper)."""
    state, doubted = _read(config, state._replace(events=()), state.clock.settled())
    state, estimates = _passed(config, state, gate.drain(state.gate, state.inbox))
    state, last = last_estimate(config, state)
    return state, doubted + estimates + last


def warm_up(config: Config) -> None:
    """Brake once on made up measurements: what is compiled when first used is so before a train brakes.

    The windows of the configured method are short, so that they fill, and see the positions step.
    """
    config = replace(config, window=12, step=4, change_edge=2, shortest_window_s=0.0, particles=2, iterations=5)
    state, speed = init(config, seed=0), 30.0
    for k in range(40):
        t_ns, pressure = k * 100_000_000, 0.0 if k < 20 else config.train.full_pressure_pa
        wheels = WheelSample(t_ns, (speed / config.train.wheel_radius_m,))
        others = PressureSample(t_ns, pressure), SpeedSample(t_ns, speed, 0.01), ImuSample(t_ns, 0.0, 0.01), wheels
        for sample in (*others, PositionSample(t_ns, 3.0 * k + (k > 33), 0.01)):
            state, _ = advance(config, state, sample)
    finish(config, state)


def paired(config: Config, samples: Iterable[Sample]) -> Iterator[Measurement]:
    """The measurements that samples make, in order: for estimators that do no more than the gate did."""
    by, inbox = gate_of(config), Inbox()
    for sample in samples:
        pushed = gate.push(by, inbox, sample)
        inbox = pushed.inbox
        for matched in pushed.ended + pushed.matched:
            yield _measurement(config, matched)
    for matched in gate.drain(by, inbox).matched:
        yield _measurement(config, matched)


def _read(config: Config, state: State, read: Read) -> tuple[State, tuple[Estimate, ...]]:
    """Use the positions whose stamps are believed."""
    state, estimates = state._replace(clock=read.clock).told(*read.events), tuple[Estimate, ...]()
    for sample in read.samples:
        state, made = _passed(config, state, gate.push(state.gate, state.inbox, sample))
        estimates += made
    return state, estimates


def _passed(config: Config, state: State, pushed: gate.Pushed) -> tuple[State, tuple[Estimate, ...]]:
    """Use what the gate has let through."""
    before: tuple[Estimate, ...] = ()
    if pushed.events and any(event.outcome is Outcome.RESET for event in pushed.events):
        state, before = _take_all(config, state, pushed.ended)
        state, last = last_estimate(config, state)
        state, before = state.forgotten(), before + last
    state = state._replace(inbox=pushed.inbox)
    if pushed.events:
        state = state.told(*pushed.events)
    if not pushed.matched:
        return state, before
    state, estimates = _take_all(config, state, pushed.matched)
    return state, before + estimates


def _take_all(config: Config, state: State, matched: Iterable[Matched]) -> tuple[State, tuple[Estimate, ...]]:
    estimates = []
    for each in matched:
        state, estimate = follow(config, state, _measurement(config, each))
        if estimate is not None:
            estimates.append(estimate)
    return state, tuple(estimates)


def _measurement(config: Config, matched: Matched) -> Measurement:
    if isinstance(matched.anchor, Measurement):
        return matched.anchor
    t_ns, position_m, variance_m2 = (
        (matched.anchor.t_ns, 0.0, math.inf) if isinstance(matched.anchor, Tick) else matched.anchor
    )
    pressure, demand, pressures, speeds, wheels, imu, demands = matched.values
    fresh = bool(speeds) and t_ns - speeds[-1].t_ns <= round(config.pressure_wait_s * 1e9)
    speed_mps = speeds[-1].speed_mps if fresh else None
    newest = pressure and pressure.pressure_pa, speed_mps, demand and demand.pressure_pa
    return Measurement(t_ns, position_m, variance_m2, *newest, pressures, speeds, wheels, imu, demands)
