# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""One picture of the first run of a case: what was so, and what the train knew of it when."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.patches import Patch

from ...core.physics.train import KMH
from ...report.drawn.picture import BLACK, BLUE, GREY, ORANGE, SHADES
from ..trial.drawing import draw_cases, panels
from ..trial.figures import Figures
from ..trial.score import TWO_SIDED_95
from ..trial.trials import Rows
from .cases import Case
from .trials import Found

BEFORE_S = 5.0
"""Time before the full brake with which a picture begins."""


def draw_all(table: Sequence[Mapping[str, Any]], figures: Figures) -> None:
    """Draw error and bound of every case, with their goals: all_error, all_bound."""
    names, runs = [row["case"] for row in table], table[0]["runs"] if table else 0
    for figure, unit, end, factor in (
        ("error_percent", "mean relative error of μ̂, %", 1, 1.0),
        ("bound_kept", "lower bound kept, % of the estimates", 0, 100.0),
    ):
        columns = {
            "mean of the runs": [_times(row[figure], factor) for row in table],
            "worst run": [_times(row[f"{figure}_worst"], factor) for row in table],
            "goal": [_times(row["goals"].get(figure, [None, None])[end], factor) for row in table],
        }
        title = f"On trains with wheels: {unit}; N = {runs} runs of each case"
        draw_cases(figures.place(f"all_{figure.split('_')[0]}"), title, unit, names, columns)


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def draw(case: Case, found: Found, figures: Figures) -> None:
    """Draw the first run: SCENARIO-SENSORS."""
    of_run = found.of_seed(int(found.runs["seed"][0]))
    (run,) = of_run.runs
    rows = of_run.rows[(of_run.rows["out_s"] >= run["full_s"] - BEFORE_S) & (of_run.rows["t_s"] <= run["slow_s"])]
    title = f"{case.name.replace('_', ' ')}: the train knew at each time what came out by then (seed {run['seed']})"
    with panels(figures.place(case.name.replace(" ", "-")), title, 3) as axes:
        for axis, what in zip(axes, (_adhesion, _way, _speed), strict=True):
            what(axis, rows)
            for since_s, until_s, regime in _bands(rows):
                axis.axvspan(since_s, until_s, color=SHADES.get(regime, "1.0"), lw=0, zorder=0)
            for border in of_run.borders:
                axis.axvline(border["start_s"], color="0.6", lw=0.8)
            axis.axvline(run["full_s"], color=BLACK, ls="--", lw=0.8)
            axis.set(xlabel="time, s", xlim=(run["full_s"] - BEFORE_S, run["slow_s"]))
            axis.set_ylim(bottom=0.0)
            axis.legend(loc="best", fontsize="small", ncols=2)
        shades = [Patch(color=color, label=name.replace("_", "-").lower()) for name, color in SHADES.items()]
        axes[1].add_artist(axes[1].legend(handles=shades, loc="center right", fontsize="x-small", title="claimed"))
        axes[1].legend(loc="upper right", fontsize="small")


def _adhesion(axis: Any, rows: Rows) -> None:
    told, spread = rows["out_s"], TWO_SIDED_95 * rows["std"]
    low, high = np.maximum(rows["mu"] - spread, 0.0), rows["mu"] + spread
    axis.fill_between(told, low, high, color=ORANGE, alpha=0.2, lw=0, step="post", label="95 % interval")
    axis.plot(rows["t_s"], rows["available"], color=GREY, ls=":", label="available")
    axis.plot(rows["t_s"], rows["used"], color=BLACK, lw=2, label="used")
    mu = np.where(rows["withheld"], np.nan, rows["mu"])
    axis.plot(told, mu, color=ORANGE, marker=".", ms=3, lw=1, drawstyle="steps-post", label="estimated")
    axis.plot(told, rows["lower"], color=BLUE, ls="--", drawstyle="steps-post", label="lower bound")
    axis.set(ylabel="adhesion")
    axis.set_ylim(top=1.6 * float(np.max(rows["used"], initial=0.02)))


def _way(axis: Any, rows: Rows) -> None:
    axis.plot(rows["t_s"], rows["remaining_m"], color=BLACK, lw=2, label="way to the standstill")
    axis.plot(rows["out_s"], rows["safe_m"], color=BLUE, ls="--", drawstyle="steps-post", label="safe curve")
    axis.set(ylabel="way, m")
    longest = float(np.nanmax(rows["remaining_m"], initial=1.0))
    axis.set_ylim(top=2.5 * longest)


def _speed(axis: Any, rows: Rows) -> None:
    off, std = (rows["speed_mps"] - rows["true_speed_mps"]) / KMH, rows["speed_std_mps"] / KMH
    axis.plot(rows["t_s"], np.abs(off), color=ORANGE, label="error of the speed")
    axis.plot(rows["t_s"], 3.0 * std, color=BLUE, ls="--", label="3 of its standard deviations")
    axis.set(ylabel="speed, km/h")


def _bands(rows: Rows) -> list[tuple[float, float, str]]:
    """When which regime was claimed: since, until, its name."""
    regimes, times = rows["regime"], rows["out_s"]
    starts = [index for index in range(rows.size) if index == 0 or regimes[index] != regimes[index - 1]]
    ends = [*starts[1:], rows.size - 1]
    return [(times[start], times[end], str(regimes[start])) for start, end in zip(starts, ends, strict=False)]
