# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""`study tune-ekf`: the search behind the tuned EKF of the tables: a grid over its two standard deviations.

Every pair runs through both scenarios from all starts, on the simulator seeds 5000, 5001, ... that no table uses;
the pair with the least mean relative error wins.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np

from ...command.options import DONE, report
from ..trial.accuracy import errors
from ..trial.running import add_running_options, run_all, running
from ..trial.runs import simulate
from ..trial.tasks import EVERY_SOURCE, Arrays
from ..xie.methods import PAPER, STARTS, Lane, ekf
from ..xie.published import TABLES
from .ekf import TUNED, Tuning

FIRST_SEED = 5000

MU_STDS = (0.003, 0.005, 0.01, 0.02, 0.03, 0.05)
MU_NOISES = (2e-4, 3e-4, 4e-4, 5e-4, 6e-4, 8e-4, 1e-3, 2e-3)

SIGMA_M = 0.5


class Trial(NamedTuple):
    """A tuning on runs of both scenarios from all starts."""

    tuning: Tuning
    runs: int

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return "tune-ekf"

    @property
    def weight(self) -> float:
        """All are alike."""
        return 1.0

    @property
    def sources(self) -> tuple[str, ...]:
        """Where its numbers come from."""
        return EVERY_SOURCE

    def compute(self) -> Arrays:
        """Mean relative error, %."""
        found = errors(ekf(self.tuning)(PAPER, _lanes(self.runs)).rows)
        return {"percent": np.array(np.mean(found.relative_percent))}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study tune-ekf`."""
    parser.add_argument("--runs", type=int, default=10, help="runs of each scenario and start (default %(default)s)")
    add_running_options(parser)


def run(options: argparse.Namespace) -> int:
    """Search the grid and print it, best first."""
    if options.runs < 1:
        raise ValueError(f"runs = {options.runs}: give at least 1")
    trials = [Trial(Tuning(*values), options.runs) for values in product(MU_STDS, MU_NOISES)]
    percents = [float(result["percent"]) for result in run_all(trials, running(options))]
    table = [
        {**asdict(trial.tuning), "runs": trial.runs, "mean_relative_error_percent": percent}
        for percent, trial in sorted(zip(percents, trials, strict=True), key=lambda pair: pair[0])
    ]
    lines = [f"{'mu_std':>8} {'mu_noise':>9} {'error, %':>9}"]
    lines += [
        f"{row['mu_std']:8g} {row['mu_noise']:9g} {row['mean_relative_error_percent']:9.3f}"
        + ("  in use" if Tuning(row["mu_std"], row["mu_noise"]) == TUNED else "")
        for row in table
    ]
    report(options.json, table, "\n".join(lines))
    return DONE


@cache
def _lanes(runs: int) -> list[Lane]:
    """The same for every tuning, so a process simulates them once."""
    return [
        Lane(seed, start, simulated)
        for scenario in TABLES
        for seed in range(FIRST_SEED, FIRST_SEED + runs)
        for simulated in (simulate(scenario, seed, SIGMA_M),)
        for start in STARTS
    ]
