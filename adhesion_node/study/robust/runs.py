# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The runs of `study robust` as tasks: a scenario, its sensors and an estimator's settings, some seeds at a time."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_node.train.plant import ADHESION_LIMITED, Truth
from sim_node.train.run import run
from sim_node.train.scenario import find
from sim_node.train.sensors import ATMOSPHERE_PA, Reading, SensorSettings

from ...core import Config, Regime
from ...core.intake.inbox import PositionSample, PressureSample, Sample, WheelSample
from ...run.pipeline import Pipeline
from ...run.score import CONVERGED_AFTER_MPS
from ..trial.runs import PERIOD_S
from ..trial.tasks import EVERY_SOURCE, Arrays

ROW = np.dtype(
    [
        ("run", np.int64),
        *((name, np.float64) for name in ("t_s", "true_mu", "mu", "std", "lower")),
        *((name, np.bool_) for name in ("limited", "scored", "claimed")),
        ("changes", np.int64),
    ]
)
"""An estimate under the brake: whether adhesion truly limits, whether it counts for the mean error, whether the
estimate claims that adhesion limits; changes of the rail found so far in the run."""


class Case(NamedTuple):
    """A line of the table."""

    name: str
    scenario: str
    sensors: SensorSettings = SensorSettings()
    config: Config = Config()
    knows_track: bool = True


class Runs(NamedTuple):
    """Some seeds of a case."""

    case: Case
    first_seed: int
    seeds: int

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"robust-{self.case.scenario}-{self.first_seed}"

    @property
    def weight(self) -> float:
        """How much work it is."""
        return self.seeds * (10.0 if self.case.config.method == "particle_em" else 1.0)

    @property
    def sources(self) -> tuple[str, ...]:
        """Where its numbers come from."""
        return EVERY_SOURCE

    def compute(self) -> Arrays:
        """Simulate and estimate every run."""
        rows = [one(self.case, seed) for seed in range(self.first_seed, self.first_seed + self.seeds)]
        return {"rows": np.concatenate(rows)}


def one(case: Case, seed: int) -> NDArray[np.void]:
    """Simulate one run and hold its estimates against the truth, an array of `ROW`."""
    scenario = find(case.scenario)
    config = replace(case.config, track=scenario.track) if case.knows_track else case.config
    pipeline, truths, rows = Pipeline(config, seed), dict[int, Truth](), list[tuple[float, ...]]()
    braked_from = None
    for truth, reading in run(scenario, PERIOD_S, seed, case.sensors):
        truths[truth.t_ns] = truth
        if braked_from is None and truth.pressure_pa > 0.0:
            braked_from = truth.speed_mps
        for sample in samples(reading, case.sensors.position_std_m):
            for prediction in pipeline.push(sample):
                estimate = prediction.estimate
                true = truths[estimate.t_ns]
                if true.pressure_pa > 0.0 and braked_from is not None:
                    limited = true.regime == ADHESION_LIMITED
                    late = true.speed_mps < braked_from - CONVERGED_AFTER_MPS
                    rows.append(
                        (
                            *(seed, estimate.t_ns * 1e-9, true.mu, estimate.mu, estimate.mu_std, estimate.mu_lower),
                            *(limited, limited and late, estimate.regime is Regime.ADHESION_LIMITED),
                            estimate.changes,
                        )
                    )
    return np.array(rows, dtype=ROW)


def samples(reading: Reading, sigma_m: float) -> list[Sample]:
    """What the estimator is told of a reading."""
    told: list[Sample] = [PressureSample(reading.t_ns, max(reading.pressure_pa - ATMOSPHERE_PA, 0.0))]
    if reading.wheel_radps is not None:
        told.append(WheelSample(reading.t_ns, reading.wheel_radps))
    if reading.position_m is not None:
        told.append(PositionSample(reading.t_ns, reading.position_m, sigma_m**2))
    return told
