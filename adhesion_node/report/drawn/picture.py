# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""One picture of a recorded run: adhesion with its bound, speed, forces, braking distances and braking curves."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.patches import Patch

from ...command.written import naming
from ...core.physics.train import CRH3, KMH, Train
from ..found.regimes import IN_WORDS, Band, bands
from ..read.run import Run
from .charts import charts
from .thinning import evenly, peaks, with_gaps

SHADES = {"COASTING": "0.85", "BRAKE_LIMITED": "#d3e5f7", "ADHESION_LIMITED": "#fff1dc"}
TRUE_SHADES = {"COASTING": "0.6", "BRAKE_LIMITED": "#5b9bd5", "ADHESION_LIMITED": "#e69f00"}
STRIP = 0.05
"""Part of a chart's height in which the truth stands."""

BLACK, BLUE, ORANGE, GREY = "#000000", "#0b5fa5", "#c75b00", "0.45"

STYLES: dict[str, dict[str, Any]] = {
    "truth": {"color": BLACK, "lw": 2},
    "identified": {"color": ORANGE, "marker": ".", "lw": 1},
    "nominal": {"color": ORANGE, "lw": 1},
    "known": {"color": ORANGE, "lw": 1},
    "atleast": {"color": BLUE, "marker": 10, "markevery": 0.03, "lw": 1},  # caret up: open above
    "prior": {"color": GREY, "ls": (0, (1, 3)), "lw": 1.5},
    "bound": {"color": BLUE, "ls": "--"},
    "fixed": {"color": GREY, "ls": ":", "lw": 2},
}
"""How a line of a kind is drawn."""

MOST_POINTS = 2000
"""Points of a line: more than the picture is wide."""

CURVES = 8
"""Braking curves drawn, evenly spread over the run."""


def draw(
    run: Run, paths: Sequence[Path], title: str, target_kmh: float, train: Train = CRH3, truth: Sequence[Band] = ()
) -> None:
    """Draw the run into PNG and PDF files, as their endings say, readable in black and white.

    Behind the lines stands what the estimator said that limits the motion, above it what truly did.
    """
    figure = Figure(figsize=(11, 12), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, parse_math=False)  # a file's name may hold any $
    parts: Any = figure.subfigures(2, 1, height_ratios=(20.0, 1.0))
    upper, foot = parts
    *axes, last = upper.subplots(3, 2).flat
    said = bands(run)
    for axis, chart in zip(axes, charts(run, target_kmh, train), strict=True):
        for line in chart.lines:
            whole = with_gaps(line.series)
            kept = peaks(whole.values, MOST_POINTS)
            axis.plot(run.seconds(whole.t_ns[kept]), whole.values[kept], label=line.label, **STYLES[line.kind])
        upright = axis.get_xaxis_transform()
        for known, shades, foot_at in ((said, SHADES, 0.0), (truth, TRUE_SHADES, 1.0 - STRIP)):
            for regime, shade in shades.items():
                # one shape for all: the legend looks for a free place among the shapes
                edges = [edge for band in known if band.regime == regime for edge in (band.start_s, band.end_s)]
                if edges:
                    tops = [1.0, foot_at] * (len(edges) // 2)
                    look: dict[str, Any] = {"color": shade, "lw": 0, "zorder": 0, "transform": upright}
                    axis.stairs(tops[:-1], edges, baseline=foot_at, fill=True, **look)
        axis.sharex(axes[0])
        axis.set(xlabel="time, s", ylabel=chart.title, ylim=chart.range)
    _draw_curves(last, run)
    for axis in (*axes, last):
        axis.grid(alpha=0.3)
        axis.legend(loc="best", fontsize="small")
    names = [IN_WORDS[regime] for regime in SHADES]
    told, true = ([Patch(color=shades[regime]) for regime in SHADES] for shades in (SHADES, TRUE_SHADES))
    patches = list(zip(told, true, strict=True)) if truth else told
    meaning = "what limits the motion" + (
        ": as the estimator said, and in truth (the strip above, grey while it coasts)" if truth else ""
    )
    foot.legend(patches, names, loc="center", ncols=len(names), title=meaning, handler_map={tuple: HandlerTuple(None)})
    for path in paths:
        with naming(path):
            figure.savefig(path, dpi=110)
        figure.set_layout_engine("none")  # the places are found once for all files


def _draw_curves(axis: Any, run: Run) -> None:
    """The braking curve as it changed over the run: later ones darker."""
    for curves, color, style, label in ((run.safe, BLUE, "--", "safe curves"), (run.nominal, ORANGE, "-", "nominal")):
        chosen = curves.kept[:: max(len(curves.kept) // CURVES, 1)]
        for i, curve in enumerate(chosen):
            name = label if i + 1 == len(chosen) else None
            depth = 0.3 + 0.7 * (i + 1) / len(chosen)
            axis.plot(curve.position_m, curve.speed_mps / KMH, color=color, ls=style, lw=0.8, alpha=depth, label=name)
    place, speed = run.way
    kept = evenly(place.t_ns.size, MOST_POINTS)
    axis.plot(place.values[kept], speed.values[kept] / KMH, color=BLACK, lw=2, label="what the train did")
    start_m, length_m = place.values[0], max(float(place.values[-1] - place.values[0]), 1.0)
    axis.set(xlabel="position, m", ylabel="braking curves, km/h", xlim=(start_m, start_m + 2.0 * length_m))
    axis.set_ylim(bottom=0.0)
