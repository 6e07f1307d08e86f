# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Counterparts of Figs. 4-9 and 14-19: adhesion, its error and its relative error over speed, from every start."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core.physics.train import KMH
from ..trial.drawing import STYLES, panels
from ..trial.score import relative_percent
from ..trial.trials import Results, Rows, each_trial

FIRST_FIGURES = {"tunnel_entry": {"particle_em": 4, "ekf": 7}, "tunnel_exit": {"particle_em": 14, "ekf": 17}}
"""Number of the first of three figures in the paper."""


class Quantity(NamedTuple):
    """What a figure shows over speed."""

    name: str
    label: str
    of: Callable[[Rows], Any]


QUANTITIES = (
    Quantity("estimate", "adhesion coefficient", lambda rows: rows["mu"]),
    Quantity("error", "error of the adhesion coefficient", lambda rows: rows["mu"] - rows["true_mu"]),
    Quantity("relative_error", "relative error, %", relative_percent),
)


def draw_all(cells: Mapping[tuple[str, str], Results], folder: Path) -> None:
    """Draw twelve pictures of scenarios and methods into a folder: figNN_scenario_method_quantity.png."""
    folder.mkdir(parents=True, exist_ok=True)
    for scenario, methods in FIRST_FIGURES.items():
        for family, first in methods.items():
            shown = {
                method: found for (of, method), found in cells.items() if of == scenario and method.startswith(family)
            }
            for number, quantity in enumerate(QUANTITIES, first):
                file = f"fig{number:02}_{scenario}_{family}_{quantity.name}.png"
                _draw(shown, quantity, folder / file, f"Fig. {number}: {scenario}, {quantity.label}")


def _draw(shown: Mapping[str, Results], quantity: Quantity, path: Path, title: str) -> None:
    with panels(path, title, len(shown)) as axes:
        for axis, (method, found) in zip(axes, shown.items(), strict=True):
            _draw_method(axis, found, quantity)
            axis.set(title=method, xlabel="speed, km/h", ylabel=quantity.label)
            axis.invert_xaxis()
            axis.legend(loc="best", fontsize="small", ncols=2)


def _draw_method(axis: Any, found: Results, quantity: Quantity) -> None:
    """The first run from every start, the band that holds 90 % of the runs, and where the brake begins to limit."""
    axis.fill_between(*_band(found, quantity), color="0.88", label="5-95 % of all runs")
    of_first_seed = [rows for rows in each_trial(found.rows) if rows["seed"][0] == found.rows["seed"][0]]
    first = of_first_seed[0]
    brake_limits = first["true_speed_mps"][first["limited"]].min() / KMH
    axis.axvline(brake_limits, color="0.6", lw=1.0, label="below this speed the brake limits")
    if quantity.name == "estimate":
        axis.plot(first["true_speed_mps"] / KMH, first["true_mu"], color="0.0", lw=3, alpha=0.35, label="true")
    for rows, (color, dashes) in zip(of_first_seed, STYLES, strict=True):
        label = f"start {rows['start'][0]:g}"
        axis.plot(rows["true_speed_mps"] / KMH, quantity.of(rows), color=color, ls=dashes, lw=1.3, label=label)


def _band(found: Results, quantity: Quantity) -> tuple[Any, Any, Any]:
    """Speed and the 5 % and 95 % quantiles over all runs and starts at each time that most of them reach."""
    values = quantity.of(found.rows)
    times, counts = np.unique(found.rows["t_ns"], return_counts=True)
    at_times = [found.rows["t_ns"] == time for time in times[counts >= 0.9 * len(found.runs)]]
    speed = [found.rows["true_speed_mps"][at].mean() / KMH for at in at_times]
    low, high = np.array([np.percentile(values[at], (5, 95)) for at in at_times]).T
    return speed, low, high
