# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study tables`: Tables 2 and 3 of Xie et al. 2019 by Monte-Carlo runs, beside a tuned and a naive EKF.

Paper's settings (M = 20, 50 iterations, S = 50, L = 10) at the nominal noise; run r has seed 1000 + r. The error is
the mean of abs(mu - true mu) over all estimates while adhesion limits, after the first 30 km/h. `converged_kmh` is
the speed at which the error, averaged over the runs, first falls below 5 %; `coverage95` the share of estimates within
1.96 of their own standard deviations; `bound_ratio` the mean relative error over that of an estimator at the bound of
`study bound`. The estimators know the track. `seconds` is the computing time of the scenario's runs from all starts
in one process, `ms_per_window` that of a window with the measurements between two.
"""

import argparse
import hashlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.lib.recfunctions import repack_fields

from ...command.running import add_running_options, running
from ..bound.nominal import Case, nominal
from ..trial.figures import add_figure_options, figures_of
from ..trial.score import over_speed, score
from ..trial.text import Column, lines
from ..trial.trials import Results, grouped
from .methods import METHODS, NOMINAL_SIGMA_M, STARTS, trials
from .published import START_OF_MEAN, TABLES

Cell = tuple[str, str]
"""Scenario and method."""

DIGESTED = ["t_ns", "true_speed_mps", "true_mu", "mu", "std", "lower", "limited", "scored"]
"""What the digest of a cell holds of every estimate, start by start."""

SPEED_STEP_KMH = 20
"""Width of the speed classes in the printed error over speed."""

COLUMNS = (
    Column("scenario", 13, "", "scenario"),
    Column("method", 14, "", "method"),
    Column("start", 6, "", "start_mu"),
    Column("ours", 6, ".2f", "mean_relative_error_percent"),
    Column("paper", 6, ".2f", "paper_mean_relative_error_percent"),
    Column("std", 5, ".2f", "std_relative_error_percent"),
    Column("5 %", 6, ".2f", "p5_relative_error_percent"),
    Column("95 %", 6, ".2f", "p95_relative_error_percent"),
    Column("abs", 7, ".4f", "mean_abs_error"),
    Column("converged", 9, ".0f", "converged_kmh"),
    Column("cover", 6, ".3f", "coverage95"),
    Column("bound", 6, ".3f", "lower_bound_holds"),
    Column("ratio", 6, ".2f", "bound_ratio"),
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study tables`."""
    parser.add_argument("--runs", type=int, default=200, help="Monte-Carlo runs from each start")
    add_running_options(parser)
    add_figure_options(parser, "Figs. 4-9 and 14-19")


def run(options: argparse.Namespace) -> tuple[list[dict[str, Any]], str]:
    """Run what is missing, return the tables, draw the figures."""
    figures = figures_of(options)
    wanted = [
        ((scenario, method), trials(scenario, estimator, options.runs))
        for method, estimator in METHODS.items()
        for scenario in TABLES
    ]
    cells = grouped(wanted, running(options))
    table = [row for cell, found in cells.items() for row in rows(cell, found)]
    if figures is not None:
        from .figures import draw_estimates

        draw_estimates(cells, figures)
    text = ["mean relative error of mu, %, beside the paper's (its EKF beside ours); spread over the runs"]
    text += [*lines(COLUMNS, table), "", *_speed_lines(cells), "", *_digest_lines(table)]
    return table, "\n".join(text)


def rows(cell: Cell, found: Results) -> Iterator[dict[str, Any]]:
    """A row per start, and the mean over the starts."""
    scenario, method = cell
    least = nominal(Case(scenario, NOMINAL_SIGMA_M)).mean_error_percent
    of_starts: dict[float | str, Results] = {start: found.of_start(start) for start in STARTS}
    of_starts[START_OF_MEAN] = found
    common = {
        "seconds": float(found.seconds.sum()),
        "ms_per_window_p50": float(np.percentile(found.window_ms, 50)),
        "ms_per_window_p99": float(np.percentile(found.window_ms, 99)),
        "digest": digest(found),
    }
    for start, some in of_starts.items():
        paper_abs, paper_relative = TABLES[scenario][start].of(method)
        of_some = score(some)
        yield {
            "scenario": scenario,
            "method": method,
            "sigma_m": NOMINAL_SIGMA_M,
            "start_mu": start,
            **of_some,
            "lower_bound_holds": of_some["lower_bound_holds_scored"],
            "bound_ratio": of_some["mean_relative_error_percent"] / least,
            "paper_mean_abs_error": paper_abs,
            "paper_mean_relative_error_percent": paper_relative,
            **common,
        }


def digest(found: Results) -> str:
    """SHA-256 over every estimate, the same wherever the runs were computed."""
    by_start = found.rows[np.argsort(found.rows["start"], kind="stable")]
    return hashlib.sha256(repack_fields(by_start[DIGESTED]).tobytes()).hexdigest()


def _speed_lines(cells: Mapping[Cell, Results]) -> Iterator[str]:
    yield "mean relative error over speed, %, all starts"
    for (scenario, method), found in cells.items():
        curve = over_speed(found)
        classes = np.ceil(curve.speed_kmh / SPEED_STEP_KMH).astype(int) * SPEED_STEP_KMH
        means = (
            f"{top}: {curve.relative_error_percent[classes == top].mean():.1f}" for top in np.unique(classes)[::-1]
        )
        yield f"{scenario:>13} {method:>14}  below km/h  {'  '.join(means)}"


def _digest_lines(table: list[dict[str, Any]]) -> Iterator[str]:
    yield "digest of every estimate, all starts"
    for row in table[:: len(STARTS) + 1]:
        yield f"{row['scenario']:>13} {row['method']:>14}  {row['digest']}"
