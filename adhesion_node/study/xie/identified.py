# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Braking distances by the *identified* adhesion, over Monte-Carlo runs: the paper shows them for the true law only."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...core.physics import braking
from ...core.physics.adhesion import WET
from ...core.physics.train import CRH3, KMH, Array
from ...run.score import CONVERGED_AFTER_MPS
from ..trial.text import Column
from ..trial.trials import Results, Rows, each_trial
from .published import WORST

BRAKINGS = {"tunnel_entry": (300.0, 100.0), "tunnel_exit": (250.0, 50.0)}
"""Speeds of the scenarios, km/h."""

COLUMNS = (
    Column("km/h", 12, "", lambda row: f"{row['from_kmh']:>5g} -> {row['to_kmh']:>3g}"),
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


def law_of(rows: Rows, from_mps: float) -> tuple[Array, Array]:
    """Speeds, rising, and the adhesion identified there; the first 30 km/h take the first value after them.

    Raises ValueError when there is no estimate after the first 30 km/h.
    """
    converged = rows[rows["true_speed_mps"] < from_mps - CONVERGED_AFTER_MPS]
    if not converged.size:
        raise ValueError("run without an estimate after the first 30 km/h of braking")
    order = np.argsort(converged["true_speed_mps"])
    return converged["true_speed_mps"][order], converged["mu"][order]


def distance_and_time(rows: Rows, from_kmh: float, to_kmh: float) -> tuple[float, float]:
    """Braking distance, m, and time, s, by the adhesion that a run identified."""
    speeds, mu = law_of(rows, from_kmh * KMH)

    def law(speed_mps: Array) -> Array:
        return np.asarray(np.interp(speed_mps, speeds, mu), dtype=np.float64)

    curve = braking.curve(CRH3, from_kmh * KMH, law, to_kmh * KMH)
    return float(curve.distance_m[-1]), float(curve.time_s[-1])


def rows(cells: Mapping[tuple[str, str], Results]) -> Iterator[dict[str, Any]]:
    """A row per scenario and method: distance and time by the identified adhesion, by the true law, and the saving."""
    for (scenario, method), found in cells.items():
        from_kmh, to_kmh = BRAKINGS[scenario]
        identified = np.array([distance_and_time(own, from_kmh, to_kmh) for own in each_trial(found.rows)])
        true, worst = (braking.curve(CRH3, from_kmh * KMH, mu, to_kmh * KMH) for mu in (WET, WORST))
        row: dict[str, Any] = {"from_kmh": from_kmh, "to_kmh": to_kmh, "case": "identified", "method": method}
        row["runs"] = np.unique(found.runs["seed"]).size
        for values, name in zip(identified.T, ("distance_m", "time_s"), strict=True):
            fixed = float(getattr(worst, name)[-1])
            row |= {
                name: float(values.mean()),
                f"{name}_p5": float(np.percentile(values, 5)),
                f"{name}_p95": float(np.percentile(values, 95)),
                f"{name}_true_law": float(getattr(true, name)[-1]),
                f"{name}_saved_percent": 100.0 * (1.0 - float(values.mean()) / fixed),
            }
        yield row
