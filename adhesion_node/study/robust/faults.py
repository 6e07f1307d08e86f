# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The second table of `study robust`: faults of sensors, messages, clock and train, each beside the run without it.

Figures count from the beginning of the fault on; B's errors are those at the same times. Differences to B are in
standard deviations, the larger of both, while adhesion limits.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...command.running import Running
from ..trial.score import score, statistic
from ..trial.text import Column
from ..trial.trials import Results, Rows, each_trial, grouped
from .cases import FAULTS, Case

NEAR = 3.0
"""Standard deviations within which an estimate counts as that of B."""

ESTIMATE = ["seed", "t_ns", "mu", "std", "lower", "safe_m"]
"""What must agree, to the bit, for two estimates to be the same."""


def _dropped(row: Mapping[str, Any]) -> str:
    told = row["told_s"]
    return ", ".join(f"{reason} {count:.0f} ({told[reason]:.1f})" for reason, count in row["dropped"].items()) or "-"


COLUMNS = (
    Column("fault", 32, "", "case"),
    Column("error %", 7, ".2f", "mean_relative_error_percent"),
    Column("B", 5, ".2f", "b_mean_relative_error_percent"),
    Column("ratio", 5, ".2f", "ratio_to_b"),
    Column("cover", 5, ".2f", "coverage90"),
    Column("bound", 6, ".3f", "lower_bound_holds"),
    Column("safe curve", 10, ".3f", "safe_curve_holds"),
    Column("to B, std", 9, ".1f", "largest_difference_std"),
    Column("rail", 4, "", "rail_changes"),
    Column("again s", 7, ".1f", "full_window_again_s"),
    Column(" dropped in a run, from s on", 0, "", lambda row: f" {_dropped(row)}"),
)


def rows(runs: int, where: Running) -> list[dict[str, Any]]:
    """Run what is missing; a row per fault."""
    cases = dict.fromkeys((*(case.without for case in FAULTS), *FAULTS))
    found = grouped(((case, case.trials(runs)) for case in cases), where)
    return [row(case, found[case], found[case.without]) for case in FAULTS]


def row(case: Case, found: Results, b: Results) -> dict[str, Any]:
    """Figures of a case; None where it has nothing to say of one."""
    start_s = case.world.plan.fault_start_s
    found = found.where(found.rows["t_ns"] * 1e-9 >= start_s)
    known = found.rows[~found.rows["withheld"]]
    against = beside(known, b.rows)
    own, of_b = score(found), score(found._replace(rows=against))
    error, b_error = own["mean_relative_error_percent"], of_b["mean_relative_error_percent"]
    return {
        "table": "faults",
        **case.head,
        "fault": case.world.plan.fault,
        "from_s": start_s,
        "lasts_s": case.world.lasts_s if case.passes else None,
        **own,
        "rail_changes": own["changes_told"],
        "b_mean_relative_error_percent": b_error,
        "ratio_to_b": None if error is None else error / b_error,
        "shift": None if error is None else own["mean_error"] - of_b["mean_error"],
        **_differences(case.estimator.config.window, known, against),
        **_recovery(case, found),
        **_told(start_s, found),
        "resets": float(np.mean(found.runs["resets"])),
        "finite": bool(np.all(found.runs["finite"])),
        "identical": statistic(np.mean, np.isin(known[ESTIMATE], b.rows[ESTIMATE])),
    }


def beside(rows: Rows, b: Rows) -> Rows:
    """Copy rows with the error and the standard deviation that B has at their times."""
    against = rows.copy()
    for own in each_trial(against):  # parts of `against`, not copies
        of_b = b[b["seed"] == own["seed"][0]]
        error, std = (np.interp(own["t_ns"], of_b["t_ns"], of) for of in (of_b["mu"] - of_b["true_mu"], of_b["std"]))
        own["mu"], own["std"] = own["true_mu"] + error, std
    return against


def _differences(window: int, known: Rows, against: Rows) -> dict[str, float | None]:
    difference = (known["mu"] - against["mu"]) / np.maximum(known["std"], against["std"])
    settled = np.abs(difference[_settled(known, window)])
    return {
        "largest_difference_std": statistic(np.max, settled),
        "within_3_std": statistic(np.mean, settled <= NEAR),
        "lowest_difference_std": statistic(np.min, difference[known["limited"]]),
    }


def _settled(known: Rows, window: int) -> NDArray[np.bool_]:
    """Which estimates come after a full window of measurements since the fault is over."""
    full = [(own["fresh"] >= window) & (own["window"] >= window) for own in each_trial(known)]
    since = np.concatenate([np.zeros(0, np.bool_), *map(np.logical_or.accumulate, full)])
    return np.asarray(since & known["limited"])


def _recovery(case: Case, found: Results) -> dict[str, float | None]:
    """Longest time from the end of a fault that passes to an estimate, and to one of a full window; None: never."""
    over_s, seeds = case.world.over_s, found.runs["seed"]
    after = found.rows[~found.rows["withheld"] & (found.rows["t_ns"] * 1e-9 >= over_s)]
    longest = dict[str, float | None]()
    for name, window in (("estimate_again_s", 2), ("full_window_again_s", case.estimator.config.window)):
        times = [after["out_s"][(after["seed"] == seed) & (after["window"] >= window)] for seed in seeds]
        seen = case.passes and all(map(np.size, times))
        longest[name] = max(float(of_run[0]) for of_run in times) - over_s if seen else None
    return longest


def _told(start_s: float, found: Results) -> dict[str, dict[str, float]]:
    """Messages dropped in a run by reason, and how long after the beginning of the fault at the latest."""
    reasons = found.drops["reason"]
    by_reason = {str(reason): found.drops[reasons == reason] for reason in np.unique(reasons)}
    return {
        "dropped": {reason: float(np.sum(some["count"]) / len(found.runs)) for reason, some in by_reason.items()},
        "told_s": {reason: float(np.max(some["first_s"]) - start_s) for reason, some in by_reason.items()},
    }
