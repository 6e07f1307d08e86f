# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""`study sensitivity`: what the paper leaves out: the error against position noise, window, step, particles and seeds.

One setting at a time leaves the nominal ones (0.5 m, S = 50, L = 10, M = 20); scenario tunnel_entry, all starts, the
seeds of `study tables`. With another `seed_shift` the same measurements meet other random numbers of the estimator.
The tuned EKF stands beside where only the noise changes.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from ...command.options import DONE, report
from ..trial.accuracy import figures
from ..trial.running import add_running_options, running
from ..trial.runs import FIRST_SEED
from .methods import STARTS
from .montecarlo import Chunk, Result, results
from .published import START_OF_MEAN, TABLES

SCENARIO = "tunnel_entry"

VARIED: dict[str, tuple[int, ...] | tuple[float, ...]] = {
    "sigma_m": (0.05, 0.1, 0.5, 1.0, 2.0),
    "window": (25, 50, 100),
    "step": (5, 10, 20),
    "particles": (10, 20, 50),
    "seed_shift": (0, 100_000, 200_000, 300_000, 400_000),
}
"""Values of each setting, the nominal one among them."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study sensitivity`."""
    parser.add_argument("--runs", type=int, default=10, help="Monte-Carlo runs from each start (default %(default)s)")
    add_running_options(parser)


def variations(runs: int) -> Iterator[tuple[str, float, Chunk]]:
    """Setting, value and chunk of every line of the table."""
    for setting, values in VARIED.items():
        for method in ("particle_em", "ekf_tuned") if setting == "sigma_m" else ("particle_em",):
            for value in values:
                yield setting, value, _changed(Chunk(SCENARIO, method, 0.5, FIRST_SEED, runs), {setting: value})


def _changed(chunk: Chunk, change: dict[str, Any]) -> Chunk:
    """Change a field of the chunk or a setting of its estimator."""
    if change.keys() <= set(Chunk._fields):
        return chunk._replace(**change)
    return chunk._replace(config=replace(chunk.config, **change))


def run(options: argparse.Namespace) -> int:
    """Run what is missing and print a line per setting and value."""
    if options.runs < 1:
        raise ValueError(f"runs = {options.runs}: give at least 1")
    wanted = list(variations(options.runs))
    found = results([chunk for _, _, chunk in wanted], running(options))
    table = [_row(setting, value, result) for (setting, value, _), result in zip(wanted, found, strict=True)]
    report(options.json, table, "\n".join(_lines(table)))
    return DONE


def _row(setting: str, value: float, result: Result) -> dict[str, Any]:
    of_starts = [result.rows[start :: len(STARTS)] for start in range(len(STARTS))]
    return {"setting": setting, "value": value, "method": result.chunk.method, **figures(of_starts)}


def _lines(table: list[dict[str, Any]]) -> Iterator[str]:
    yield f"mean relative error of mu, %, {SCENARIO}, mean over {len(STARTS)} starts; spread over the runs"
    yield f"{'setting':>10} {'value':>6} {'method':>12} {'error':>6} {'std':>5}"
    for row in table:
        yield (
            f"{row['setting']:>10} {row['value']:6g} {row['method']:>12} {row['mean_relative_error_percent']:6.2f}"
            f" {row['std_relative_error_percent']:5.2f}"
        )
    paper = TABLES[SCENARIO][START_OF_MEAN].of("particle_em")[1]
    met = [
        row["value"]
        for row in table
        if (row["setting"], row["method"]) == ("sigma_m", "particle_em") and row["mean_relative_error_percent"] <= paper
    ]
    where = f"up to sigma = {max(met):g} m" if met else "at none of these noises"
    yield f"the paper's {paper:.2f} % is met {where}"
