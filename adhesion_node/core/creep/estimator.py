# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Identification of the creep curve, sample by sample, live and offline: `init` and `creep_step`, He et al. 2017.

Every accepted sample updates the sums (12) with the forgetting factor (13); every `every` of them give an estimate
of the peak with its spread, or the reason why the data cannot tell it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from ..physics.train import Array
from . import fit as creep_fit
from .config import CreepConfig, CreepOutcome, Peak
from .curve import noise_products, peak
from .recursion import Recursion, advance, begin, full_covariance, is_changing, judge


class CreepSample(NamedTuple):
    """Creep and adhesion in use at a time."""

    t_ns: int
    creep: float
    adhesion: float
    creep_var: float = 0.0
    adhesion_var: float = 0.0
    """Variances of their noise, the bias of which is taken off; 0 is the paper's plain least squares."""


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


@dataclass(frozen=True, slots=True)
class CreepState:
    """Everything the identification remembers. Immutable: `creep_step` returns a new one."""

    recursion: Recursion
    counts: Mapping[CreepOutcome, int] = field(default_factory=lambda: MappingProxyType(dict.fromkeys(CreepOutcome, 0)))
    outcome: CreepOutcome = CreepOutcome.ACCEPTED
    """What became of the sample that came last."""
    newest_ns: int | None = None
    since_estimate: int = 0


def init(config: CreepConfig) -> CreepState:
    """State before the first sample."""
    return CreepState(begin(config))


def creep_step(config: CreepConfig, state: CreepState, sample: CreepSample) -> tuple[CreepState, CreepEstimate | None]:
    """Take one sample; every `config.every` accepted ones return an estimate."""
    if not (math.isfinite(sample.creep) and math.isfinite(sample.adhesion)) or abs(sample.creep) > config.max_creep:
        return _counted(state, CreepOutcome.INVALID), None
    if state.newest_ns is not None and sample.t_ns <= state.newest_ns:
        if state.newest_ns - sample.t_ns <= config.reset_s * 1e9:
            same = sample.t_ns == state.newest_ns
            return _counted(state, CreepOutcome.DUPLICATE if same else CreepOutcome.LATE), None
        state = _counted(CreepState(begin(config), counts=state.counts), CreepOutcome.RESET)
    state = replace(state, newest_ns=sample.t_ns)
    if sample.creep < config.min_creep:
        return _counted(state, CreepOutcome.IDLE), None
    state = _accept(config, state, *(np.asarray(value) for value in sample[1:]))
    if state.since_estimate < config.every:
        return state, None
    return replace(state, since_estimate=0), _estimate(config, state, sample.t_ns)


def _accept(
    config: CreepConfig, state: CreepState, creep: Array, adhesions: Array, creep_var: Array, adhesion_var: Array
) -> CreepState:
    """Let an accepted sample into the sums; begin anew with it where it shows that the surface has changed."""
    noise = noise_products(creep, adhesions, config.slope, creep_var, adhesion_var)
    recursion = advance(config, state.recursion, creep, adhesions, noise)
    if config.restart and recursion.sums.weight >= config.min_samples and is_changing(config, recursion):
        state = _counted(state, CreepOutcome.CHANGED)
        recursion = advance(config, begin(config), creep, adhesions, noise)
    return replace(_counted(state, CreepOutcome.ACCEPTED), recursion=recursion, since_estimate=state.since_estimate + 1)


def _estimate(config: CreepConfig, state: CreepState, t_ns: int) -> CreepEstimate:
    recursion = state.recursion
    theta = recursion.theta
    mu_max, lambda_m = (float(value) for value in peak(config.slope, theta))
    spread = creep_fit.covariance(recursion.sums, theta)
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
        samples=state.counts[CreepOutcome.ACCEPTED],
        status=judge(config, recursion, stds[2] / mu_max),
    )


def _stds(slope: float, theta: Array, spread: Array) -> tuple[float, float, float, float]:
    """Standard deviations of p1, p2, mu_max and lambda_m."""
    if not (np.isfinite(spread).all() and (theta > 0.0).all()):
        return math.inf, math.inf, math.inf, math.inf
    p1, p2, mu_max, lambda_m = np.sqrt(np.diagonal(full_covariance(slope, theta, spread))).tolist()
    return p1, p2, mu_max, lambda_m


def _counted(state: CreepState, outcome: CreepOutcome) -> CreepState:
    counts = MappingProxyType({**state.counts, outcome: state.counts[outcome] + 1})
    return replace(state, counts=counts, outcome=outcome)
