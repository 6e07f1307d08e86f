# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The figures of a fault beside B, the same runs without it, from its beginning on.

Errors count while adhesion limits, after the first 30 km/h of braking; B's are those at the same times. Differences to
B are in standard deviations, the larger of both, while adhesion limits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.physics.train import Array
from ..trial.tasks import Arrays
from .fault_cases import Case

TWO_SIDED_90 = 1.644854
"""Quantile of the standard normal law."""

NEAR = 3.0
"""Standard deviations within which an estimate counts as that of B."""

ESTIMATE = ("run", "t_s", "mu", "std", "lower", "safe_m")
"""What must agree, to the bit, for two estimates to be the same."""


class Beside(NamedTuple):
    """Estimates of a run, withheld ones left out, and at their times the error and standard deviation of B."""

    rows: NDArray[np.void]
    b_error: Array
    b_std: Array

    @property
    def difference(self) -> Array:
        """To B, in standard deviations."""
        error = self.rows["mu"] - self.rows["true_mu"]
        result: Array = (error - self.b_error) / np.maximum(self.rows["std"], self.b_std)
        return result

    def settled(self, window: int) -> NDArray[np.bool_]:
        """Which estimates come after a full window of measurements since the fault is over."""
        full = (self.rows["fresh"] >= window) & (self.rows["window"] >= window)
        result: NDArray[np.bool_] = np.logical_or.accumulate(full) & self.rows["limited"]
        return result


def figures(case: Case, own: Arrays, b: Arrays) -> dict[str, Any]:
    """Figures of a case; None where it has nothing to say of one."""
    rows = own["rows"][own["rows"]["t_s"] >= case.start_s]
    known = rows[~rows["withheld"]]
    runs = [beside(known[known["run"] == seed], b["rows"][b["rows"]["run"] == seed]) for seed in own["runs"]["run"]]
    return {
        "table": "faults",
        "case": case.name,
        "fault": case.plan.fault,
        "scenario": case.scenario,
        "method": case.config.method,
        "runs": len(runs),
        "from_s": case.start_s,
        "lasts_s": case.lasts_s if case.passes else None,
        **_errors(runs),
        **_bounds(rows, known),
        **_differences(case, runs),
        "rail_changes": _changes(known),
        **_recovery(case, own["runs"]["run"], known),
        **_told(case, own["drops"], len(runs)),
        "resets": float(np.mean(own["runs"]["resets"])),
        "finite": bool(np.all(own["runs"]["finite"])),
        "identical": _of(np.mean, np.isin(known[list(ESTIMATE)], b["rows"][list(ESTIMATE)])),
    }


def beside(rows: NDArray[np.void], b: NDArray[np.void]) -> Beside:
    """Put B beside the estimates of a run."""
    at = [np.interp(rows["t_s"], b["t_s"], values) for values in (b["mu"] - b["true_mu"], b["std"])]
    return Beside(rows, *at)


def _errors(runs: Sequence[Beside]) -> dict[str, Any]:
    scored = [run.rows["limited"] & run.rows["late"] for run in runs]
    pairs = [(run, which) for run, which in zip(runs, scored, strict=True) if np.any(which)]
    if not pairs:
        names = "mean_relative_error_percent", "std_relative_error_percent", "b_mean_relative_error_percent"
        return dict.fromkeys((*names, "ratio_to_b", "shift", "coverage90"))
    true = [run.rows["true_mu"][which] for run, which in pairs]
    error = [(run.rows["mu"] - run.rows["true_mu"])[which] for run, which in pairs]
    b_error = [run.b_error[which] for run, which in pairs]
    std = [run.rows["std"][which] for run, which in pairs]
    own, b = ([_percent(e, mu) for e, mu in zip(errors, true, strict=True)] for errors in (error, b_error))
    return {
        "mean_relative_error_percent": float(np.mean(own)),
        "std_relative_error_percent": float(np.std(own)),
        "b_mean_relative_error_percent": float(np.mean(b)),
        "ratio_to_b": float(np.mean(own) / np.mean(b)),
        "shift": float(np.mean([np.mean(e) - np.mean(of_b) for e, of_b in zip(error, b_error, strict=True)])),
        "coverage90": float(np.mean(np.abs(np.concatenate(error)) <= TWO_SIDED_90 * np.concatenate(std))),
    }


def _percent(error: Array, true: Array) -> float:
    return 100.0 * float(np.mean(np.abs(error / true)))


def _bounds(rows: NDArray[np.void], known: NDArray[np.void]) -> dict[str, Any]:
    """Whether bound and safe curve hold, under the brake; the safe curve also while mu is withheld."""
    curves = rows[~np.isnan(rows["safe_m"])]
    ratio = curves["safe_m"] / curves["true_m"]
    return {
        "lower_bound_holds": _of(np.mean, known["lower"] <= known["true_mu"]),
        "safe_curve_holds": _of(np.mean, ratio >= 1.0),
        "shortest_safe_curve": _of(np.min, ratio),
        "without_safe_curve": _of(np.mean, np.isnan(rows["safe_m"])),
    }


def _differences(case: Case, runs: Sequence[Beside]) -> dict[str, Any]:
    settled = np.concatenate([run.difference[run.settled(case.config.window)] for run in runs])
    lowest = np.concatenate([run.difference[run.rows["limited"]] for run in runs])
    return {
        "largest_difference_std": _of(np.max, np.abs(settled)),
        "within_3_std": _of(np.mean, np.abs(settled) <= NEAR),
        "lowest_difference_std": _of(np.min, lowest),
    }


def _changes(known: NDArray[np.void]) -> int:
    """How many changes of the rail, which does not change in any case, all runs together were told."""
    told = (known["changes"][known["run"] == seed] for seed in np.unique(known["run"]))
    return sum(int(np.sum(np.maximum(np.diff(of_run), 0))) for of_run in told)  # a reset counts from 0 again


def _recovery(case: Case, seeds: NDArray[np.int64], known: NDArray[np.void]) -> dict[str, Any]:
    """Longest time from the end of a fault that passes to an estimate, and to one of a full window; None: never."""
    after = known[known["t_s"] >= case.over_s]
    found = {}
    for name, window in (("estimate_again_s", 2), ("full_window_again_s", case.config.window)):
        times = [after["out_s"][(after["run"] == seed) & (after["window"] >= window)] for seed in seeds]
        seen = case.passes and all(map(np.size, times))
        found[name] = max(float(of_run[0]) for of_run in times) - case.over_s if seen else None
    return found


def _told(case: Case, drops: NDArray[np.void], runs: int) -> dict[str, Any]:
    """Messages dropped in a run by reason, and how long after the beginning of the fault at the latest."""
    of = {str(reason): drops[drops["reason"] == reason] for reason in np.unique(drops["reason"])}
    return {
        "dropped": {reason: float(np.sum(entries["count"]) / runs) for reason, entries in of.items()},
        "told_s": {reason: float(np.max(entries["first_s"]) - case.start_s) for reason, entries in of.items()},
    }


def _of(what: Callable[[Any], Any], values: NDArray[Any]) -> float | None:
    return float(what(values)) if values.size else None
