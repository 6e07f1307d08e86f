# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Identification of the creep curve, sample by sample, live and offline: `init`, `advance`, `finish`, He et al. 2017.

Every accepted sample updates the sums (12) with the forgetting factor (13); every `every` of them give an estimate
of the peak with its spread, or the reason why the data cannot tell it.
"""

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from ..intake import inbox as gate
from ..intake.outcome import ACCEPTED, NO_COUNTS, Event, Outcome, counted
from ..intake.pairing import Gate, Inbox, Matched, S, Source
from ..intake.samples import ForceSample, Sample, SpeedSample, WheelSample
from ..physics.train import Array
from . import fit
from .config import CreepConfig, Peak
from .curve import noise_products, peak
from .recursion import Recursion, begin, full_covariance, is_changing, judge
from .recursion import advance as advanced
from .vehicle import CreepSample

FAR_NS = 2 * S
"""A stamp further ahead of all others is set aside until a second one agrees."""

LATE_RUN = 20
"""So many late wheel speeds in a row show that the time has gone back."""


class CreepEstimate(NamedTuple):
    """What is known of the curve at `t_ns`. The peak stands there also while `status` withholds it."""

    t_ns: int
    p1: float
    p2: float
    mu_max: float
    lambda_m: float
    p1_std: float
    p2_std: float
    mu_max_std: float
    """Infinite while the data span only one direction; as are the other three."""
    lambda_m_std: float
    mu_max_lower: float
    mu_max_upper: float
    """One-sided bounds of mu_max at the configured confidence."""
    eta: float
    remembered: float
    """Samples that the sums are worth."""
    samples: int
    """Samples accepted in all."""
    status: Peak

    @property
    def known(self) -> bool:
        """Whether the peak may be used."""
        return self.status is Peak.KNOWN


class CreepState(NamedTuple):
    """Everything the identification remembers. Immutable: `advance` returns a new one."""

    gate: Gate
    recursion: Recursion
    counts: Mapping[Outcome, int] = NO_COUNTS
    events: tuple[Event, ...] = ()
    """What the sample that came last brought about, other than that it was accepted."""
    inbox: Inbox = Inbox()
    since_estimate: int = 0


def init(config: CreepConfig) -> CreepState:
    """State before the first sample."""
    return CreepState(gate_of(config), begin(config))


def gate_of(config: CreepConfig) -> Gate:
    """How the sensors are paired."""
    wait, age = round(config.vehicle.pairing_wait_s * 1e9), round(config.vehicle.pairing_age_s * 1e9)
    return Gate(
        anchor=WheelSample,
        sources=(Source(SpeedSample, wait, age), Source(ForceSample, wait, age)),
        max_lag_ns=0,
        far_ns=FAR_NS,
        reset_ns=round(config.reset_s * 1e9),
        late_run=LATE_RUN,
    )


def advance(config: CreepConfig, state: CreepState, sample: Sample) -> tuple[CreepState, tuple[CreepEstimate, ...]]:
    """Take one sample of any sensor; every `config.every` accepted creeps give an estimate."""
    state = state._replace(events=())
    if not sample.is_valid():
        return _told(state, Event(Outcome.INVALID, repr(sample))), ()
    return _passed(config, state, gate.push(state.gate, state.inbox, sample))


def settle(config: CreepConfig, state: CreepState) -> tuple[CreepState, tuple[CreepEstimate, ...]]:
    """Silence: what waits for others of its time waits no longer."""
    return _passed(config, state._replace(events=()), gate.settle(state.gate, state.inbox))


def finish(config: CreepConfig, state: CreepState) -> tuple[CreepState, tuple[CreepEstimate, ...]]:
    """End of the data: take what still waits."""
    return _passed(config, state._replace(events=()), gate.drain(state.gate, state.inbox))


def _passed(
    config: CreepConfig, state: CreepState, pushed: gate.Pushed
) -> tuple[CreepState, tuple[CreepEstimate, ...]]:
    """Use what the gate has let through."""
    state, before = _take_all(config, state, pushed.ended)
    if any(event.outcome is Outcome.RESET for event in pushed.events):
        state = state._replace(recursion=begin(config), since_estimate=0)
    state = _told(state._replace(inbox=pushed.inbox), *pushed.events)
    state, estimates = _take_all(config, state, pushed.matched)
    return state, before + estimates


def _take_all(
    config: CreepConfig, state: CreepState, matched: Iterable[Matched]
) -> tuple[CreepState, tuple[CreepEstimate, ...]]:
    estimates = []
    for wheels, (speed, force) in matched:
        if speed is None or force is None:
            state = _told(state, Event(Outcome.UNPAIRED, f"wheel speed of {wheels.t_ns / 1e9:.12g} s"))
            continue
        formed = config.vehicle.sample(wheels.t_ns, wheels.speeds_radps, speed.speed_mps, force.force_n)
        if isinstance(formed, Event):
            state = _told(state, formed)
            continue
        state, estimate = creep_step(config, state, formed)
        estimates += [] if estimate is None else [estimate]
    return state, tuple(estimates)


def creep_step(config: CreepConfig, state: CreepState, sample: CreepSample) -> tuple[CreepState, CreepEstimate | None]:
    """Take the next creep in time; every `config.every` accepted ones return an estimate."""
    if not (math.isfinite(sample.creep) and math.isfinite(sample.adhesion)) or abs(sample.creep) > config.max_creep:
        return _told(state, Event(Outcome.INVALID, repr(sample))), None
    if sample.creep < config.min_creep:
        return _told(state, Event(Outcome.IDLE)), None
    state = _accept(config, state, *(np.asarray(value) for value in sample[1:]))
    if state.since_estimate < config.every:
        return state, None
    return state._replace(since_estimate=0), _estimate(config, state, sample.t_ns)


def _told(state: CreepState, *events: Event) -> CreepState:
    return state._replace(counts=counted(state.counts, *events), events=state.events + events)


def _accept(
    config: CreepConfig, state: CreepState, creep: Array, adhesions: Array, creep_var: Array, adhesion_var: Array
) -> CreepState:
    """Let an accepted sample into the sums; begin anew with it where it shows that the surface has changed."""
    noise = noise_products(creep, adhesions, config.slope, creep_var, adhesion_var)
    recursion = advanced(config, state.recursion, creep, adhesions, noise)
    if config.restart and recursion.sums.weight >= config.min_samples and is_changing(config, recursion):
        state = _told(state, Event(Outcome.CHANGED))
        recursion = advanced(config, begin(config), creep, adhesions, noise)
    counts = counted(state.counts, ACCEPTED)
    return state._replace(counts=counts, recursion=recursion, since_estimate=state.since_estimate + 1)


def _estimate(config: CreepConfig, state: CreepState, t_ns: int) -> CreepEstimate:
    recursion = state.recursion
    theta = recursion.theta
    mu_max, lambda_m = (float(value) for value in peak(config.slope, theta))
    spread = fit.covariance(recursion.sums, theta)
    stds = _stds(config.slope, theta, spread)
    margin = float(ndtri(config.confidence)) * stds[2]
    return CreepEstimate(
        t_ns,
        float(theta[0]),
        float(theta[1]),
        mu_max,
        lambda_m,
        *stds,
        mu_max_lower=max(mu_max - margin, 0.0),
        mu_max_upper=mu_max + margin,
        eta=float(recursion.eta),
        remembered=float(recursion.sums.weight),
        samples=state.counts[Outcome.ACCEPTED],
        status=judge(config, recursion, stds[2] / mu_max),
    )


def _stds(slope: float, theta: Array, spread: Array) -> tuple[float, float, float, float]:
    """Standard deviations of p1, p2, mu_max and lambda_m."""
    if not (np.isfinite(spread).all() and (theta > 0.0).all()):
        return math.inf, math.inf, math.inf, math.inf
    p1, p2, mu_max, lambda_m = np.sqrt(np.diagonal(full_covariance(slope, theta, spread))).tolist()
    return p1, p2, mu_max, lambda_m
