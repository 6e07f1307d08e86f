# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The one score of all studies: what a line of any table says of its trials."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.physics.train import KMH
from .trials import Results, Rows, each_trial

CONVERGED_PERCENT = 5.0
"""Estimates count as converged from where their error, averaged over the runs, falls below this."""

TWO_SIDED_90, TWO_SIDED_95 = 1.644854, 1.959964
"""Quantiles of the standard Gaussian."""


class Curve(NamedTuple):
    """Means over the trials at each time, while adhesion limits at least half of them; arrays of one length."""

    speed_kmh: NDArray[np.float64]
    relative_error_percent: NDArray[np.float64]


def score(found: Results) -> dict[str, Any]:
    """Score trials; None where they have nothing to say.

    Errors are means over the estimates of a trial that count (`scored` in `ROW`, not withheld), then over the starts
    of a run; their spread is that over the runs. Shares are over all estimates of all trials.
    """
    rows, known = found.rows, found.rows[~found.rows["withheld"]]
    counted = known[known["scored"]]
    off = np.abs(counted["mu"] - counted["true_mu"])
    relative = of_runs(counted, relative_percent)
    curves = rows[~np.isnan(rows["safe_m"])]
    moving = curves[curves["true_stopping_m"] > 0.0]
    brake_limits = rows[~rows["limited"]]
    changes = sum(map(changes_told, each_trial(known)))
    hours = sum(float(own["t_ns"][-1] - own["t_ns"][0]) * 1e-9 for own in each_trial(rows)) / 3600.0
    silences = np.concatenate([np.zeros(0), *(np.diff(own["out_s"]) for own in each_trial(rows))])
    return {
        "runs": np.unique(found.runs["seed"]).size,
        "mean_abs_error": statistic(np.mean, of_runs(counted, lambda own: np.abs(own["mu"] - own["true_mu"]))),
        "mean_error": statistic(np.mean, of_runs(counted, lambda own: own["mu"] - own["true_mu"])),
        "mean_relative_error_percent": statistic(np.mean, relative),
        "std_relative_error_percent": statistic(np.std, relative),
        "p5_relative_error_percent": statistic(lambda values: np.percentile(values, 5), relative),
        "p95_relative_error_percent": statistic(lambda values: np.percentile(values, 95), relative),
        "converged_kmh": converged_kmh(over_speed(found)),
        "coverage90": statistic(np.mean, off <= TWO_SIDED_90 * counted["std"]),
        "coverage95": statistic(np.mean, off <= TWO_SIDED_95 * counted["std"]),
        "lower_bound_holds": statistic(np.mean, known["lower"] <= known["true_mu"]),
        "lower_bound_holds_scored": statistic(np.mean, counted["lower"] <= counted["true_mu"]),
        "safe_curve_holds": statistic(np.mean, curves["safe_m"] >= curves["true_stopping_m"]),
        "shortest_safe_curve": statistic(np.min, moving["safe_m"] / moving["true_stopping_m"]),
        "without_safe_curve": statistic(np.mean, np.isnan(rows["safe_m"])),
        "claimed_while_the_brake_limits": statistic(np.mean, brake_limits["claimed"]),
        "changes_told": changes,
        "changes_per_hour": changes / hours if hours else None,
        "longest_silence_s": statistic(np.max, silences),
    }


def relative_percent(rows: Rows) -> NDArray[np.float64]:
    """Relative error of every estimate, %."""
    return np.asarray(100.0 * np.abs(rows["mu"] / rows["true_mu"] - 1.0))


def changes_told(rows: Rows) -> int:
    """How many changes of the rail a trial told since its first row; a reset counts from 0 again."""
    return int(np.sum(np.maximum(np.diff(rows["changes"]), 0)))


def of_runs(rows: Rows, value: Callable[[Rows], NDArray[Any]]) -> NDArray[np.float64]:
    """Mean value of every run, shape (runs,): over each trial's estimates, then over the starts."""
    by_seed: dict[int, list[float]] = {}
    for own in each_trial(rows):
        by_seed.setdefault(int(own["seed"][0]), []).append(float(np.mean(value(own))))
    return np.array([np.mean(values) for values in by_seed.values()])


def statistic(what: Callable[[Any], Any], values: NDArray[Any] | Sequence[float]) -> float | None:
    """A statistic of values; None where there are none."""
    return float(what(values)) if len(values) else None


def over_speed(found: Results) -> Curve:
    """Error over the speed of braking, as Figs. 6 and 16 show it."""
    limited = found.rows[found.rows["limited"]]
    _, index, counts = np.unique(limited["t_ns"], return_inverse=True, return_counts=True)
    many = counts >= 0.5 * len(found.runs)
    columns = limited["true_speed_mps"], relative_percent(limited)
    speed, error = (np.bincount(index, weights=values)[many] / counts[many] for values in columns)
    return Curve(speed / KMH, error)


def converged_kmh(curve: Curve) -> float | None:
    """Speed at which the error first falls below `CONVERGED_PERCENT`; None where it does not."""
    return statistic(lambda speeds: speeds[0], curve.speed_kmh[curve.relative_error_percent < CONVERGED_PERCENT])
