# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Braking distances by the *identified* adhesion, over Monte-Carlo runs: the paper shows them for the true law only."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.physics import braking
from ...core.physics.adhesion import WET
from ...core.physics.train import CRH3, KMH, Array
from ...run.score import CONVERGED_AFTER_MPS
from .methods import STARTS
from .montecarlo import Result
from .published import WORST

BRAKINGS = {"tunnel_entry": (300.0, 100.0), "tunnel_exit": (250.0, 50.0)}
"""Speeds of the scenarios, km/h."""


def law_of(rows: NDArray[np.void], from_mps: float) -> tuple[Array, Array]:
    """Speeds, rising, and the adhesion identified there; the first 30 km/h take the first value after them.

    Raises ValueError when there is no estimate after the first 30 km/h.
    """
    converged = rows[rows["speed_mps"] < from_mps - CONVERGED_AFTER_MPS]
    if not converged.size:
        raise ValueError("run without an estimate after the first 30 km/h of braking")
    order = np.argsort(converged["speed_mps"])
    return converged["speed_mps"][order], converged["mu"][order]


def distance_and_time(rows: NDArray[np.void], from_kmh: float, to_kmh: float) -> tuple[float, float]:
    """Braking distance, m, and time, s, by the adhesion that a run identified."""
    speeds, mu = law_of(rows, from_kmh * KMH)

    def law(speed_mps: Array) -> Array:
        return np.asarray(np.interp(speed_mps, speeds, mu), dtype=np.float64)

    curve = braking.curve(CRH3, from_kmh * KMH, law, to_kmh * KMH)
    return float(curve.distance_m[-1]), float(curve.time_s[-1])


def rows(results: Sequence[Result]) -> Iterator[dict[str, Any]]:
    """A row per scenario and method: distance and time by the identified adhesion, by the true law, and the saving."""
    by_case: dict[tuple[str, str], list[NDArray[np.void]]] = defaultdict(list)
    for result in results:
        by_case[result.chunk.scenario, result.chunk.method] += result.rows
    for (scenario, method), runs in by_case.items():
        from_kmh, to_kmh = BRAKINGS[scenario]
        found = np.array([distance_and_time(run, from_kmh, to_kmh) for run in runs])
        true, worst = (braking.curve(CRH3, from_kmh * KMH, mu, to_kmh * KMH) for mu in (WET, WORST))
        row: dict[str, Any] = {"from_kmh": from_kmh, "to_kmh": to_kmh, "case": "identified", "method": method}
        row["runs"] = len(runs) // len(STARTS)
        for values, name in zip(found.T, ("distance_m", "time_s"), strict=True):
            fixed = float(getattr(worst, name)[-1])
            row |= {
                name: float(values.mean()),
                f"{name}_p5": float(np.percentile(values, 5)),
                f"{name}_p95": float(np.percentile(values, 95)),
                f"{name}_true_law": float(getattr(true, name)[-1]),
                f"{name}_saved_percent": 100.0 * (1.0 - float(values.mean()) / fixed),
            }
        yield row


def lines(table: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """The rows in words."""
    yield ""
    yield f"by the mu identified in {table[0]['runs']} runs from each start, and saved against the fixed {WORST}"
    yield (
        f"{'km/h':>12} {'method':>14} {'m':>8} {'5 %':>8} {'95 %':>8} {'true law':>8} {'saved':>7}"
        f" {'s':>6} {'5 %':>6} {'95 %':>6} {'true law':>8} {'saved':>7}"
    )
    for row in table:
        yield f"{row['from_kmh']:>5g} -> {row['to_kmh']:>3g} {row['method']:>14}" + "".join(
            f" {row[name]:{width}.1f} {row[f'{name}_p5']:{width}.1f} {row[f'{name}_p95']:{width}.1f}"
            f" {row[f'{name}_true_law']:8.1f} {row[f'{name}_saved_percent']:5.2f} %"
            for name, width in (("distance_m", 8), ("time_s", 6))
        )
