"""`study tune-ekf`: the search behind the tuned EKF of the tables: a grid over its two standard deviations.

Every pair runs through both scenarios from all starts, on the simulator seeds 5000, 5001, ... that no table uses;
the pair with the least mean relative error wins.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from ..cli import DONE, progress, report
from ..core import Config
from ..core.ekf import TUNED, Tuning
from .accuracy import errors
from .methods import STARTS, Lane, ekf
from .published import TABLES
from .runs import simulate

FIRST_SEED = 5000

MU_STDS = (0.003, 0.005, 0.01, 0.02, 0.03, 0.05)
MU_NOISES = (2e-4, 3e-4, 4e-4, 5e-4, 6e-4, 8e-4, 1e-3, 2e-3)

SIGMA_M = 0.5


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study tune-ekf`."""
    parser.add_argument("--runs", type=int, default=10, help="runs of each scenario and start (default %(default)s)")


def run(options: argparse.Namespace) -> int:
    """Search the grid and print it, best first."""
    if options.runs < 1:
        raise ValueError(f"runs = {options.runs}: give at least 1")
    tasks = [(mu_std, mu_noise, options.runs) for mu_std, mu_noise in product(MU_STDS, MU_NOISES)]
    with multiprocessing.get_context("spawn").Pool(min(os.cpu_count() or 1, len(tasks))) as pool:
        table = sorted(
            progress(pool.imap_unordered(_score, tasks), "tunings", len(tasks)),
            key=lambda row: float(row["mean_relative_error_percent"]),
        )
    lines = [f"{'mu_std':>8} {'mu_noise':>9} {'error, %':>9}"]
    lines += [
        f"{row['mu_std']:8g} {row['mu_noise']:9g} {row['mean_relative_error_percent']:9.3f}"
        + ("  in use" if Tuning(row["mu_std"], row["mu_noise"]) == TUNED else "")
        for row in table
    ]
    report(options.json, table, "\n".join(lines))
    return DONE


def _score(task: tuple[float, float, int]) -> dict[str, Any]:
    mu_std, mu_noise, runs = task
    found = errors(ekf(Tuning(mu_std, mu_noise))(Config(), _lanes(runs)).rows)
    error = float(np.mean(found.relative_percent))
    return {"mu_std": mu_std, "mu_noise": mu_noise, "runs": runs, "mean_relative_error_percent": error}


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
