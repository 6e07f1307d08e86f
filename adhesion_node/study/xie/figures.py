# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Counterparts of the figures of Xie et al. 2019.

Figs. 2, 3, 10-13, 20 and 21: the rail, the forces, the brakings without noise. Figs. 4-9 and 14-19: the adhesion, its
error and its relative error over speed, from every start.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from ...core.physics import braking
from ...core.physics.adhesion import DRY, WET
from ...core.physics.train import CRH3, KMH, Array
from ..trial.drawing import NAMES, STYLES, draw_lines, panels, picture
from ..trial.figures import Figures, Place
from ..trial.score import relative_percent
from ..trial.trials import Results, Rows, each_trial
from .published import BRAKING_CASES


class Scene(NamedTuple):
    """A braking of the paper, from a dry onto a wet rail."""

    scenario: str
    way: str
    from_kmh: float
    to_kmh: float
    rail_figure: int
    """Number of the figure of the adhesion; the next one shows the forces."""
    braking_figure: int
    """Number of the figure of the distance; the next one shows the time."""


SCENES = (
    Scene("tunnel_entry", "dry line to wet tunnel", 300, 100, 2, 10),
    Scene("tunnel_exit", "dry tunnel to wet line", 250, 50, 12, 20),
)


def draw_brakings(figures: Figures) -> None:
    """Draw eight pictures: figNN_scenario_what."""
    for scene in SCENES:
        _draw_rail(scene, figures)
        _draw_forces(scene, figures)
        _draw_ends(scene, "distance", "m", scene.braking_figure, figures)
        _draw_ends(scene, "time", "s", scene.braking_figure + 1, figures)


def rail(scene: Scene) -> tuple[Array, Array]:
    """Speeds, km/h, falling, and the adhesion there; the first is still that of the dry rail."""
    speeds = np.linspace(scene.from_kmh, scene.to_kmh, 401)
    return np.append(speeds[0], speeds), np.append(DRY(speeds[:1] * KMH), WET(speeds * KMH))


def _draw_rail(scene: Scene, figures: Figures) -> None:
    speeds, adhesion = rail(scene)
    with picture(*_named(scene, scene.rail_figure, "adhesion", figures)) as axis:
        axis.plot(speeds, adhesion, color="0.0", lw=1.8)
        for index, side, offset in ((0, "left", (6, -4)), (1, "left", (6, -14)), (-1, "right", (0, 6))):
            place = speeds[index], adhesion[index]
            axis.annotate(f"{adhesion[index]:.4f}", place, offset, textcoords="offset points", ha=side)
        axis.set(xlabel="speed, km/h", ylabel="adhesion coefficient", ylim=(0.0, 0.18))
        axis.invert_xaxis()


def _draw_forces(scene: Scene, figures: Figures) -> None:
    speeds, adhesion = rail(scene)
    brake = np.full_like(speeds, CRH3.brake_force(CRH3.full_pressure_pa))
    forces = {"air brake": 1e-3 * brake, "adhesion": 1e-3 * CRH3.adhesion_force(adhesion)}
    with picture(*_named(scene, scene.rail_figure + 1, "forces", figures)) as axis:
        draw_lines(axis, speeds, forces)
        axis.set(xlabel="speed, km/h", ylabel="force, kN", ylim=(0.0, 1000.0))
        axis.invert_xaxis()
        axis.legend(loc="upper right")


def _draw_ends(scene: Scene, along: str, unit: str, number: int, figures: Figures) -> None:
    """Speed over distance or time for each adhesion; a cross where the paper's braking ended."""
    cases = [case for case in BRAKING_CASES if case[:2] == (scene.from_kmh, scene.to_kmh)]
    quantity = f"{along}_{unit}"
    with picture(*_named(scene, number, along, figures)) as axis:
        for (color, dashes), case in zip(STYLES, cases, strict=False):
            curve = braking.curve(CRH3, case.from_kmh * KMH, case.mu, case.to_kmh * KMH)
            values, paper = getattr(curve, quantity), getattr(case, quantity)
            label = f"{case.case}: {values[-1]:.1f} {unit}, paper {paper:.1f} {unit}"
            axis.plot(values, curve.speed_mps / KMH, color=color, ls=dashes, lw=1.8, label=label)
            axis.plot(paper, case.to_kmh, color=color, marker="x", ms=9, mew=2, ls="")
        axis.plot([], [], color="0.3", marker="x", ms=9, mew=2, ls="", label="end of the paper's braking")
        axis.set(xlabel=f"{along}, {unit}", ylabel="speed, km/h", ylim=(0.0, 1.05 * scene.from_kmh))
        axis.set_xlim(left=0.0)
        axis.legend(loc="lower left", title="adhesion", fontsize="small", title_fontsize="small")


def _named(scene: Scene, number: int, what: str, figures: Figures) -> tuple[Place, str]:
    """Place and title of a picture."""
    title = f"Fig. {number}: {scene.way}, {scene.from_kmh:g} to {scene.to_kmh:g} km/h, {what}"
    return figures.place(f"fig{number:02}_{scene.scenario}_{what}"), title


FIRST_FIGURES = {"tunnel_entry": {"particle_em": 4, "ekf": 7}, "tunnel_exit": {"particle_em": 14, "ekf": 17}}
"""Number of the first of three figures in the paper."""

BESIDE = ("bank", "rail_condition")
"""Methods that every one of them shows, too."""

SCENE_OF = {scene.scenario: scene for scene in SCENES}


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


def draw_estimates(cells: Mapping[tuple[str, str], Results], figures: Figures) -> None:
    """Draw twelve pictures of scenarios and methods: figNN_scenario_method_quantity."""
    for scenario, methods in FIRST_FIGURES.items():
        for family, first in methods.items():
            shown = {
                method: found
                for (of, method), found in cells.items()
                if of == scenario and (method in BESIDE or method.startswith(family))
            }
            way, some = SCENE_OF[scenario].way, next(iter(shown.values()))
            seeds, starts = (np.unique(some.rows[name]).size for name in ("seed", "start"))
            count = f"N = {seeds} runs from each of {starts} starts"
            for number, quantity in enumerate(QUANTITIES, first):
                place = figures.place(f"fig{number:02}_{scenario}_{family}_{quantity.name}")
                _draw(shown, quantity, place, f"Fig. {number}: {way}, {quantity.label}; {count}")


def _draw(shown: Mapping[str, Results], quantity: Quantity, place: Place, title: str) -> None:
    with panels(place, title, len(shown)) as axes:
        for axis, (method, found) in zip(axes, shown.items(), strict=True):
            _draw_method(axis, found, quantity)
            axis.set(title=NAMES[method], xlabel="speed, km/h", ylabel=quantity.label)
            axis.invert_xaxis()
            axis.legend(loc="best", fontsize="small", ncols=2)


def _draw_method(axis: Any, found: Results, quantity: Quantity) -> None:
    """The first run from every start, the band that holds 90 % of the runs, and where the brake begins to limit."""
    axis.fill_between(*_band(found, quantity), color="0.88", label="5 to 95 % of all runs")
    of_first_seed = [rows for rows in each_trial(found.rows) if rows["seed"][0] == found.rows["seed"][0]]
    first = of_first_seed[0]
    brake_limits = first["true_speed_mps"][first["limited"]].min() / KMH
    axis.axvline(brake_limits, color="0.6", lw=1.0, label="below this speed the brake limits")
    if quantity.name == "estimate":
        axis.plot(first["true_speed_mps"] / KMH, first["true_mu"], color="0.0", lw=3, alpha=0.35, label="true")
    alike: dict[bytes, list[Rows]] = {}  # but for rounding, a method that needs no start gives the same from all
    for rows in of_first_seed:
        alike.setdefault(np.round(rows["mu"], 6).tobytes(), []).append(rows)
    for same, (color, dashes) in zip(alike.values(), STYLES, strict=False):
        starts = ", ".join(f"{rows['start'][0]:g}" for rows in same)
        label = "one run, any start" if len(alike) == 1 else f"start {starts}"
        axis.plot(same[0]["true_speed_mps"] / KMH, quantity.of(same[0]), color=color, ls=dashes, lw=1.1, label=label)


def _band(found: Results, quantity: Quantity) -> tuple[Any, Any, Any]:
    """Speed and the 5 % and 95 % quantiles over all runs and starts at each time that most of them reach."""
    values = quantity.of(found.rows)
    times, counts = np.unique(found.rows["t_ns"], return_counts=True)
    at_times = [found.rows["t_ns"] == time for time in times[counts >= 0.9 * len(found.runs)]]
    speed = [found.rows["true_speed_mps"][at].mean() / KMH for at in at_times]
    low, high = np.array([np.percentile(values[at], (5, 95)) for at in at_times]).T
    return speed, low, high
