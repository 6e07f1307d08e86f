# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study real`: the estimator on trains, rails and sensors that share no model with it, held against goals.

Run r of a case has seed FIRST_SEED + r. Settings were tuned on seeds from 5000 on (`--tune`); what is quoted is from
seeds from 1000 on. *Used* is the adhesion that the whole train's force uses; doc/real_train.md says what every column
is. They are means over the runs, and stand beside the worst run in the JSON; shortfall and silence are the worst of
all runs. A figure that misses its goal is marked with !, and the distances stand below.
"""

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from ...command.checks import at_least
from ...command.running import add_running_options, running
from ...core import Config
from ...core.readers import unread
from ...core.setting import settings_of
from ..trial.figures import add_figure_options, figures_of
from ..trial.text import Column, lines
from .cases import Case, chosen
from .goals import goals, missed, soonest
from .possible.least import Least, least
from .score import score
from .trials import found

JUDGED_SEEDS, TUNED_SEEDS = 1000, 5000
"""First seeds of what is quoted, and of what settings are tuned by."""

SHOWN = (
    ("error %", 8, ".1f", "error_percent", 1.0),
    ("least %", 7, ".1f", "error_least_percent", 1.0),
    ("naive %", 7, ".1f", "naive_error_percent", 1.0),
    ("cover %", 7, ".1f", "coverage95", 100.0),
    ("bound %", 7, ".1f", "bound_kept", 100.0),
    ("safe %", 7, ".1f", "safe", 100.0),
    ("all %", 6, ".1f", "safe_everywhere", 100.0),
    ("short %", 7, ".1f", "shortfall_percent", 1.0),
    ("excess %", 8, ".0f", "excess_percent", 1.0),
    ("none %", 6, ".1f", "no_safe_curve", 100.0),
    ("regime %", 8, ".1f", "regime_wrong", 100.0),
    ("false/h", 7, ".0f", "false_changes_per_hour", 1.0),
    ("speed", 6, ".2f", "speed_rms_mps", 1.0),
    ("3 std %", 7, ".1f", "speed_beyond_3_std", 100.0),
    ("silence", 7, ".1f", "silence_s", 1.0),
    ("found s", 7, ".1f", "found_s", 1.0),
    ("soonest", 7, ".1f", "found_soonest_s", 1.0),
    ("withheld %", 10, ".1f", "withheld", 100.0),
)
"""Head, width, format, figure and factor of every column."""


def _marked(figure: str, factor: float, form: str, row: Mapping[str, Any]) -> str | None:
    """A figure in the unit of its column, with a mark where it misses its goal."""
    value = row[figure]
    return None if value is None else format(factor * value, form) + ("!" if figure in row["missed"] else " ")


COLUMNS = (
    Column("case", 31, "", "case"),
    *(Column(head, width, "", partial(_marked, figure, factor, form)) for head, width, form, figure, factor in SHOWN),
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study real`."""
    parser.add_argument("--runs", type=int, default=20, help="runs of each case")
    parser.add_argument("--only", default="", metavar="TEXT,...", help="cases whose names hold one of the texts")
    other = "a setting of the estimator that shall differ from what it is told else; repeatable"
    parser.add_argument("--set", metavar="NAME=VALUE", action="append", default=[], help=other)
    seeds = parser.add_mutually_exclusive_group()
    seeds.add_argument("--first-seed", type=int, default=JUDGED_SEEDS, metavar="SEED", help="of the first run")
    seeds.add_argument(
        "--tune",
        action="store_const",
        dest="first_seed",
        const=TUNED_SEEDS,
        help=f"the seeds that settings are tuned by, from {TUNED_SEEDS} on",
    )
    add_figure_options(parser, "errors and bounds of all cases, and the first run of each,")
    add_running_options(parser)


def run(options: argparse.Namespace) -> tuple[list[dict[str, Any]], str]:
    """Run what is missing, return a row per case, draw the figures."""
    at_least(options, runs=1, first_seed=0)
    figures = figures_of(options)
    wanted, where = chosen(options.only, options.set), running(options)
    for remark in unread(dict(wanted[0].told), settings_of(Config)):
        print(f"study: {remark}", file=sys.stderr)
    cases, bounds = found(wanted, options.first_seed, options.runs, where), least(wanted, where)
    table = [row(case, score(of_case), bounds[case]) for case, of_case in cases.items()]
    for entry in table:
        entry["first_seed"] = options.first_seed
    if figures is not None:
        from .figures import draw, draw_all

        draw_all(table, figures)
        for case, of_case in cases.items():
            draw(case, of_case, figures)
    return table, "\n".join([*lines(COLUMNS, table), "", *_missed_lines(table)])


def row(case: Case, scored: Mapping[str, Any], at_best: Least) -> dict[str, Any]:
    """The row of a case: its figures, its goals, and by how much they are missed."""
    ranges = {
        goal.figure: [limit if np.isfinite(limit) else None for limit in (goal.least, goal.most)]
        for goal in goals(case)
    }
    named: dict[str, Any] = {"case": case.name, "scenario": case.scenario, "fitted": case.fitted}
    bound = {
        "found_soonest_s": soonest(case),
        "error_least_percent": at_best.error_percent,
        "excess_least_percent": at_best.excess_percent,
    }
    if case.told:
        named["set"] = dict(case.told)
    return {**named, **scored, **bound, "goals": ranges, "missed": missed(case, scored)}


def _missed_lines(table: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """The distances to the goals, case by case."""
    table, factors = list(table), {figure: (head, factor) for head, _, _, figure, factor in SHOWN}
    yield f"every goal is met in {sum(not entry['missed'] for entry in table)} of {len(table)} cases; missed by"
    for entry in table:
        shown = (f"{factors[name][0]} {factors[name][1] * by:+.2g}" for name, by in entry["missed"].items())
        if entry["missed"]:
            yield f"{entry['case']:>31}  {', '.join(shown)}"
