# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`study distances`: braking distances and times of Xie et al. 2019 beside the published ones, without noise.

With `--runs` also those by the adhesion that the paper's method and `rail_condition` identify in the runs of
`study tables`, whose cache both share.
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...command.checks import at_least, refuse
from ...command.running import Running, add_running_options, running
from ...core.physics import braking
from ...core.physics.adhesion import WET, AdhesionLaw
from ...core.physics.train import CRH3, KMH, Array
from ...run.results.score import CONVERGED_AFTER_MPS
from ..trial.figures import add_figure_options, figures_of
from ..trial.text import Column, lines
from ..trial.trials import Results, Rows, each_trial, grouped
from .methods import METHODS, trials
from .published import BRAKING_CASES, SAVINGS, WORST

BRAKINGS = {"tunnel_entry": (300.0, 100.0), "tunnel_exit": (250.0, 50.0)}
"""Speeds of the scenarios, km/h."""

IDENTIFYING = ("particle_em", "rail_condition")
"""The paper's method and the smoother."""

SPEEDS = Column("km/h", 12, "", lambda row: f"{row['from_kmh']:>5g} -> {row['to_kmh']:>3g}")

COLUMNS = (
    SPEEDS,
    Column("mu", 8, "", "case"),
    Column("m", 8, ".1f", "distance_m"),
    Column("paper", 8, ".1f", "paper_distance_m"),
    Column("%", 6, "+.2f", "distance_deviation_percent"),
    Column("s", 6, ".1f", "time_s"),
    Column("paper", 6, ".1f", "paper_time_s"),
    Column("%", 6, "+.2f", "time_deviation_percent"),
)

SAVED = (
    SPEEDS,
    Column("m, %", 8, ".2f", "distance_percent"),
    Column("paper", 8, ".2f", "paper_distance_percent"),
    Column("s, %", 6, ".2f", "time_percent"),
    Column("paper", 6, ".2f", "paper_time_percent"),
)

IDENTIFIED = (
    SPEEDS,
    Column("method", 14, "", "method"),
    *(
        Column(head, width, form, name + end)
        for name, unit, width in (("distance_m", "m", 8), ("time_s", "s", 6))
        for head, form, end in (
            *((unit, ".1f", ""), ("5 %", ".1f", "_p5"), ("95 %", ".1f", "_p95")),
            *(("true", ".1f", "_true_law"), ("saved %", ".2f", "_saved_percent")),
        )
    ),
)


def braked(mu: float | AdhesionLaw, from_kmh: float, to_kmh: float) -> dict[str, float]:
    """Braking distance, m, and time, s, of the paper's train by an adhesion."""
    curve = braking.curve(CRH3, from_kmh * KMH, mu, to_kmh * KMH)
    return {"distance_m": float(curve.distance_m[-1]), "time_s": float(curve.time_s[-1])}


def rows() -> Iterator[dict[str, Any]]:
    """Our distances and times beside the published ones, a row per braking."""
    for case in BRAKING_CASES:
        ours = braked(case.mu, case.from_kmh, case.to_kmh)
        yield {
            "from_kmh": case.from_kmh,
            "to_kmh": case.to_kmh,
            "case": case.case,
            **ours,
            "paper_distance_m": case.distance_m,
            "paper_time_s": case.time_s,
            "distance_deviation_percent": 100.0 * (ours["distance_m"] / case.distance_m - 1.0),
            "time_deviation_percent": 100.0 * (ours["time_s"] / case.time_s - 1.0),
        }


def savings(table: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, float]]:
    """How much shorter the wet law's braking is than that by the fixed worst case, %, ours and the paper's."""
    by_case = {(row["from_kmh"], row["to_kmh"], row["case"]): row for row in table}
    for paper in SAVINGS:
        wet, worst = (by_case[paper.from_kmh, paper.to_kmh, case] for case in ("wet law", "0.0726"))
        yield {
            "from_kmh": paper.from_kmh,
            "to_kmh": paper.to_kmh,
            "distance_percent": 100.0 * (1.0 - wet["distance_m"] / worst["distance_m"]),
            "paper_distance_percent": paper.distance_percent,
            "time_percent": 100.0 * (1.0 - wet["time_s"] / worst["time_s"]),
            "paper_time_percent": paper.time_percent,
        }


def by_identified(rows: Rows, from_kmh: float, to_kmh: float) -> dict[str, float]:
    """Braking distance, m, and time, s, by the adhesion that a run identified.

    The first 30 km/h take the first value after them; raises ValueError where there is none.
    """
    converged = rows[rows["true_speed_mps"] < from_kmh * KMH - CONVERGED_AFTER_MPS]
    if not converged.size:
        raise ValueError("run without an estimate after the first 30 km/h of braking")
    converged = converged[np.argsort(converged["true_speed_mps"])]

    def law(speed_mps: Array) -> Array:
        return np.asarray(np.interp(speed_mps, converged["true_speed_mps"], converged["mu"]), dtype=np.float64)

    return braked(law, from_kmh, to_kmh)


def identified(cells: Mapping[tuple[str, str], Results]) -> Iterator[dict[str, Any]]:
    """A row per scenario and method: distance and time by the identified adhesion, by the true law, and the saving."""
    for (scenario, method), found in cells.items():
        from_kmh, to_kmh = BRAKINGS[scenario]
        by_run = [by_identified(own, from_kmh, to_kmh) for own in each_trial(found.rows)]
        true, worst = (braked(mu, from_kmh, to_kmh) for mu in (WET, WORST))
        row: dict[str, Any] = {"from_kmh": from_kmh, "to_kmh": to_kmh, "case": "identified", "method": method}
        row["runs"] = np.unique(found.runs["seed"]).size
        for name in true:
            values = np.array([of_run[name] for of_run in by_run])
            row |= {
                name: float(values.mean()),
                f"{name}_p5": float(np.percentile(values, 5)),
                f"{name}_p95": float(np.percentile(values, 95)),
                f"{name}_true_law": true[name],
                f"{name}_saved_percent": 100.0 * (1.0 - float(values.mean()) / worst[name]),
            }
        yield row


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study distances`."""
    parser.add_argument(
        "--runs", type=int, default=0, help="also by the adhesion identified in so many Monte-Carlo runs"
    )
    add_running_options(parser)
    add_figure_options(parser, "Figs. 2, 3, 10-13, 20 and 21")


def run(options: argparse.Namespace) -> tuple[list[dict[str, Any]], str]:
    """Return the table and the savings, and the distances by the identified adhesion where runs are asked for."""
    figures = figures_of(options)
    at_least(options, runs=0)
    if not options.runs:
        refuse(options, ["workers", "scheduler", "cache"], "is for --runs: add that, or leave this out")
    table = list(rows())
    text = [*lines(COLUMNS, table), "", f"saved by the wet law against the fixed {WORST}"]
    text += lines(SAVED, savings(table))
    if options.runs:
        found = _identified_in(options.runs, running(options))
        text += ["", f"by the mu identified in {options.runs} runs from each start; saved against the fixed {WORST}"]
        text += lines(IDENTIFIED, found)
        table += found
    if figures is not None:
        from .figures import draw_brakings

        draw_brakings(figures)
    return table, "\n".join(text)


def _identified_in(runs: int, where: Running) -> list[dict[str, Any]]:
    """Identify by each of the methods in the runs of `study tables`."""
    cells = [(scenario, method) for scenario in BRAKINGS for method in IDENTIFYING]
    wanted = [((scenario, method), trials(scenario, METHODS[method], runs)) for scenario, method in cells]
    return list(identified(grouped(wanted, where)))
