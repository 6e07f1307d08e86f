# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The second table of `study robust`: faults of sensors, messages, clock and train, each beside the run without it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..trial.running import Running, run_all
from ..trial.runs import FIRST_SEED
from ..trial.tasks import Arrays
from .fault_cases import CASES, Case
from .fault_rows import figures
from .fault_runs import Runs

CHUNK = 10
"""Seeds in a task."""


def table(runs: int, where: Running) -> list[dict[str, Any]]:
    """Run what is missing; a row per fault."""
    wanted = {case: _tasks(case, runs) for case in dict.fromkeys((*(case.without for case in CASES), *CASES))}
    results = run_all([task for tasks in wanted.values() for task in tasks], where)
    found = {case: _together([next(results) for _ in tasks]) for case, tasks in wanted.items()}
    return [figures(case, found[case], found[case.without]) for case in CASES]


def _tasks(case: Case, runs: int) -> list[Runs]:
    return [Runs(case, FIRST_SEED + first, min(CHUNK, runs - first)) for first in range(0, runs, CHUNK)]


def _together(parts: Sequence[Arrays]) -> Arrays:
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def lines(rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    """The table for people."""
    yield (
        f"{'fault':>32} {'error %':>7} {'B':>5} {'ratio':>5} {'cover':>5} {'bound':>6}"
        f" {'safe curve':>10} {'to B, std':>9} {'rail':>4} {'again s':>7}  dropped in a run, from s on"
    )
    for row in rows:
        cells = (
            _text(row["mean_relative_error_percent"], "7.2f"),
            _text(row["b_mean_relative_error_percent"], "5.2f"),
            _text(row["ratio_to_b"], "5.2f"),
            _text(row["coverage90"], "5.2f"),
            _text(row["lower_bound_holds"], "6.3f"),
            _text(row["safe_curve_holds"], "10.3f"),
            _text(row["largest_difference_std"], "9.1f"),
            f"{row['rail_changes']:4}",
            _text(row["full_window_again_s"], "7.1f"),
        )
        told = row["told_s"]
        dropped = [f"{reason} {count:.0f} ({told[reason]:.1f})" for reason, count in row["dropped"].items()]
        yield f"{row['case']:>32} {' '.join(cells)}  {', '.join(dropped) or '-'}"


def _text(value: float | None, form: str) -> str:
    return f"{'-':>{form.partition('.')[0]}}" if value is None else f"{value:{form}}"
