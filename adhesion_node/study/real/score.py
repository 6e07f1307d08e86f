# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the estimates of a case are worth against the truth of its journeys.

An estimate counts from the time the full brake has built up until the train is down to 3 m/s, with the truth at its
stamp. *Used* is the adhesion that the whole train's force uses, averaged over 1 s centred there. Adhesion *limits*
where at least half of the axle groups slid within the last 3 s, the *brake* where fewer than 5 % did; else neither.

- error: of mu against used, %, while adhesion limits, after the first 30 km/h of the full brake (or a quarter of the
  speed at its beginning), where mu is not withheld; `naive` the same of the parabola of 5 s through the positions;
- cover: mu +- 1.96 std holds used, among the same estimates;
- bound: mu_lower is not above used, among all estimates, withheld or not;
- safe: the safe curve, and 5 m, are not shorter than the way that truly remained; where there is no curve nobody
  relies on one. Left out: what came before a fall of the rail by a quarter within 100 m, which lay ahead unseen, or
  within 2 s behind it; `safe_behind` leaves out the fall and the 2 s alone, `safe_everywhere` nothing;
- shortfall and excess of the curve over remaining ways above 100 m, %: where `safe` counts, and for the excess also
  behind the last rise of the rail, which is as unseen;
- regimes: where adhesion limits, the shares that claim each; where the brake does, the share that claims that adhesion
  limits; `regime_wrong` where either claims the other, among both. COASTING claims nothing;
- false changes: told while no border of the rail that was not told yet lay 15 s behind or 5 s ahead at most, per hour;
- speed: its rms error, and the share beyond 3 of its own standard deviations;
- silence: longest time without an estimate from the first one on, and under the brake;
- found: from a fall of the rail until mu is again within 20 % of used; 0 where it never left it.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core import Regime
from ...core.physics.train import Array
from ...run.results.score import AFTER_SHARE, CONVERGED_AFTER_MPS, SLOWEST_MPS
from ..trial.score import TWO_SIDED_95, statistic
from ..trial.trials import Rows
from .trials import Found

LIMITS_FROM, BRAKE_BELOW = 0.5, 0.05
"""Shares of sliding axle groups from which adhesion limits, and below which the brake does."""

TOLERANCE_M = 5.0
LONG_WAY_M = 100.0
UNSEEN_S = 2.0
EARLY_S, LATE_S = 5.0, 15.0  # twice what positions alone need
FOUND_SHARE = 0.2
MANY_STD = 3.0


class Figure(NamedTuple):
    """How a figure of the runs becomes one of the case."""

    over_seeds: Callable[[Any], Any]
    worst: Callable[[Any], Any]


_LOW = Figure(np.mean, np.max)
_HIGH = Figure(np.mean, np.min)
_LARGEST = Figure(np.max, np.max)

FIGURES: Mapping[str, Figure] = {
    "error_percent": _LOW,
    "naive_error_percent": _LOW,
    "coverage95": _HIGH,
    "bound_kept": _HIGH,
    "bound_kept_limited": _HIGH,
    "safe": _HIGH,
    "safe_behind": _HIGH,
    "safe_everywhere": _HIGH,
    "shortfall_percent": _LARGEST,
    "excess_percent": _LOW,
    "no_safe_curve": _LOW,
    **{f"limited_called_{regime.name.lower()}": _LOW for regime in Regime},
    "brake_limited_called_adhesion_limited": _LOW,
    "regime_wrong": _LOW,
    "false_changes_per_hour": _LOW,
    "speed_rms_mps": _LOW,
    "speed_beyond_3_std": _LOW,
    "silence_s": _LARGEST,
    "silence_braked_s": _LARGEST,
    "found_s": Figure(np.median, np.max),
    "withheld": _LOW,
    "limited": _LOW,
}
"""Figures of a run; over the seeds they are their means, for some the largest or the median, beside the worst seed."""


def score(found: Found) -> dict[str, Any]:
    """Score the runs of a case; None where they have nothing to say."""
    of_runs = [of_run(found.of_seed(seed)) for seed in found.runs["seed"]]
    result: dict[str, Any] = {"runs": len(of_runs)}
    for name, figure in FIGURES.items():
        values = [value for run in of_runs if (value := run[name]) is not None]
        result[name], result[f"{name}_worst"] = (statistic(what, values) for what in (figure.over_seeds, figure.worst))
    dropped: dict[str, float] = {}
    for drop in found.drops:
        reason = str(drop["reason"])
        dropped[reason] = dropped.get(reason, 0.0) + float(drop["count"]) / len(of_runs)
    return {**result, "dropped": dropped}


def of_run(found: Found) -> dict[str, float | None]:
    """Figures of one run."""
    (run,), rows = found.runs, found.rows
    moving = rows["true_speed_mps"] > SLOWEST_MPS
    braked = rows[(rows["t_s"] >= run["built_s"]) & (rows["t_s"] < run["slow_s"]) & moving]
    limits, brake_limits = braked["slid"] >= LIMITS_FROM, braked["slid"] < BRAKE_BELOW
    lost_mps = min(CONVERGED_AFTER_MPS, AFTER_SHARE * run["full_mps"])
    late = limits & (braked["true_speed_mps"] < run["full_mps"] - lost_mps)
    counted = braked[late & ~braked["withheld"]]
    claims, brake_claims = (braked["regime"] == one.name for one in (Regime.ADHESION_LIMITED, Regime.BRAKE_LIMITED))
    wrong = np.where(limits, brake_claims, claims)[limits | brake_limits]
    speed_off = np.abs(braked["speed_mps"] - braked["true_speed_mps"])
    kept = braked["lower"] <= braked["used"]
    silence, silence_braked = _silences(run, rows["out_s"])
    return {
        "error_percent": statistic(np.mean, 100.0 * _off(counted, "mu")),
        "naive_error_percent": statistic(np.nanmean, _known(100.0 * _off(braked[late], "naive"))),
        "coverage95": statistic(np.mean, np.abs(counted["mu"] - counted["used"]) <= TWO_SIDED_95 * counted["std"]),
        "bound_kept": statistic(np.mean, kept),
        "bound_kept_limited": statistic(np.mean, kept[limits]),
        **_curves(braked, found.borders[found.borders["start_s"] < run["slow_s"]]),
        **{
            f"limited_called_{regime.name.lower()}": statistic(np.mean, braked["regime"][limits] == regime.name)
            for regime in Regime
        },
        "brake_limited_called_adhesion_limited": statistic(np.mean, claims[brake_limits]),
        "regime_wrong": statistic(np.mean, wrong),
        "false_changes_per_hour": 3600.0 * _false_changes(found) / (run["slow_s"] - run["full_s"]),
        "speed_rms_mps": statistic(lambda off: np.sqrt(np.mean(off**2)), speed_off),
        "speed_beyond_3_std": statistic(np.mean, speed_off > MANY_STD * braked["speed_std_mps"]),
        "silence_s": silence,
        "silence_braked_s": silence_braked,
        "found_s": statistic(np.mean, _found_after(found)),
        "withheld": statistic(np.mean, braked["withheld"]),
        "limited": statistic(np.mean, limits),
    }


def _off(rows: Rows, name: str) -> Array:
    """Relative error against the adhesion used."""
    return np.asarray(np.abs(rows[name] / rows["used"] - 1.0))


def _known(values: Array) -> Array:
    return values[~np.isnan(values)]


def _curves(braked: Rows, borders: NDArray[np.void]) -> dict[str, float | None]:
    """Figures of the safe curves."""
    t_s, length, way = braked["t_s"], braked["safe_m"], braked["remaining_m"]
    falls = borders[borders["ratio"] < 1.0]
    behind = np.zeros(t_s.size, np.bool_)
    for fall in falls:
        behind |= (t_s >= fall["start_s"]) & (t_s < fall["end_s"] + UNSEEN_S)
    seen, all_seen = (t_s >= np.max(some["end_s"] + UNSEEN_S, initial=-np.inf) for some in (falls, borders))
    holds = ~(length + TOLERANCE_M < way)  # true where there is no curve
    longer = 100.0 * (length / np.maximum(way, TOLERANCE_M) - 1.0)
    long = way > LONG_WAY_M
    return {
        "safe": statistic(np.mean, holds[seen]),
        "safe_behind": statistic(np.mean, holds[~behind]),
        "safe_everywhere": statistic(np.mean, holds),
        "shortfall_percent": statistic(lambda more: max(-np.min(more), 0.0), _known(longer[seen & long])),
        "excess_percent": statistic(np.mean, _known(longer[all_seen & long])),
        "no_safe_curve": statistic(np.mean, np.isnan(length)),
    }


def _false_changes(found: Found) -> int:
    """Changes of the rail that were told under the brake and are those of no border; of one border is one told."""
    (run,), rows = found.runs, found.rows
    told = np.maximum(np.diff(rows["changes"], prepend=rows["changes"][:1]), 0)
    braked = (rows["t_s"] >= run["full_s"]) & (rows["t_s"] < run["slow_s"])
    untold, false = sorted((border["start_s"], border["end_s"]) for border in found.borders), 0
    for t_s in np.repeat(rows["t_s"][braked], told[braked]):
        untold = [border for border in untold if border[1] + LATE_S >= t_s]
        if untold and untold[0][0] - EARLY_S <= t_s:
            del untold[0]
        else:
            false += 1
    return false


def _silences(run: NDArray[np.void], out_s: Array) -> tuple[float, float]:
    """Longest time without an estimate, s: from the first one to the end of the run, and touching the braking."""
    times = np.append(out_s, run["end_s"]) if out_s.size else np.array([run["full_s"], run["end_s"]])
    gaps = np.diff(times)
    touching = (times[1:] > run["full_s"]) & (times[:-1] < run["slow_s"])
    return float(np.max(gaps)), float(np.max(gaps[touching], initial=0.0))


def _found_after(found: Found) -> list[float]:
    """Of every fall under the brake: time, s, from the last estimate before mu is off by a fifth until it is no longer.

    0 where it never was; where the rail changes again or the braking ends before, the time until then.
    """
    (run,), rows, times = found.runs, found.rows, []
    starts = np.append(found.borders["start_s"], run["slow_s"])
    for index, fall in enumerate(found.borders):
        if fall["ratio"] > 1.0 or not run["built_s"] <= fall["start_s"] < run["slow_s"]:
            continue
        until_s = min(starts[index + 1], run["slow_s"])
        own = rows[(rows["t_s"] >= fall["start_s"]) & (rows["t_s"] < until_s)]
        off = (_off(own, "mu") > FOUND_SHARE) | own["withheld"]
        if not off.any():
            times.append(0.0)
            continue
        first = int(np.argmax(off))
        since_s = own["t_s"][first - 1] if first else fall["start_s"]
        again = own["out_s"][first:][~off[first:]]
        times.append(float((again[0] if again.size else until_s) - since_s))
    return times
