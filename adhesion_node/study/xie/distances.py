# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""`study distances`: braking distances and times of Xie et al. 2019 beside the published ones, without noise.

With `--runs` also those by the adhesion that the paper's method and the default one identify in the runs of
`study tables`, whose cache both share.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...command.options import DONE, report
from ...core.physics import braking
from ...core.physics.train import CRH3, KMH
from ..trial.running import Running, add_running_options, running
from . import identified
from .montecarlo import chunks, results
from .published import BRAKING_CASES, SAVINGS, Saving
from .tables import NOMINAL_SIGMA_M

IDENTIFYING = ("particle_em", "rail_condition")
"""The paper's method and the default one."""


def rows() -> list[dict[str, Any]]:
    """Our distances and times beside the published ones, a row per braking."""
    table = []
    for case in BRAKING_CASES:
        ours = braking.curve(CRH3, case.from_kmh * KMH, case.mu, case.to_kmh * KMH)
        distance, time = float(ours.distance_m[-1]), float(ours.time_s[-1])
        table.append(
            {
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
        )
    return table


def savings(table: Sequence[Mapping[str, Any]]) -> list[Saving]:
    """The same of our `rows`."""
    by_case = {(row["from_kmh"], row["to_kmh"], row["case"]): row for row in table}
    found = []
    for published in SAVINGS:
        wet, worst = (by_case[*published[:2], case] for case in ("wet law", "0.0726"))
        shares = (100.0 * (1.0 - wet[name] / worst[name]) for name in ("distance_m", "time_s"))
        found.append(Saving(*published[:2], *shares))
    return found


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
        chunk
        for scenario in identified.BRAKINGS
        for method in IDENTIFYING
        for chunk in chunks(scenario, method, NOMINAL_SIGMA_M, runs)
    ]
    return list(identified.rows(list(results(wanted, where))))


def run(options: argparse.Namespace) -> int:
    """Print the table and the savings, and the distances by the identified adhesion where runs are asked for."""
    if options.runs < 0:
        raise ValueError(f"runs = {options.runs}: give at least 0")
    table = rows()
    lines = [f"{'km/h':>12} {'mu':>8} {'m':>8} {'paper':>8} {'%':>6} {'s':>6} {'paper':>6} {'%':>6}"]
    lines += [
        f"{row['from_kmh']:>5g} -> {row['to_kmh']:>3g} {row['case']:>8} "
        f"{row['distance_m']:8.1f} {row['paper_distance_m']:8.1f} {row['distance_deviation_percent']:+6.2f} "
        f"{row['time_s']:6.1f} {row['paper_time_s']:6.1f} {row['time_deviation_percent']:+6.2f}"
        for row in table
    ]
    lines += ["", "saved by the wet law against the fixed 0.0726, %:  m  paper      s  paper"]
    lines += [
        f"{ours.from_kmh:>5g} -> {ours.to_kmh:>3g} {ours.distance_percent:35.2f} {paper.distance_percent:6.2f} "
        f"{ours.time_percent:6.2f} {paper.time_percent:6.2f}"
        for ours, paper in zip(savings(table), SAVINGS, strict=True)
    ]
    found = by_identified(options.runs, running(options)) if options.runs else []
    lines += identified.lines(found) if found else []
    if options.figures:
        from .braking_figures import draw_all

        draw_all(options.figures)
    report(options.json, table + found, "\n".join(lines))
    return DONE
