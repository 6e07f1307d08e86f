# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""One picture of a recorded run: adhesion with its bound, speed, forces, braking distances and braking curves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from ..core.physics.train import CRH3, KMH, Train
from ..wire.codecs import ATMOSPHERE_PA
from .findings import Distances, distances
from .run import FIXED_MU, Run, bands

SHADES = {"COASTING": "0.85", "BRAKE_LIMITED": "#d3e5f7", "ADHESION_LIMITED": "#fff1dc"}
BLACK, BLUE, ORANGE, GREY = "#000000", "#0b5fa5", "#c75b00", "0.45"

CURVES = 8
"""Braking curves drawn, evenly spread over the run."""


def draw(run: Run, path: Path, title: str, target_kmh: float, train: Train = CRH3) -> None:
    """Draw the run into a PNG or a PDF, as the file's ending says, readable in black and white."""
    figure = Figure(figsize=(11, 12), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title)
    parts: Any = figure.subfigures(2, 1, height_ratios=(20.0, 1.0))
    charts, foot = parts
    axes = charts.subplots(3, 2)
    planned = distances(run, target_kmh * KMH, train)
    _draw_adhesion(axes[0, 0], run)
    _draw_speed(axes[0, 1], run)
    _draw_forces(axes[1, 0], run, train)
    _draw_distance(axes[1, 1], run, planned, target_kmh)
    _draw_saving(axes[2, 0], run, planned, target_kmh)
    _draw_curves(axes[2, 1], run)
    for axis in axes.flat:
        axis.grid(alpha=0.3)
        axis.legend(loc="best", fontsize="small")
    for axis in axes.flat[:5]:
        _shade(axis, run)
        axis.sharex(axes[0, 0])
        axis.set_xlabel("time, s")
    for axis in (*axes.flat[:4], axes[2, 1]):
        axis.set_ylim(bottom=0.0)
    names = [regime.replace("_", "-").lower() for regime in SHADES]
    shades = [Patch(color=color) for color in SHADES.values()]
    foot.legend(shades, names, loc="center", ncols=len(names), title="what limits the motion")
    figure.savefig(path, dpi=110)


def _draw_adhesion(axis: Any, run: Run) -> None:
    axis.axhline(FIXED_MU, color=GREY, ls=":", label=f"fixed worst case {FIXED_MU}")
    if run.true_mu.t_ns.size:
        axis.plot(run.seconds(run.true_mu.t_ns), run.true_mu.values, color=BLACK, label="true", lw=2)
    axis.plot(run.seconds(run.mu.t_ns), run.mu.values, color=ORANGE, label="identified", marker=".", lw=1)
    label = "its lower bound" if run.confidence is None else f"its lower bound, {run.confidence:.0%} confidence"
    axis.plot(run.seconds(run.mu_lower.t_ns), run.mu_lower.values, color=BLUE, ls="--", label=label)
    axis.set_ylabel("adhesion coefficient")


def _draw_speed(axis: Any, run: Run) -> None:
    if run.true_speed.t_ns.size:
        axis.plot(run.seconds(run.true_speed.t_ns), run.true_speed.values / KMH, color=BLACK, label="true", lw=2)
    axis.plot(run.seconds(run.speed.t_ns), run.speed.values / KMH, color=ORANGE, label="estimated", marker=".", lw=0)
    axis.set_ylabel("speed, km/h")


def _draw_forces(axis: Any, run: Run, train: Train) -> None:
    brake = train.brake_force(run.pressure.values - ATMOSPHERE_PA) / 1e3
    axis.plot(run.seconds(run.pressure.t_ns), brake, color=GREY, ls=":", lw=2, label="brake B")
    if run.true_mu.t_ns.size:
        true = train.adhesion_force(run.true_mu.values) / 1e3
        axis.plot(run.seconds(run.true_mu.t_ns), true, color=BLACK, label="adhesion F, true", lw=2)
    identified = train.adhesion_force(run.mu.values) / 1e3
    axis.plot(run.seconds(run.mu.t_ns), identified, color=ORANGE, marker=".", lw=1, label="adhesion F, identified")
    axis.set_ylabel("force, kN")


def _draw_distance(axis: Any, run: Run, planned: Distances, target_kmh: float) -> None:
    seconds = run.seconds(run.speed.t_ns)
    axis.plot(seconds, planned.fixed, color=GREY, ls=":", label=f"fixed worst case {FIXED_MU}")
    axis.plot(seconds, planned.longest, color=BLUE, ls="--", label="safe curve, by the lower bound")
    axis.plot(seconds, planned.identified, color=ORANGE, label="nominal curve, by the identified mu")
    axis.set_ylabel(f"braking distance to {target_kmh:.0f} km/h, m")
    # A bound near 0 needs any distance: beyond the worst case there is nothing to compare.
    axis.set_ylim(top=2.0 * max(float(planned.fixed.max()), 1.0))


def _draw_saving(axis: Any, run: Run, planned: Distances, target_kmh: float) -> None:
    """Only where the train brakes: before that there is nothing identified to save by."""
    seconds = run.seconds(run.speed.t_ns[run.learnt])
    axis.axhline(0.0, color=GREY, ls=":", label=f"fixed worst case {FIXED_MU}")
    axis.plot(seconds, planned.saved_at_least[run.learnt], color=BLUE, ls="--", label="at least, by the lower bound")
    axis.plot(seconds, planned.saved[run.learnt], color=ORANGE, label="by the identified mu")
    axis.set_ylabel(f"distance to {target_kmh:.0f} km/h saved, m")
    axis.set_ylim(bottom=-2.0 * max(float(np.abs(planned.saved[run.learnt]).max(initial=0.0)), 1.0))


def _draw_curves(axis: Any, run: Run) -> None:
    """The braking curve as it changed over the run: later ones darker."""
    for curves, color, style, label in ((run.safe, BLUE, "--", "safe curves"), (run.nominal, ORANGE, "-", "nominal")):
        chosen = curves[:: max(len(curves) // CURVES, 1)]
        for i, curve in enumerate(chosen):
            name = label if i + 1 == len(chosen) else None
            depth = 0.3 + 0.7 * (i + 1) / len(chosen)
            axis.plot(curve.position_m, curve.speed_mps / KMH, color=color, ls=style, lw=0.8, alpha=depth, label=name)
    known = run.true_position.t_ns.size > 0
    place, speed = (run.true_position, run.true_speed) if known else (run.position, run.speed)
    axis.plot(place.values, speed.values / KMH, color=BLACK, lw=2, label="what the train did")
    axis.set_xlim(place.values[0], place.values[0] + 2.0 * max(float(place.values[-1] - place.values[0]), 1.0))
    axis.set_xlabel("position, m")
    axis.set_ylabel("braking curves, km/h")


def _shade(axis: Any, run: Run) -> None:
    for band in bands(run):
        if band.regime in SHADES:
            axis.axvspan(band.start_s, band.end_s, color=SHADES[band.regime], lw=0, zorder=0)
