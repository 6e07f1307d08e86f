# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study robust`: the method `rail_condition` where rail, sensors or train are not what it believes, and under faults.

Every figure of the first table stands beside that of tunnel_entry without a fault. *Bound*: estimates under the brake
whose lower bound is not above the true adhesion; *claimed*: those that claim to observe the adhesion although the
brake limits. The rail changes in low_adhesion_patch only: *found* after, and error again below 10 % after, the fall
and the rise. The second table, from the beginning of each fault on: *B* is the same run without it; *cover*: of the
90 % interval; *safe curve*: safe braking curves that are not shorter than the true distance to a standstill; *to B*:
largest difference after a full window; *rail*: changes of the rail told in all runs, of which none is true; *again*:
longest time from the end of the fault to a full window.
"""

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from ...command.running import add_running_options, running
from ..trial.figures import Figures, add_figure_options, figures_of
from ..trial.text import lines
from . import faults, rails

TABLES = {"rails": rails, "faults": faults}
"""By name."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study robust`."""
    parser.add_argument("--runs", type=int, default=40, help="runs of each case")
    parser.add_argument("--only", choices=TABLES, help="one of the tables")
    add_running_options(parser)
    add_figure_options(parser, "errors and bounds of all cases")


def run(options: argparse.Namespace) -> tuple[list[dict[str, Any]], str]:
    """Run what is missing and return a line per case."""
    figures = figures_of(options)
    names = [options.only] if options.only else list(TABLES)
    tables = {name: TABLES[name].rows(options.runs, running(options)) for name in names}
    if figures is not None:
        for name, table in tables.items():
            _draw(name, table, figures)
    texts = ["\n".join(lines(TABLES[name].COLUMNS, table)) for name, table in tables.items()]
    return [row for table in tables.values() for row in table], "\n\n".join(texts)


def _draw(name: str, table: Sequence[Mapping[str, Any]], figures: Figures) -> None:
    """Draw a table: error with its spread, and how often the bound was kept."""
    from ..trial.drawing import draw_cases

    names, runs = [row["case"] for row in table], max(row["runs"] for row in table)
    title = f"Rail condition, where something is not as believed; N = {runs} runs of each case, fewer of the paper's"
    error = {
        "mean": [row["mean_relative_error_percent"] for row in table],
        "5 %": [row["p5_relative_error_percent"] for row in table],
        "95 % of the runs": [row["p95_relative_error_percent"] for row in table],
    }
    draw_cases(figures.place(f"{name}_error"), title, "relative error of μ̂, %", names, error)
    kept = [None if row["lower_bound_holds"] is None else 100.0 * row["lower_bound_holds"] for row in table]
    draw_cases(figures.place(f"{name}_bound"), title, "lower bound kept, %", names, {"bound": kept})
