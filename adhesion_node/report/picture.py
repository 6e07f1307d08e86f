"""One picture of a recorded run: adhesion with its bound, speed, forces and what braking distance follows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..core.train import CRH3, KMH, Array, Train
from ..reading import ATMOSPHERE_PA
from .run import FIXED_MU, Run, distance_to_target
from .series import Series

SHADES = {"COASTING": "0.93", "BRAKE_LIMITED": "#dbe9f6", "ADHESION_LIMITED": "#fdebd0"}
BLACK, BLUE, ORANGE, GREY = "#000000", "#0b5fa5", "#c75b00", "0.45"


def draw(run: Run, path: Path, title: str, target_kmh: float, train: Train = CRH3) -> None:
    """Draw the run into a PNG (or what the file's ending says), readable in black and white."""
    figure = Figure(figsize=(11, 9), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    axes = figure.subplots(2, 2, sharex=True)
    origin_ns = int(min(run.speed.t_ns[0], run.true_speed.t_ns[0] if run.true_speed.t_ns.size else run.speed.t_ns[0]))
    _draw_adhesion(axes[0, 0], run, origin_ns)
    _draw_speed(axes[0, 1], run, origin_ns)
    _draw_forces(axes[1, 0], run, origin_ns, train)
    _draw_distance(axes[1, 1], run, origin_ns, target_kmh * KMH, train)
    for axis in axes.flat:
        _shade(axis, run.regime, origin_ns)
        axis.grid(alpha=0.3)
        axis.set_ylim(bottom=0.0)
        axis.legend(loc="best", fontsize="small")
    for axis in axes[1]:
        axis.set_xlabel("time, s")
    names = [regime.replace("_", "-").lower() for regime in SHADES]
    shades = [Patch(color=color) for color in SHADES.values()]
    figure.legend(shades, names, loc="outside lower center", ncols=len(names), title="what limits the motion")
    figure.savefig(path, dpi=110)


def _seconds(t_ns: Any, origin_ns: int) -> Array:
    return np.asarray((t_ns - origin_ns) * 1e-9, dtype=np.float64)


def _draw_adhesion(axis: Any, run: Run, origin_ns: int) -> None:
    if run.true_mu.t_ns.size:
        axis.plot(_seconds(run.true_mu.t_ns, origin_ns), run.true_mu.values, color=BLACK, label="true", lw=2)
    axis.plot(_seconds(run.mu.t_ns, origin_ns), run.mu.values, color=ORANGE, label="identified", marker=".", lw=1)
    axis.plot(_seconds(run.mu_lower.t_ns, origin_ns), run.mu_lower.values, color=BLUE, ls="--", label="its lower bound")
    axis.set_ylabel("adhesion coefficient")


def _draw_speed(axis: Any, run: Run, origin_ns: int) -> None:
    if run.true_speed.t_ns.size:
        axis.plot(
            _seconds(run.true_speed.t_ns, origin_ns), run.true_speed.values / KMH, color=BLACK, label="true", lw=2
        )
    axis.plot(
        _seconds(run.speed.t_ns, origin_ns), run.speed.values / KMH, color=ORANGE, label="estimated", marker=".", lw=0
    )
    axis.set_ylabel("speed, km/h")


def _draw_forces(axis: Any, run: Run, origin_ns: int, train: Train) -> None:
    brake = train.brake_force(run.pressure.values - ATMOSPHERE_PA) / 1e3
    axis.plot(_seconds(run.pressure.t_ns, origin_ns), brake, color=GREY, ls=":", lw=2, label="brake B")
    if run.true_mu.t_ns.size:
        true = train.adhesion_force(run.true_mu.values) / 1e3
        axis.plot(_seconds(run.true_mu.t_ns, origin_ns), true, color=BLACK, label="adhesion F, true", lw=2)
    identified = train.adhesion_force(run.mu.values) / 1e3
    axis.plot(
        _seconds(run.mu.t_ns, origin_ns), identified, color=ORANGE, marker=".", lw=1, label="adhesion F, identified"
    )
    axis.set_ylabel("force, kN")


def _draw_distance(axis: Any, run: Run, origin_ns: int, target_mps: float, train: Train) -> None:
    seconds = _seconds(run.speed.t_ns, origin_ns)
    for mu, color, style, label in (
        (FIXED_MU, GREY, ":", f"fixed worst case {FIXED_MU}"),
        (run.mu_lower.at(run.speed.t_ns), BLUE, "--", "lower bound of mu (safe curve)"),
        (run.mu.at(run.speed.t_ns), ORANGE, "-", "identified mu"),
    ):
        axis.plot(seconds, distance_to_target(run, mu, target_mps, train), color=color, ls=style, label=label)
    axis.set_ylabel(f"braking distance to {target_mps / KMH:.0f} km/h, m")


def _shade(axis: Any, regime: Series, origin_ns: int) -> None:
    seconds = _seconds(regime.t_ns, origin_ns)
    starts = np.concatenate(([0.0], seconds))
    for begin, end, name in zip(starts[:-1], seconds, regime.values, strict=True):
        if name in SHADES:
            axis.axvspan(begin, end, color=SHADES[name], lw=0, zorder=0)
