# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""From the rows of many runs to the figures of a table: mean errors with their spread, convergence, coverage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.physics.train import KMH

CONVERGED_PERCENT = 5.0
"""Estimates count as converged from where their error, averaged over the runs, falls below this."""

TWO_SIDED_95 = 1.959964
"""Quantile of the standard normal law."""


class Errors(NamedTuple):
    """Mean errors of every run, shape (runs,), and the shares of estimates within their bounds."""

    absolute: NDArray[np.float64]
    relative_percent: NDArray[np.float64]
    coverage95: float
    lower_bound_holds: float


class Curve(NamedTuple):
    """Means over the runs at each time, while adhesion limits at least half of them; arrays of one length."""

    speed_kmh: NDArray[np.float64]
    relative_error_percent: NDArray[np.float64]


def errors(runs: Sequence[NDArray[np.void]]) -> Errors:
    """Errors over all estimates that `score` counts."""
    scored = [rows[rows["scored"]] for rows in runs]
    together = np.concatenate(scored)
    deviation = np.abs(together["mu"] - together["true_mu"])
    return Errors(
        np.array([np.mean(np.abs(rows["mu"] - rows["true_mu"])) for rows in scored]),
        np.array([100.0 * np.mean(np.abs(rows["mu"] / rows["true_mu"] - 1.0)) for rows in scored]),
        float(np.mean(deviation <= TWO_SIDED_95 * together["std"])),
        float(np.mean(together["lower"] <= together["true_mu"])),
    )


def over_speed(runs: Sequence[NDArray[np.void]]) -> Curve:
    """Error over the speed of braking, as Figs. 6 and 16 show it."""
    together = np.concatenate([rows[rows["limited"]] for rows in runs])
    _, index, counts = np.unique(together["t_ns"], return_inverse=True, return_counts=True)
    relative = 100.0 * np.abs(together["mu"] / together["true_mu"] - 1.0)
    many = counts >= 0.5 * len(runs)
    means = [np.bincount(index, weights=values)[many] / counts[many] for values in (together["speed_mps"], relative)]
    return Curve(means[0] / KMH, means[1])


def converged_kmh(curve: Curve) -> float | None:
    """Speed at which the error first falls below `CONVERGED_PERCENT`; None where it does not."""
    below = np.flatnonzero(curve.relative_error_percent < CONVERGED_PERCENT)
    return float(curve.speed_kmh[below[0]]) if below.size else None


def figures(runs: Sequence[Sequence[NDArray[np.void]]]) -> dict[str, Any]:
    """What a line of a table says of runs from one or several starts: `runs[start][run]`.

    The spread is that over the runs, the starts of a run averaged first.
    """
    each = [errors(of_start) for of_start in runs]
    absolute = np.mean([found.absolute for found in each], axis=0)
    relative = np.mean([found.relative_percent for found in each], axis=0)
    return {
        "runs": len(runs[0]),
        "mean_abs_error": float(absolute.mean()),
        "mean_relative_error_percent": float(relative.mean()),
        "converged_kmh": converged_kmh(over_speed([rows for of_start in runs for rows in of_start])),
        "coverage95": float(np.mean([found.coverage95 for found in each])),
        "std_relative_error_percent": float(relative.std()),
        "p5_relative_error_percent": float(np.percentile(relative, 5)),
        "p95_relative_error_percent": float(np.percentile(relative, 95)),
        "lower_bound_holds": float(np.mean([found.lower_bound_holds for found in each])),
    }
