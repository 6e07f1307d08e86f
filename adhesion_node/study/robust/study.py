# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""`study robust`: the default method where rail, sensors or train are not what it believes, and under faults.

Every figure of the first table stands beside that of tunnel_entry without a fault. *Bound*: estimates under the brake
whose lower bound is not above the true adhesion; *claimed*: those that claim to observe the adhesion although the
brake limits. The rail changes in low_adhesion_patch only: *found* after, and error again below 10 % after, the fall
and the rise. The second table, from the beginning of each fault on: *B* is the same run without it; *cover*: of the
90 % interval; *safe curve*: safe braking curves that are not shorter than the true distance to a standstill; *to B*:
largest difference after a full window; *rail*: changes of the rail told in all runs, of which none is true; *again*:
longest time from the end of the fault to a full window.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_node.train.sensors import SensorSettings

from ...command.options import DONE, report
from ...core import Config
from ..trial.accuracy import TWO_SIDED_95
from ..trial.running import Running, add_running_options, run_all, running
from ..trial.runs import FIRST_SEED
from . import faults
from .runs import Case, Runs

CHUNK = 10
"""Seeds in a task."""

AGAIN = 0.1
"""Relative error below which the estimate counts as good again after a change."""

PAPER = Config(method="particle_em", step=10)
GAUSSIAN = Config(tail_dof=0.0)
WHEELS = SensorSettings(wheel_speed_std_radps=0.05)
TAILS = SensorSettings(student_dof=3.0)
OUTLIERS = SensorSettings(outlier_fraction=0.05)

CASES = (
    Case("as believed", "tunnel_entry"),
    Case("constant adhesion 0.07", "constant_adhesion"),
    Case("snow", "snow"),
    Case("0.8 x wet", "scaled_wet"),
    Case("5 % outliers of 20 m", "tunnel_entry", OUTLIERS),
    Case("Student t, 3 degrees of freedom", "tunnel_entry", TAILS),
    Case("Student t, 2 degrees of freedom", "tunnel_entry", SensorSettings(student_dof=2.0)),
    Case("30 % of the positions lost", "tunnel_entry", SensorSettings(dropout_fraction=0.3)),
    Case("patch of 0.45 x wet", "low_adhesion_patch"),
    Case("steady braking for minutes", "long_braking"),
    Case("dry rail, the brake limits", "dry_braking"),
    Case("brake at 60 %", "weak_brake"),
    Case("brake at 60 %, wheel speeds", "weak_brake", WHEELS),
    Case("5 ‰ downhill, unknown", "grade_unknown", knows_track=False),
    Case("the same, grade_std 0.003", "grade_unknown", config=Config(grade_std=0.003), knows_track=False),
    Case("10 % heavier", "overweight"),
    Case("tunnel unknown", "tunnel_entry", knows_track=False),
    Case("Gaussian weights: as believed", "tunnel_entry", config=GAUSSIAN),
    Case("Gaussian weights: Student t, 3", "tunnel_entry", TAILS, GAUSSIAN),
    Case("particles: as believed", "tunnel_entry", config=PAPER),
    Case("particles: 5 % outliers", "tunnel_entry", OUTLIERS, PAPER),
    Case("particles: Student t, 3", "tunnel_entry", TAILS, PAPER),
    Case("particles: patch", "low_adhesion_patch", config=PAPER),
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `study robust`."""
    parser.add_argument("--runs", type=int, default=40, help="runs of each case (default %(default)s)")
    parser.add_argument("--only", choices=TABLES, help="one of the tables")
    add_running_options(parser)


def run(options: argparse.Namespace) -> int:
    """Run what is missing and print a line per case."""
    if options.runs < 1:
        raise ValueError(f"runs = {options.runs}: give at least 1")
    wanted = {name: TABLES[name] for name in ([options.only] if options.only else TABLES)}
    rows = {name: table(options.runs, running(options)) for name, (table, _) in wanted.items()}
    texts = ["\n".join(lines(rows[name])) for name, (_, lines) in wanted.items()]
    report(options.json, [entry for of_table in rows.values() for entry in of_table], "\n\n".join(texts))
    return DONE


def rails(runs: int, where: Running) -> list[dict[str, Any]]:
    """Run what is missing; a row per rail, sensor or train."""
    wanted = [[Runs(case, FIRST_SEED + first, count) for first, count in _chunks(case, runs)] for case in CASES]
    found = iter(run_all([task for tasks in wanted for task in tasks], where))
    by_case = [np.concatenate([next(found)["rows"] for _ in tasks]) for tasks in wanted]
    table = [row(case, rows) for case, rows in zip(CASES, by_case, strict=True)]
    clean = table[0]["mean_relative_error_percent"]
    return [entry | {"ratio_to_clean": _ratio(entry["mean_relative_error_percent"], clean)} for entry in table]


def _chunks(case: Case, runs: int) -> list[tuple[int, int]]:
    """First run and number of runs of each task; the paper's method, which takes its time, does with one task."""
    runs = min(runs, CHUNK) if case.config.method == PAPER.method else runs
    return [(first, min(CHUNK, runs - first)) for first in range(0, runs, CHUNK)]


def row(case: Case, rows: NDArray[np.void]) -> dict[str, Any]:
    """Figures of a case; None where the case has nothing to say of one."""
    runs = [rows[rows["run"] == seed] for seed in np.unique(rows["run"])]
    scored = rows[rows["scored"]]
    errors = [float(np.mean(_relative(own[own["scored"]]))) for own in runs if np.any(own["scored"])]
    hours = sum(float(own["t_s"][-1] - own["t_s"][0]) for own in runs) / 3600.0
    changes = sum(int(own["changes"][-1]) for own in runs)
    found = [entry for own in runs for entry in after_changes(own)]
    inside = np.abs(scored["mu"] - scored["true_mu"]) <= TWO_SIDED_95 * scored["std"]
    return {
        "table": "rails",
        "case": case.name,
        "scenario": case.scenario,
        "method": case.config.method,
        "runs": len(runs),
        "mean_relative_error_percent": 100.0 * float(np.mean(errors)) if errors else None,
        "std_relative_error_percent": 100.0 * float(np.std(errors)) if errors else None,
        "coverage95": float(np.mean(inside)) if scored.size else None,
        "lower_bound_holds": float(np.mean(rows["lower"] <= rows["true_mu"])),
        "claimed_while_the_brake_limits": _share(rows["claimed"], ~rows["limited"]),
        "changes_per_hour": None if found else changes / hours,
        "found_s": [_median([entry[0] for entry in found[which::2]]) for which in (0, 1)] if found else None,
        "again_s": [_median([entry[1] for entry in found[which::2]]) for which in (0, 1)] if found else None,
    }


def after_changes(rows: NDArray[np.void]) -> list[tuple[float, float]]:
    """Of every true change of the rail in a run: time until it is found and until the error stays below `AGAIN`, s.

    Infinite where it is not found before the next one.
    """
    jumps = np.flatnonzero(np.abs(np.diff(np.log(rows["true_mu"]))) > AGAIN) + 1
    ends = [*jumps[1:], *([rows.size] if jumps.size else [])]
    entries = []
    for start, end in zip(jumps, ends, strict=True):
        part, began = rows[start:end], rows["t_s"][start - 1]
        found = part["t_s"][part["changes"] > rows["changes"][start - 1]]
        bad = part["t_s"][part["limited"] & (_relative(part) > AGAIN)]
        entries.append((float(found[0] - began) if found.size else np.inf, float(bad[-1] - began) if bad.size else 0.0))
    return entries


def _relative(rows: NDArray[np.void]) -> NDArray[np.float64]:
    result: NDArray[np.float64] = np.abs(rows["mu"] / rows["true_mu"] - 1.0)
    return result


def _share(what: NDArray[np.bool_], among: NDArray[np.bool_]) -> float | None:
    return float(np.mean(what[among])) if np.any(among) else None


def _median(values: Sequence[float]) -> float | None:
    middle = float(np.median(values)) if values else np.inf
    return middle if np.isfinite(middle) else None


def _ratio(value: float | None, clean: float) -> float | None:
    return None if value is None else value / clean


def _lines(table: Sequence[dict[str, Any]]) -> Iterator[str]:
    yield (
        f"{'case':>32} {'error %':>13} {'ratio':>6} {'cover':>6} {'bound':>6} {'claimed':>7} {'changes/h':>9}"
        "  found after s, below 10 % again after s"
    )
    for entry in table:
        error = _text(entry["mean_relative_error_percent"], ".2f")
        spread = _text(entry["std_relative_error_percent"], ".2f")
        changes = [
            f"{_text(found, '.1f')}, {_text(again, '.1f')}"
            for found, again in zip(entry["found_s"] or (), entry["again_s"] or (), strict=True)
        ]
        yield (
            f"{entry['case']:>32} {error:>5} ± {spread:>5} {_text(entry['ratio_to_clean'], '.2f'):>6}"
            f" {_text(entry['coverage95'], '.3f'):>6} {_text(entry['lower_bound_holds'], '.3f'):>6}"
            f" {_text(entry['claimed_while_the_brake_limits'], '.3f'):>7} {_text(entry['changes_per_hour'], '.2f'):>9}"
            f"  {'; '.join(changes)}"
        )


def _text(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"


TABLES = {"rails": (rails, _lines), "faults": (faults.table, faults.lines)}
"""By name: what computes the rows of a table, and what shows them."""
