# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The first table of `study robust`: rails, sensors and trains other than believed, each beside tunnel_entry."""

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from ...command.running import Running
from ..trial.score import relative_percent, score
from ..trial.text import Column
from ..trial.trials import Results, Rows, each_trial, grouped
from .cases import PAPER, RAILS, Case

FEW = 10
"""Runs that do for the paper's method, which takes its time."""

AGAIN_PERCENT = 10.0
"""Relative error below which the estimate counts as good again after a change."""


def _changes(row: Mapping[str, Any]) -> str:
    pairs = zip(row["found_s"] or (), row["again_s"] or (), strict=True)
    return "; ".join(", ".join("-" if value is None else f"{value:.1f}" for value in pair) for pair in pairs)


COLUMNS = (
    Column("case", 32, "", "case"),
    Column("error %", 7, ".2f", "mean_relative_error_percent"),
    Column("std", 5, ".2f", "std_relative_error_percent"),
    Column("ratio", 6, ".2f", "ratio_to_clean"),
    Column("cover", 6, ".3f", "coverage95"),
    Column("bound", 6, ".3f", "lower_bound_holds"),
    Column("claimed", 7, ".3f", "claimed_while_the_brake_limits"),
    Column("changes/h", 9, ".2f", "changes_per_hour"),
    Column(" found after s, good again after s", 0, "", lambda row: f" {_changes(row)}"),
)


def rows(runs: int, where: Running) -> list[dict[str, Any]]:
    """Run what is missing; a row per case."""
    wanted = ((case, case.trials(min(runs, FEW) if case.estimator == PAPER else runs)) for case in RAILS)
    table = [row(case, found) for case, found in grouped(wanted, where).items()]
    clean = table[0]["mean_relative_error_percent"]
    for entry in table:
        error = entry["mean_relative_error_percent"]
        entry["ratio_to_clean"] = None if error is None else error / clean
    return table


def row(case: Case, found: Results) -> dict[str, Any]:
    """Figures of a case while the run goes on; None where it has nothing to say of one."""
    found = found.where(~found.rows["at_end"])
    of_runs = [after_changes(own) for own in each_trial(found.rows)]
    scored = score(found)
    changed = any(of_runs)
    return {
        "table": "rails",
        **case.head,
        **scored,
        "changes_per_hour": None if changed else scored["changes_per_hour"],
        "found_s": _medians([[found_s for found_s, _ in of_run] for of_run in of_runs]) if changed else None,
        "again_s": _medians([[again_s for _, again_s in of_run] for of_run in of_runs]) if changed else None,
    }


def after_changes(rows: Rows) -> list[tuple[float, float]]:
    """Of every true change of the rail in a run: time until it is found and until the error stays small, s.

    Infinite where it is not found before the next one.
    """
    t_s = rows["t_ns"] * 1e-9
    jumps = np.flatnonzero(np.abs(np.diff(np.log(rows["true_mu"]))) > AGAIN_PERCENT / 100.0) + 1
    ends = [*jumps[1:], *([rows.size] if jumps.size else [])]
    entries = []
    for start, end in zip(jumps, ends, strict=True):
        part, times, began = rows[start:end], t_s[start:end], t_s[start - 1]
        found = times[part["changes"] > rows["changes"][start - 1]]
        bad = times[part["limited"] & (relative_percent(part) > AGAIN_PERCENT)]
        entries.append((float(found[0] - began) if found.size else np.inf, float(bad[-1] - began) if bad.size else 0.0))
    return entries


def _medians(of_runs: Sequence[Sequence[float]]) -> list[float | None]:
    """Medians over all runs, in pairs: of the falls, and of the rises of the adhesion; None for infinity."""
    times = list(chain.from_iterable(of_runs))
    medians = (float(np.median(some)) if some else np.inf for some in (times[::2], times[1::2]))
    return [middle if np.isfinite(middle) else None for middle in medians]
