# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The supervision limits over the distance, as ETCS draws them, by the safe curve and by the fixed worst case."""

from dataclasses import replace
from typing import Any

import numpy as np

from ...core.atp import limits as etcs
from ...core.atp.config import SupervisionConfig
from ...core.physics.braking import BrakingCurve
from ...core.physics.train import GRAVITY, KMH, Array
from ...report.drawn.picture import BLACK, BLUE, GREY, ORANGE, SHADES
from ...report.found.distances import FIXED_MU
from ...report.read.run import Run
from ..trial.drawing import panels, picture
from ..trial.figures import Place

NAMES = {
    "ebi": ("emergency brake intervention (EBI)", "#b00020", "-"),
    "sbi": ("service brake intervention (SBI)", ORANGE, "-"),
    "warning": ("warning (W)", ORANGE, "--"),
    "permitted": ("permitted speed (P)", BLACK, "-"),
    "indication": ("indication (I)", GREY, "-"),
}
"""Label, colour and line of each limit."""

STANDING_MPS, FASTEST_MPS = 0.3, 80.0
"""Slower is no motion; no limit of a picture is above the other one."""

TITLE = "How fast may a train be to stop at the target? A full brake, from dry rail onto leaves"
TOLD_M = 300.0
"""Way onto the leaves after which the limits are compared in words: the whole train is on them."""

WRONG, WRONG_TEXT = "#f2c4c4", "#8c0016"
"""Where a limit is above what the rail allows, and what is said there."""


def draw(config: SupervisionConfig, safe: BrakingCurve, fixed: BrakingCurve, title: str, place: Place) -> None:
    """Draw the limits of `safe` and the emergency intervention of `fixed` at a place.

    The line speed is that of the beginning of `safe`.
    """
    config = replace(config, line_speed_kmh=float(safe.speed_mps[0]) / KMH)
    reach = float(etcs.distances(config, safe, safe.speed_mps[:1]).indication[0])
    ahead = np.linspace(1.1 * reach, -0.1 * reach, 600)
    with picture(place, title, 3.6) as axis:
        for name, limit in etcs.speeds(config, safe, ahead)._asdict().items():
            label, color, style = NAMES[name]
            axis.plot(ahead, limit / KMH, color=color, ls=style, label=label)
        by_fixed = etcs.speeds(config, fixed, ahead).ebi
        axis.plot(ahead, by_fixed / KMH, color=BLUE, ls=":", label="EBI by the fixed worst case")
        axis.axvline(0.0, color=GREY, lw=0.8)
        axis.annotate(" target", (0.0, 0.02), xycoords=("data", "axes fraction"), color="0.25")
        axis.set(xlabel="distance to the target, m", ylabel="speed, km/h", xlim=(ahead[0], ahead[-1]))
        axis.set_ylim(bottom=0.0)
        axis.legend(loc="lower left", fontsize="small")


def draw_changing(run: Run, leaves_m: float, where: Place) -> None:
    """Draw a full brake from dry rail onto leaves, which begin at a place, and the limits to stop where it does.

    Above: the speed of the train, the limit by the fixed worst case and the one by each safe curve. Below: what the
    rail gave, and what was known of it. A curve counts as its weakest deceleration above its first speed.
    """
    along, speed = run.way
    standing = int(np.flatnonzero(speed.values > STANDING_MPS)[-1])
    way, kmh, stop_m = along.values[:standing], speed.values[:standing] / KMH, float(along.values[-1])
    fixed = np.sqrt(2.0 * FIXED_MU * GRAVITY * (stop_m - way)) / KMH
    curves = [curve for curve in run.safe.kept if curve.position_m[0] < stop_m]
    seen = np.array([curve.position_m[0] for curve in curves])
    known = np.array([_limit(curve.braking, stop_m - at_m) / KMH for curve, at_m in zip(curves, seen, strict=True)])
    with panels(where, TITLE, 2, 2.5) as (upper, lower):
        upper.plot(way, kmh, color=BLACK, lw=2.4, label="the train: it stops there")
        upper.plot(way, fixed, color=GREY, ls=":", lw=2, label=f"limit by the fixed worst case {FIXED_MU}")
        upper.plot(seen, known, color=BLUE, ls="--", lw=1.6, label="limit by the identified adhesion, at least")
        upper.plot(stop_m, 0.0, "v", color=BLACK, ms=7, clip_on=False)
        upper.fill_between(way, kmh, fixed, where=way >= leaves_m, color=WRONG, lw=0)
        _tell(upper, way, kmh, fixed, seen, known, leaves_m)
        upper.set(ylabel="speed, km/h", ylim=(0.0, 1.2 * max(known.max(), fixed.max())))
        used, mu, bound = (series.at(run.speed.t_ns) for series in (run.true_mu, run.mu, run.mu_lower))
        at_m = along.at(run.speed.t_ns)
        lower.plot(at_m, used, color=BLACK, lw=2.4, label="used, in truth")
        lower.plot(at_m, np.where(run.learnt, mu, np.nan), color=ORANGE, lw=1.2, label="identified")
        lower.plot(at_m, bound, color=BLUE, ls="--", label="at least")
        lower.axhline(FIXED_MU, color=GREY, ls=":", lw=2, label="fixed worst case")
        lower.set(xlabel="position, m", ylabel="adhesion", ylim=(0.0, None))
        for axis in (upper, lower):
            axis.axvspan(leaves_m, stop_m, color=SHADES["ADHESION_LIMITED"], lw=0, zorder=0)
            axis.set_xlim(way[0], stop_m * 1.02)
            axis.legend(loc="upper right")


def _limit(curve: BrakingCurve, left_m: float) -> float:
    """Speed, m/s, from which a train stops along a curve within a way."""
    speeds = np.linspace(0.0, FASTEST_MPS, 2001)
    return float(np.interp(left_m, etcs.distance_between(curve, speeds, 0.0), speeds))


def _tell(axis: Any, way: Array, kmh: Array, fixed: Array, seen: Array, known: Array, leaves_m: float) -> None:
    """Say in the picture what was known before, and how far the limits are off a while after the leaves begin."""
    at_m, braked_m = leaves_m + TOLD_M, way[kmh > kmh.max() - 2.0][-1]
    true, by_fixed, by_known = np.interp(at_m, way, kmh), np.interp(at_m, way, fixed), np.interp(at_m, seen, known)
    said = (
        (way[0] + 15.0, known[0] - 35.0, "before the brake nothing is known", BLUE),
        (braked_m, known.max() + 8.0, "on dry rail more than the worst case", BLUE),
        (at_m - 100.0, 0.65 * true + 0.35 * by_fixed, f"{by_fixed - true:.0f} km/h too fast", WRONG_TEXT),
        (leaves_m + 20.0, by_known - 30.0, f"{true - by_known:.0f} km/h below what the rail allows", BLUE),
    )
    for x, y, text, color in said:
        axis.text(x, y, text, color=color, va="center")
    for text, x in (("dry rail", 0.5 * (way[0] + leaves_m)), ("leaves", 0.5 * (leaves_m + way[-1]))):
        axis.text(x, 6.0, text, color="0.25", ha="center")
