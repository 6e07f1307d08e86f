# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Counterparts of Figs. 4-9 and 14-19: adhesion, its error and its relative error over speed, from every start."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.physics.train import KMH
from ..trial.drawing import STYLES, panels
from .methods import STARTS

if TYPE_CHECKING:
    from .tables import Cell

FIRST_FIGURES = {"tunnel_entry": {"particle_em": 4, "ekf": 7}, "tunnel_exit": {"particle_em": 14, "ekf": 17}}
"""Number of the first of three figures in the paper."""


class Quantity(NamedTuple):
    """What a figure shows over speed."""

    name: str
    label: str
    of: Callable[[NDArray[np.void]], Any]


QUANTITIES = (
    Quantity("estimate", "adhesion coefficient", lambda rows: rows["mu"]),
    Quantity("error", "error of the adhesion coefficient", lambda rows: rows["mu"] - rows["true_mu"]),
    Quantity("relative_error", "relative error, %", lambda rows: 100.0 * np.abs(rows["mu"] / rows["true_mu"] - 1.0)),
)


def draw_all(cells: Sequence[Cell], folder: Path) -> None:
    """Draw twelve pictures into a folder: figNN_scenario_method_quantity.png."""
    folder.mkdir(parents=True, exist_ok=True)
    for scenario, methods in FIRST_FIGURES.items():
        for family, first in methods.items():
            shown = [cell for cell in cells if cell.scenario == scenario and cell.method.startswith(family)]
            for number, quantity in enumerate(QUANTITIES, first):
                file = f"fig{number:02}_{scenario}_{family}_{quantity.name}.png"
                _draw(shown, quantity, folder / file, f"Fig. {number}: {scenario}, {quantity.label}")


def _draw(cells: Sequence[Cell], quantity: Quantity, path: Path, title: str) -> None:
    with panels(path, title, len(cells)) as axes:
        for axis, cell in zip(axes, cells, strict=True):
            _draw_cell(axis, cell, quantity)
            axis.set(title=cell.method, xlabel="speed, km/h", ylabel=quantity.label)
            axis.invert_xaxis()
            axis.legend(loc="best", fontsize="small", ncols=2)


def _draw_cell(axis: Any, cell: Cell, quantity: Quantity) -> None:
    """The first run from every start, the band that holds 90 % of the runs, and where the brake begins to limit."""
    axis.fill_between(*_band(cell, quantity), color="0.88", label="5-95 % of all runs")
    first = cell.runs[0][0]
    brake_limits = first["speed_mps"][first["limited"]].min() / KMH
    axis.axvline(brake_limits, color="0.6", lw=1.0, label="below this speed the brake limits")
    if quantity.name == "estimate":
        axis.plot(first["speed_mps"] / KMH, first["true_mu"], color="0.0", lw=3, alpha=0.35, label="true")
    for start, runs, (color, dashes) in zip(STARTS, cell.runs, STYLES, strict=True):
        rows = runs[0]
        axis.plot(rows["speed_mps"] / KMH, quantity.of(rows), color=color, ls=dashes, lw=1.3, label=f"start {start:g}")


def _band(cell: Cell, quantity: Quantity) -> tuple[Any, Any, Any]:
    """Speed and the 5 % and 95 % quantiles over all runs and starts at each time that most of them reach."""
    together = np.concatenate([rows for of_start in cell.runs for rows in of_start])
    values, total = quantity.of(together), sum(len(of_start) for of_start in cell.runs)
    times, counts = np.unique(together["t_ns"], return_counts=True)
    at_times = [together["t_ns"] == time for time in times[counts >= 0.9 * total]]
    speed = [together["speed_mps"][at].mean() / KMH for at in at_times]
    low, high = np.array([np.percentile(values[at], (5, 95)) for at in at_times]).T
    return speed, low, high
