# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What one measurement does where the bank identifies the adhesion: it joins the belief; estimates come by time."""

import math
from collections.abc import Callable

import numpy as np

from .bank import following as bank
from .bank.blind import misled
from .bank.findings.verdict import SPEED_ERROR, Findings, found
from .bank.memory import Memory
from .bank.motion import Foreseen
from .bank.steps import Stepping
from .belief.gaussian import Gaussian
from .belief.rail import Rail
from .belief.rail_map import Way
from .belief.regime import Regime
from .config import Config
from .estimate import Estimate, estimate_of, unknown
from .intake.outcome import ACCEPTED, TICK, Event, Outcome, counted
from .intake.samples import Measurement
from .methods.protocol import Fit, Verdict
from .state import State

EARLY_S = 1e-3
"""An estimate is told by a measurement that is so much too early, as stamps jitter; not by the next one."""

SOON_NS = 75_000_000
"""A position that comes sooner behind the one before tells nothing new: what a receiver errs by lasts longer. Taken in,
the hypothesis nearest is one of another white part, which takes the wandering for the train."""

LOST_S, LOST_M = 5.0, 50.0
"""A wheel that slides loses no more than the way of so many seconds before it is told, and no receiver steps by more,
or than so far, as one that has held the place of a train that departs slowly; further off is another place."""


def follow_banked(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    """Follow the train with a good measurement; a belief whose numbers fail is given up, and met anew."""
    try:
        return _followed(config, state, measurement)
    except (ArithmeticError, ValueError) as error:
        return _anew(
            state, Event(Outcome.RESET, f"belief lost ({error}), position x = {measurement.position_m:.12g}")
        ), None


@np.errstate(invalid="raise")
def _followed(config: Config, state: State, measurement: Measurement) -> tuple[State, Estimate | None]:
    memory = state.memory
    if memory is None:
        return _accepted(config, state, measurement, bank.met(config, measurement))
    hanging = memory.axles.hanging(memory.slowed_mps)
    odometer = state.odometer.after(config, memory.wheels, measurement, memory.braked, hanging)
    state = state._replace(odometer=odometer)
    if measurement.has_position and (memory.misled or memory.aside):
        detail = f"position x = {measurement.position_m:.12g}"
        state, measurement = state.told(Event(Outcome.SLIDING, detail)), measurement._replace(variance_m2=math.inf)
    soon = measurement.has_position and 0 <= measurement.t_ns - memory.placed_ns < SOON_NS
    memory, measurement = (memory, measurement) if soon else bank.heard(memory, measurement)
    before = memory.bank

    def rail() -> Rail:
        mean, _ = before.moments(2)
        return _here(config, state, measurement.t_ns, Gaussian(mean, np.zeros((2, 2))))

    off = bank.off(config, memory, measurement)
    stepping = state.stepping.after(config, memory, measurement, off)
    size_m = stepping.size_m(config, off.std_m)
    elsewhere = size_m != 0.0 and stepping.is_far(config) and abs(size_m) > max(LOST_S * state.followed_mps, LOST_M)
    if size_m and not elsewhere:
        memory, stepping = stepping.taken(config, size_m, rail)
        return _accepted(config, state, measurement, memory, stepping)
    doubted = stepping.doubts(config)
    off = off._replace(tells=stepping.tells(config, measurement, off))
    if elsewhere or (measurement.has_position and doubted) or off.nearest > config.gate_sigma:
        if memory.braked and not doubted:  # one that may have stepped far tells nothing
            rolled_m = measurement.position_m if memory.is_rolled else None
            course = memory.course.outlying(measurement.t_ns, off.stds, off.tells, rolled_m)
            memory = memory._replace(course=course)
        state = state._replace(stepping=stepping)
        elsewhere = elsewhere or (state.outliers + 1 >= config.max_outliers and not doubted)
        return _unbelieved(config, state, memory, measurement, off, elsewhere, rail)
    measurement = measurement._replace(variance_m2=math.inf) if soon else measurement
    followed = bank.followed(config, memory, measurement, rail, off)
    if followed.pointing.askew and not memory.pointing.askew and (measurement.has_position or not memory.is_placed):
        return _undeceived(config, state, measurement, followed)
    return _accepted(config, state, measurement, followed, stepping, soon)


def _undeceived(
    config: Config, state: State, measurement: Measurement, memory: Memory
) -> tuple[State, Estimate | None]:
    """An accelerometer turns out to be askew: what was believed with it is given up, and the train is met without."""
    anew = _anew(state, Event(Outcome.RESET, "the accelerometer is left out"))
    met = bank.met(config, measurement._replace(imu=()))
    met = met._replace(pointing=memory.pointing, places=memory.places, left_out=memory.left_out)
    return _accepted(config, anew, measurement, met)


def _unbelieved(
    config: Config,
    state: State,
    memory: Memory,
    measurement: Measurement,
    off: Foreseen,
    elsewhere: bool,
    rail: Callable[[], Rail],
) -> tuple[State, Estimate | None]:
    """A position far from what was foreseen: one by chance, or the train is elsewhere, or its wheel slides.

    Under the brake positions fall behind for good where their wheel does.
    """
    detail = f"position x = {measurement.position_m:.12g}, innovation {off.nearest:.3g} standard deviations"
    blind = measurement._replace(variance_m2=math.inf)
    if not elsewhere:
        state = state._replace(outliers=state.outliers + 1).told(Event(Outcome.OUTLIER, detail))
        return _accepted(config, state, blind, bank.followed(config, memory, blind, rail))
    if memory.braked and -LOST_S * state.followed_mps < off.metres < 0.0:
        memory = bank.followed(config, misled(config, memory), blind, rail)
        return _accepted(config, state.told(Event(Outcome.SLIDING, detail)), blind, memory)
    anew = _anew(state, Event(Outcome.RESET, detail))
    return _accepted(config, anew, measurement, bank.met(config, measurement)._replace(places=memory.places))


def _anew(state: State, event: Event) -> State:
    """Nothing is known of train and rail any more."""
    kept = state.forgotten()._replace(
        seen=state.seen, repeated=state.repeated, pace=state.pace, standing=state.standing, turning=state.turning
    )
    return kept.told(event)


def _accepted(
    config: Config,
    state: State,
    measurement: Measurement,
    memory: Memory,
    stepping: Stepping | None = None,
    soon: bool = False,
) -> tuple[State, Estimate | None]:
    if state.memory is not None:
        memory, anew = state.anew.after(config, state.memory, memory, measurement, state.odometer.is_found)
        state = state._replace(anew=anew)
    if not memory.bank.is_sound():
        raise FloatingPointError("not finite, or a variance below 0")
    placed, seen = measurement.has_position, state.seen
    state = state.told(*memory.left_out)
    state = state._replace(
        stepping=Stepping() if memory.aside else state.stepping if stepping is None else stepping,
        counts=counted(state.counts, ACCEPTED if placed or soon else TICK),
        newest=measurement,
        memory=memory,
        outliers=0 if placed else state.outliers,
        since_estimate=state.since_estimate + 1,
    )
    since_s = math.inf if seen is None else (measurement.t_ns - seen.t_ns) * 1e-9
    if since_s < config.estimate_s - EARLY_S or memory.fixes < 2:
        return state, None
    return _told(config, state)


def _told(config: Config, state: State) -> tuple[State, Estimate]:
    newest, memory, knowledge = state.newest, state.memory, state.knowledge
    assert newest is not None  # an estimate follows an accepted measurement
    assert memory is not None
    belief = Gaussian(*memory.bank.moments(2))
    nothing = unknown(config, float(belief.mean[1]))
    before = knowledge.aged(config, newest.t_ns, belief, nothing)
    if memory.braked:  # the bound alone: what is told of mu would be taken for this train's own, and told again
        before = before._replace(lower=max(before.lower, _informed(config, before, newest.t_ns, belief).lower))
    findings = found(config, memory, before, nothing)
    creeps = findings.regime is Regime.ADHESION_LIMITED and not memory.wheels.radii.is_learnt
    scale_mps = state.odometer.scale_error(memory.is_rolled, creeps) * float(belief.mean[1])
    told = Gaussian(belief.mean, belief.covariance + SPEED_ERROR + np.diag([0.0, scale_mps**2]))
    verdict = _verdict(memory, findings, told, memory.changes > knowledge.changes)
    knowledge = knowledge.after(newest.t_ns, verdict, findings.known)
    estimate = estimate_of(newest.t_ns, verdict, knowledge.changes, findings.ahead, memory.misled)
    memory = memory.having_told(findings.regime, findings.rail)
    return state._replace(memory=memory, knowledge=knowledge, since_estimate=0, seen=estimate), estimate


def _here(config: Config, state: State, t_ns: int, belief: Gaussian) -> Rail:
    """The rail as this train knows it, aged, and as earlier trains saw it here."""
    nothing = unknown(config, float(belief.mean[1]))
    return _informed(config, state.knowledge.aged(config, t_ns, belief, nothing), t_ns, belief)


def _informed(config: Config, rail: Rail, t_ns: int, belief: Gaussian) -> Rail:
    if config.rail_map is None:
        return rail
    way = Way(float(belief.mean[0]), float(belief.mean[1]), t_ns)
    return config.rail_map.informed(rail, way, config.speed_law, config.map_trust)


def _verdict(memory: Memory, findings: Findings, belief: Gaussian, changed: bool) -> Verdict:
    fit = Fit(
        window=memory.seen,
        iterations=int(memory.braked),
        log_likelihood=memory.log_likelihood,
        ess=float(1.0 / np.add.reduce(memory.bank.weight**2)),  # what np.sum calls
    )
    return Verdict(findings.regime, findings.rail, belief, None, fit=fit, changed=changed)


def last_banked(config: Config, state: State) -> tuple[State, tuple[Estimate, ...]]:
    """What is known at the end of the data, or of a time."""
    if state.memory is None or state.memory.fixes < 2 or not state.since_estimate:
        return state, ()
    with np.errstate(invalid="raise"):
        state, estimate = _told(config, state)
    return state, (estimate,)
