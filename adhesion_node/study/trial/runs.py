# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Simulated runs for the studies, and what of an estimate goes into a table."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_node.train.run import run
from sim_node.train.scenario import find
from sim_node.train.sensors import ATMOSPHERE_PA, SensorSettings

from ...core import Config, Estimate, Measurement
from ...run.score import Truth

PERIOD_S = 0.1
"""Of every published figure."""

FIRST_SEED = 1000
"""Run r of a table has simulator and estimator seed FIRST_SEED + r."""


class Simulated(NamedTuple):
    """The truth of a run and its measurements."""

    truth: Truth
    measurements: tuple[Measurement, ...]


ROW = np.dtype(
    [
        ("t_ns", np.int64),
        *((name, np.float64) for name in ("speed_mps", "true_mu", "mu", "std", "lower")),
        ("limited", np.bool_),
        ("scored", np.bool_),
    ]
)
"""An estimate against the truth: true speed and adhesion, estimated adhesion; whether adhesion limits, and whether
it counts for the mean error of `score`."""


@lru_cache(maxsize=10)  # a small study takes the same few runs with every method
def simulate(scenario: str, seed: int, sigma_m: float) -> Simulated:
    """Simulate a run whose positions have standard deviation `sigma_m`."""
    truth, measurements = Truth(), []
    for true, reading in run(find(scenario), PERIOD_S, seed, SensorSettings(position_std_m=sigma_m)):
        pressure = reading.pressure_pa - ATMOSPHERE_PA
        truth.mu[true.t_ns], truth.speed_mps[true.t_ns] = true.mu, true.speed_mps
        truth.pressure_pa[true.t_ns] = pressure
        if reading.position_m is not None:
            measurements.append(Measurement(true.t_ns, reading.position_m, sigma_m**2, pressure))
    return Simulated(truth, tuple(measurements))


def rows_of(config: Config, truth: Truth, estimates: Sequence[Estimate]) -> NDArray[np.void]:
    """Estimates under the brake as an array of `ROW`."""
    slow_enough = truth.converged_speed(config)
    rows = [
        (e.t_ns, speed, truth.mu[e.t_ns], e.mu, e.mu_std, e.mu_lower, limited, limited and speed < slow_enough)
        for e in estimates
        if config.brake(truth.pressure_pa[e.t_ns]) > 0.0
        for speed, limited in ((truth.speed_mps[e.t_ns], truth.limits(config, e.t_ns)),)
    ]
    return np.array(rows, dtype=ROW)
