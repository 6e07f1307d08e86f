# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""`study tables`: Tables 2 and 3 of Xie et al. 2019 by Monte-Carlo runs, beside a tuned and a naive EKF.

Paper's settings (M = 20, 50 iterations, S = 50, L = 10) at the nominal noise; run r has seed 1000 + r. The error is
the mean of abs(mu - true mu) over all estimates while adhesion limits, after the first 30 km/h. `converged_kmh` is
the speed at which the error, averaged over the runs, first falls below 5 %; `coverage95` the share of estimates within
1.96 of their own standard deviations; `bound_ratio` the mean relative error over that of an estimator at the bound of
`study bound`. The estimators know the track. `seconds` is the computing time of the scenario's runs from all starts
in one process, `ms_per_window` that of a window among the others of its batch.
"""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...command.options import DONE, report
from ..bound.study import Case, nominal
from ..trial.accuracy import figures, over_speed
from ..trial.running import Running, add_running_options, running
from .methods import METHODS, STARTS
from .montecarlo import Chunk, Result, chunks, results
from .published import START_OF_MEAN, TABLES

NOMINAL_SIGMA_M = 0.5

SPEED_STEP_KMH = 20
"""Width of the speed classes in the printed error over speed."""


class Cell(NamedTuple):
    """All runs of a scenario with one method."""

    scenario: str
    method: str
    sigma_m: float
    runs: list[list[NDArray[np.void]]]
    """`runs[start][run]`."""
    seconds: float
    window_ms: NDArray[np.float64]

    @property
    def digest(self) -> str:
        """SHA-256 over every estimate, the same wherever the runs were computed."""
        return hashlib.sha256(b"".join(rows.tobytes() for of_start in self.runs for rows in of_start)).hexdigest()


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study tables`."""
    parser.add_argument("--runs", type=int, default=200, help="Monte-Carlo runs from each start (default %(default)s)")
    add_running_options(parser)
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw Figs. 4-9 and 14-19 into DIR")


def cells(wanted: Sequence[Chunk], where: Running) -> list[Cell]:
    """Run the chunks and put together those that differ in their seeds only."""
    by_cell: dict[tuple[str, str, float], list[Result]] = {}
    for result in results(wanted, where):
        by_cell.setdefault((result.chunk.scenario, result.chunk.method, result.chunk.sigma_m), []).append(result)
    return [
        Cell(
            *key,
            [[rows for result in some for rows in result.rows[start :: len(STARTS)]] for start in range(len(STARTS))],
            sum(result.seconds for result in some),
            np.concatenate([result.window_ms for result in some]),
        )
        for key, some in by_cell.items()
    ]


def rows(cell: Cell) -> Iterator[dict[str, Any]]:
    """A row per start, and the mean over the starts."""
    least = nominal(Case(cell.scenario, cell.sigma_m)).mean_error_percent
    of_starts: list[tuple[float | str, list[list[NDArray[np.void]]]]] = [
        (start, [runs]) for start, runs in zip(STARTS, cell.runs, strict=True)
    ]
    digest = cell.digest
    for start, runs in [*of_starts, (START_OF_MEAN, cell.runs)]:
        paper_abs, paper_relative = TABLES[cell.scenario][start].of(cell.method)
        found = figures(runs)
        yield {
            "scenario": cell.scenario,
            "method": cell.method,
            "sigma_m": cell.sigma_m,
            "start_mu": start,
            **found,
            "bound_ratio": found["mean_relative_error_percent"] / least,
            "paper_mean_abs_error": paper_abs,
            "paper_mean_relative_error_percent": paper_relative,
            "seconds": cell.seconds,
            "ms_per_window_p50": float(np.percentile(cell.window_ms, 50)),
            "ms_per_window_p99": float(np.percentile(cell.window_ms, 99)),
            "digest": digest,
        }


def run(options: argparse.Namespace) -> int:
    """Run what is missing, print the tables, draw the figures."""
    if options.runs < 1:
        raise ValueError(f"runs = {options.runs}: give at least 1")
    wanted = [
        chunk
        for method in METHODS
        for scenario in TABLES
        for chunk in chunks(scenario, method, NOMINAL_SIGMA_M, options.runs)
    ]
    found = cells(wanted, running(options))
    table = [row for cell in found for row in rows(cell)]
    if options.figures:
        from .curves import draw_all

        draw_all(found, options.figures)
    report(options.json, table, "\n".join([*_table_lines(table), "", *_speed_lines(found), "", *_digest_lines(found)]))
    return DONE


def _table_lines(table: Sequence[dict[str, Any]]) -> Iterator[str]:
    yield "mean relative error of mu, %, beside the paper's (its EKF beside ours); spread over the runs"
    yield (
        f"{'scenario':>13} {'method':>12} {'start':>6} {'ours':>6} {'paper':>6} {'std':>5} {'5 %':>6} {'95 %':>6}"
        f" {'abs':>7} {'converged':>9} {'cover':>6} {'bound':>6} {'ratio':>6}"
    )
    for row in table:
        reached = "-" if row["converged_kmh"] is None else f"{row['converged_kmh']:.0f} km/h"
        yield (
            f"{row['scenario']:>13} {row['method']:>12} {row['start_mu']:>6} {row['mean_relative_error_percent']:6.2f}"
            f" {row['paper_mean_relative_error_percent']:6.2f} {row['std_relative_error_percent']:5.2f}"
            f" {row['p5_relative_error_percent']:6.2f} {row['p95_relative_error_percent']:6.2f}"
            f" {row['mean_abs_error']:7.4f} {reached:>9} {row['coverage95']:6.3f} {row['lower_bound_holds']:6.3f}"
            f" {row['bound_ratio']:6.2f}"
        )


def _speed_lines(found: Sequence[Cell]) -> Iterator[str]:
    yield "mean relative error over speed, %, all starts"
    for cell in found:
        curve = over_speed([rows for of_start in cell.runs for rows in of_start])
        classes = np.ceil(curve.speed_kmh / SPEED_STEP_KMH).astype(int) * SPEED_STEP_KMH
        means = (
            f"{top}: {curve.relative_error_percent[classes == top].mean():.1f}" for top in np.unique(classes)[::-1]
        )
        yield f"{cell.scenario:>13} {cell.method:>12}  below km/h  {'  '.join(means)}"


def _digest_lines(found: Sequence[Cell]) -> Iterator[str]:
    yield "digest of every estimate, all starts"
    for cell in found:
        yield f"{cell.scenario:>13} {cell.method:>12}  {cell.digest}"
