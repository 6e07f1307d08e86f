# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""`study distances`: braking distances and times of Xie et al. 2019 beside the published ones, without noise.

With `--runs` also those by the adhesion that the paper's method and the default one identify in the runs of
`study tables`, whose cache both share.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...command.options import DONE, report
from ...core.physics import braking
from ...core.physics.train import CRH3, KMH
from ..trial.running import Running, add_running_options, running
from ..trial.text import Column, lines
from ..trial.trials import grouped
from . import identified
from .methods import METHODS, trials
from .published import BRAKING_CASES, SAVINGS, WORST

IDENTIFYING = ("particle_em", "rail_condition")
"""The paper's method and the default one."""

COLUMNS = (
    Column("km/h", 12, "", lambda row: f"{row['from_kmh']:>5g} -> {row['to_kmh']:>3g}"),
    Column("mu", 8, "", "case"),
    Column("m", 8, ".1f", "distance_m"),
    Column("paper", 8, ".1f", "paper_distance_m"),
    Column("%", 6, "+.2f", "distance_deviation_percent"),
    Column("s", 6, ".1f", "time_s"),
    Column("paper", 6, ".1f", "paper_time_s"),
    Column("%", 6, "+.2f", "time_deviation_percent"),
)

SAVED = (
    COLUMNS[0],
    Column("m, %", 8, ".2f", "distance_percent"),
    Column("paper", 8, ".2f", "paper_distance_percent"),
    Column("s, %", 6, ".2f", "time_percent"),
    Column("paper", 6, ".2f", "paper_time_percent"),
)


def rows() -> Iterator[dict[str, Any]]:
    """Our distances and times beside the published ones, a row per braking."""
    for case in BRAKING_CASES:
        ours = braking.curve(CRH3, case.from_kmh * KMH, case.mu, case.to_kmh * KMH)
        distance, time = float(ours.distance_m[-1]), float(ours.time_s[-1])
        yield {
            "from_kmh": case.from_kmh,
            "to_kmh": case.to_kmh,
            "case": case.case,
            "distance_m": distance,
            "time_s": time,
            "paper_distance_m": case.distance_m,
            "paper_time_s": case.time_s,
            "distance_deviation_percent": 100.0 * (distance / case.distance_m - 1.0),
            "time_deviation_percent": 100.0 * (time / case.time_s - 1.0),
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


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study distances`."""
    parser.add_argument(
        "--runs", type=int, default=0, help="also by the adhesion identified in so many Monte-Carlo runs (default: 0)"
    )
    add_running_options(parser)
    parser.add_argument("--figures", type=Path, metavar="DIR", help="draw Figs. 2, 3, 10-13, 20 and 21 into DIR")


def by_identified(runs: int, where: Running) -> list[dict[str, Any]]:
    """Distances by the adhesion that each of the methods identified in the runs of `study tables`."""
    wanted = [
        ((scenario, method), trials(scenario, METHODS[method], runs))
        for scenario in identified.BRAKINGS
        for method in IDENTIFYING
    ]
    return list(identified.rows(grouped(wanted, where)))


def run(options: argparse.Namespace) -> int:
    """Print the table and the savings, and the distances by the identified adhesion where runs are asked for."""
    if options.runs < 0:
        raise ValueError(f"runs = {options.runs}: give at least 0")
    table = list(rows())
    text = [*lines(COLUMNS, table), "", f"saved by the wet law against the fixed {WORST}"]
    text += lines(SAVED, savings(table))
    found = by_identified(options.runs, running(options)) if options.runs else []
    if found:
        text += ["", f"by the mu identified in {options.runs} runs from each start; saved against the fixed {WORST}"]
        text += lines(identified.COLUMNS, found)
    if options.figures:
        from .braking_figures import draw_all

        draw_all(options.figures)
    report(options.json, table + found, "\n".join(text))
    return DONE
