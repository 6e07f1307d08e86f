# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Counterparts of Figs. 2, 3, 10-13, 20 and 21 of Xie et al. 2019: the rail, the forces, the brakings without noise."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core.physics import braking
from ...core.physics.adhesion import DRY, WET
from ...core.physics.train import CRH3, KMH, Array
from ..trial.drawing import STYLES, draw_lines, picture
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


def draw_all(folder: Path) -> None:
    """Draw eight pictures into a folder, made when missing: figNN_scenario_what.png."""
    folder.mkdir(parents=True, exist_ok=True)
    for scene in SCENES:
        _draw_rail(scene, folder)
        _draw_forces(scene, folder)
        _draw_brakings(scene, "distance", "m", scene.braking_figure, folder)
        _draw_brakings(scene, "time", "s", scene.braking_figure + 1, folder)


def rail(scene: Scene) -> tuple[Array, Array]:
    """Speeds, km/h, falling, and the adhesion there; the first is still that of the dry rail."""
    speeds = np.linspace(scene.from_kmh, scene.to_kmh, 401)
    return np.append(speeds[0], speeds), np.append(DRY(speeds[:1] * KMH), WET(speeds * KMH))


def _draw_rail(scene: Scene, folder: Path) -> None:
    speeds, adhesion = rail(scene)
    with picture(*_named(scene, scene.rail_figure, "adhesion", folder)) as axis:
        axis.plot(speeds, adhesion, color="0.0", lw=1.8)
        for index, side, offset in ((0, "left", (6, -4)), (1, "left", (6, -14)), (-1, "right", (0, 6))):
            place = speeds[index], adhesion[index]
            axis.annotate(f"{adhesion[index]:.4f}", place, offset, textcoords="offset points", ha=side)
        axis.set(xlabel="speed, km/h", ylabel="adhesion coefficient", ylim=(0.0, 0.18))
        axis.invert_xaxis()


def _draw_forces(scene: Scene, folder: Path) -> None:
    speeds, adhesion = rail(scene)
    brake = np.full_like(speeds, CRH3.brake_force(CRH3.full_pressure_pa))
    forces = {"air brake": 1e-3 * brake, "adhesion": 1e-3 * CRH3.adhesion_force(adhesion)}
    with picture(*_named(scene, scene.rail_figure + 1, "forces", folder)) as axis:
        draw_lines(axis, speeds, forces)
        axis.set(xlabel="speed, km/h", ylabel="force, kN", ylim=(0.0, 1000.0))
        axis.invert_xaxis()
        axis.legend(loc="upper right")


def _draw_brakings(scene: Scene, along: str, unit: str, number: int, folder: Path) -> None:
    """Speed over distance or time for each adhesion; a cross where the paper's braking ended."""
    cases = [case for case in BRAKING_CASES if case[:2] == (scene.from_kmh, scene.to_kmh)]
    quantity = f"{along}_{unit}"
    with picture(*_named(scene, number, along, folder)) as axis:
        for (color, dashes), case in zip(STYLES, cases, strict=False):
            curve = braking.curve(CRH3, case.from_kmh * KMH, case.mu, case.to_kmh * KMH)
            values, paper = getattr(curve, quantity), getattr(case, quantity)
            label = f"{case.case}: {values[-1]:.1f} {unit}, paper {paper:.1f} {unit}"
            axis.plot(values, curve.speed_mps / KMH, color=color, ls=dashes, lw=1.8, label=label)
            axis.plot(paper, case.to_kmh, color=color, marker="x", ms=9, mew=2, ls="")
        axis.plot([], [], color="0.3", marker="x", ms=9, mew=2, ls="", label="end of the paper's braking")
        axis.set(xlabel=f"{along}, {unit}", ylabel="speed, km/h", ylim=(0.0, 1.05 * scene.from_kmh))
        axis.set_xlim(left=0.0)
        axis.legend(loc="lower left", title="adhesion")


def _named(scene: Scene, number: int, what: str, folder: Path) -> tuple[Path, str]:
    """Path and title of a picture."""
    title = f"Fig. {number}: {scene.way}, {scene.from_kmh:g} to {scene.to_kmh:g} km/h, {what}"
    return folder / f"fig{number:02}_{scene.scenario}_{what}.png", title
