# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The estimators that the tables compare, each from a batch of simulated runs to rows against the truth."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core import Config, finish, init, step
from ..baselines.ekf import NAIVE, TUNED, EkfConfig, Tuning, ekf_init, ekf_step
from ..trial.runs import Simulated, rows_of
from .lockstep import Run, drive

STARTS = (0.0, 0.03, 0.05, 0.09, 0.12)
"""Adhesion from which the paper's runs start."""

PAPER = Config(method="particle_em", window=50, step=10, particles=20, iterations=50)
"""The paper's settings at the nominal noise, those of every method in the tables; `start_mu` is left to the lanes."""


class Lane(NamedTuple):
    """One run from one start."""

    seed: int
    start_mu: float
    simulated: Simulated


class Outcome(NamedTuple):
    """Rows of every lane, and how long the lanes took."""

    rows: list[NDArray[np.void]]
    seconds: float
    window_ms: list[float]
    """Time per window, all included: of each moment's windows together, or of each run."""


Method = Callable[[Config, Sequence[Lane]], Outcome]


def rail_condition(config: Config, lanes: Sequence[Lane]) -> Outcome:
    """The default method, run by run."""
    started, window_ms = time.perf_counter(), []
    rows = []
    for lane in lanes:
        begun = time.perf_counter()
        own = replace(config, method="rail_condition", start_mu=lane.start_mu)
        state, estimates = init(own, lane.seed), []
        for measurement in lane.simulated.measurements:
            state, estimate = step(own, state, measurement)
            estimates += [] if estimate is None else [estimate]
        estimates += finish(own, state)[1]
        rows.append(rows_of(own, lane.simulated.truth, estimates))
        window_ms.append(1e3 * (time.perf_counter() - begun) / max(len(rows[-1]), 1))
    return Outcome(rows, time.perf_counter() - started, window_ms)


def particle_em(config: Config, lanes: Sequence[Lane]) -> Outcome:
    """The paper's method, all lanes in lockstep."""
    started, ticks = time.perf_counter(), list[float]()
    runs = [
        Run(replace(config, method="particle_em", start_mu=lane.start_mu), lane.seed, lane.simulated.measurements)
        for lane in lanes
    ]
    estimates = drive(runs, ticks)
    rows = [rows_of(config, lane.simulated.truth, found) for lane, found in zip(lanes, estimates, strict=True)]
    return Outcome(rows, time.perf_counter() - started, ticks)


def ekf(tuning: Tuning) -> Method:
    """The extended Kalman filter with that tuning, run by run."""

    def run(config: Config, lanes: Sequence[Lane]) -> Outcome:
        started, window_ms = time.perf_counter(), []
        rows = []
        for lane in lanes:
            begun = time.perf_counter()
            own = EkfConfig(replace(config, start_mu=lane.start_mu), tuning)
            state, estimates = ekf_init(own, lane.seed), []
            for measurement in lane.simulated.measurements:
                state, estimate = ekf_step(own, state, measurement)
                estimates += [] if estimate is None else [estimate]
            rows.append(rows_of(config, lane.simulated.truth, estimates))
            window_ms.append(1e3 * (time.perf_counter() - begun) / max(len(estimates), 1))
        return Outcome(rows, time.perf_counter() - started, window_ms)

    return run


METHODS: Mapping[str, Method] = MappingProxyType(
    {"rail_condition": rail_condition, "particle_em": particle_em, "ekf_tuned": ekf(TUNED), "ekf_naive": ekf(NAIVE)}
)
"""By the name that stands in tables and JSON."""
