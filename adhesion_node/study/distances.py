"""`study distances`: braking distances and times of Xie et al. 2019 beside the published ones, without noise."""

from __future__ import annotations

import argparse
from typing import Any, NamedTuple

from ..cli import DONE, report
from ..core import braking
from ..core.adhesion import WET, AdhesionLaw
from ..core.train import CRH3, KMH


class Published(NamedTuple):
    """A braking of the paper: speeds in km/h, distance in m and time in s as printed with Figs. 10, 11, 20, 21."""

    from_kmh: float
    to_kmh: float
    case: str
    mu: float | AdhesionLaw
    distance_m: float
    time_s: float


BEST, WORST = 0.1542, 0.0726
"""Adhesion of a wet rail at 0 and at 300 km/h: the constants between which the paper compares."""

PUBLISHED = (
    Published(300, 100, "0.1542", BEST, 3060.7, 56.1),
    Published(300, 100, "0.0726", WORST, 3946.7, 71.7),
    Published(300, 100, "wet law", WET, 3481.1, 62.8),
    Published(250, 50, "0.1542", BEST, 2404.3, 59.3),
    Published(250, 50, "0.0726", WORST, 2958.9, 72.7),
    Published(250, 50, "wet law", WET, 2614.4, 62.7),
)


def rows() -> list[dict[str, Any]]:
    """Our distances and times beside the published ones, a row per braking."""
    table = []
    for case in PUBLISHED:
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


def run(options: argparse.Namespace) -> int:
    """Print the table."""
    table = rows()
    lines = [f"{'km/h':>12} {'mu':>8} {'m':>8} {'paper':>8} {'%':>6} {'s':>6} {'paper':>6} {'%':>6}"]
    lines += [
        f"{row['from_kmh']:>5g} -> {row['to_kmh']:>3g} {row['case']:>8} "
        f"{row['distance_m']:8.1f} {row['paper_distance_m']:8.1f} {row['distance_deviation_percent']:+6.2f} "
        f"{row['time_s']:6.1f} {row['paper_time_s']:6.1f} {row['time_deviation_percent']:+6.2f}"
        for row in table
    ]
    report(options.json, table, "\n".join(lines))
    return DONE
