# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The counterparts of the figures of He et al. 2017.

Figs. 1-3: adhesion over creep as measured, Burckhardt's model, Kiencke's curve beside it. The paper prints no
coefficients: Burckhardt's are those he gives for roads; Kiencke's curve has the same initial slope and the p1, p2 of
least squares. Figs. 5-11: p1, p2 and the peak, on one surface and over a switch.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import curve_fit

from ...core.creep.curve import adhesion
from ...core.physics.train import Array
from ...report.drawn.picture import BLACK, BLUE, GREY, ORANGE
from ..trial.drawing import draw_lines, picture
from ..trial.figures import Figures
from . import runs as he

CREEPS = np.linspace(0.0, 0.3, 301)


class Burckhardt(NamedTuple):
    """mu = c1 (1 - exp(-c2 l)) - c3 l."""

    c1: float
    c2: float
    c3: float

    def __call__(self, creep: Array) -> Array:
        """Adhesion at each creep."""
        return self.c1 * -np.expm1(-self.c2 * creep) - self.c3 * creep

    @property
    def slope(self) -> float:
        """Initial slope.

        >>> round(DRY_ROAD.slope, 2)
        30.19
        """
        return self.c1 * self.c2 - self.c3


DRY_ROAD = Burckhardt(1.2801, 23.99, 0.52)
ROADS = {"dry": DRY_ROAD, "wet": Burckhardt(0.857, 33.822, 0.347), "snow": Burckhardt(0.1946, 94.129, 0.0646)}


def like(model: Burckhardt) -> Array:
    """p1 and p2 of the Kiencke curve that comes nearest to a model, with the same initial slope."""

    def curve(creep: Array, p1: float, p2: float) -> Array:
        return adhesion(creep, model.slope, np.array([p1, p2]))

    return np.asarray(curve_fit(curve, CREEPS, model(CREEPS), p0=(10.0, 10.0))[0])


POINTS = 1500
"""Points of a curve at most."""


class Panel(NamedTuple):
    """A figure of the paper: its number, the experiment, what it shows, the truths before and after the switch."""

    number: int
    experiment: str
    quantity: str
    truths: tuple[float, ...]
    title: str


PEAK = "largest adhesion coefficient"
PANELS = (
    Panel(5, "1", "p1", (he.DRY[0],), "one surface"),
    Panel(6, "1", "p2", (he.DRY[1],), "one surface"),
    Panel(7, "1", PEAK, (he.DRY_PEAK,), "one surface"),
    Panel(8, "2", "p1", (he.DRY[0], he.WET[0]), "dry to wet, factor 0.99"),
    Panel(9, "2", "p2", (he.DRY[1], he.WET[1]), "dry to wet, factor 0.99"),
    Panel(10, "2", PEAK, (he.DRY_PEAK, he.WET_PEAK), "dry to wet, factor 0.99"),
    Panel(11, "3", PEAK, (he.DRY_PEAK, he.WET_PEAK), "dry to wet, varying factor"),
)


def draw(thetas: Mapping[str, Array], figures: Figures) -> None:
    """Draw figNN; thetas (samples, runs, 2) by experiment."""
    _draw_models(figures)
    for panel in PANELS:
        count = thetas[panel.experiment].shape[1]
        title = f"Fig. {panel.number}: {panel.quantity}, {panel.title}; N = {count} runs"
        with picture(figures.place(f"fig{panel.number:02d}"), title) as axis:
            _draw_panel(axis, panel, _values(thetas[panel.experiment], panel.quantity))


def _values(theta: Array, quantity: str) -> Array:
    """What a panel shows, shape (samples, runs)."""
    return he.peaks(theta) if quantity == PEAK else theta[..., int(quantity[1]) - 1]


def _draw_panel(axis: Any, panel: Panel, values: Array) -> None:
    every = max(values.shape[0] // POINTS, 1)
    places = _places(panel)[::every]
    low, high = np.quantile(values[::every], [0.05, 0.95], axis=1)
    axis.fill_between(places, low, high, color="0.85", label=f"5 to 95 % of {values.shape[1]} runs")
    axis.plot(places, values[::every, 0], color=ORANGE, lw=1.2, label="one run")
    edges = np.linspace(places[0], places[-1], len(panel.truths) + 1)
    for index, truth in enumerate(panel.truths):
        ends = edges[index : index + 2]
        axis.plot(ends, [truth, truth], color=BLACK, ls="--", lw=1.8, label="true" if index == 0 else None)
        if panel.quantity == PEAK:
            band = [truth * (1 - he.BAND), truth * (1 + he.BAND)]
            axis.hlines(band, *ends, color=BLUE, ls=":", lw=1.2, label="true ± 5 %" if index == 0 else None)
    mark = he.ENOUGH if len(panel.truths) == 1 else edges[1]
    axis.axvline(mark, color=GREY, lw=1.0)
    named = f" creep {he.ENOUGH}" if len(panel.truths) == 1 else " the surface changes"
    axis.annotate(named, (mark, 0.02), xycoords=("data", "axes fraction"), color="0.25", fontsize="small")
    along = "creep" if len(panel.truths) == 1 else "samples on a surface, each from 0 to 1"
    axis.set(xlabel=along, ylabel=panel.quantity, xlim=(places[0], places[-1]), ylim=(0.0, 2.0 * max(panel.truths)))
    axis.legend(loc="upper right", fontsize="small")


def _places(panel: Panel) -> Array:
    """Where the samples stand on the horizontal axis: at their creep, or at the share of their surface's samples."""
    if len(panel.truths) == 1:
        return he.rise()
    samples = he.swings().size
    return np.arange(1, 2 * samples + 1) / samples


def _draw_models(figures: Figures) -> None:
    with picture(figures.place("fig01"), "Fig. 1: adhesion as measured, simulated") as axis:
        truth = adhesion(CREEPS, he.SLOPE, he.DRY)
        measured = he.measure(CREEPS, he.on_one(CREEPS), 1, 1, in_mu=True).adhesion[:, 0]
        axis.plot(CREEPS, measured, color="0.0", marker="+", ls="", label="measured")
        for sign, label in ((1, "within two standard deviations"), (-1, None)):
            axis.plot(CREEPS, truth + sign * 2.0 * he.NOISE_STD, color=BLUE, ls="--", label=label)
        axis.set(xlabel="creep", ylabel="adhesion coefficient")
        axis.legend(loc="lower right")
    with picture(figures.place("fig02"), "Fig. 2: Burckhardt's model, roads") as axis:
        draw_lines(axis, CREEPS, {name: model(CREEPS) for name, model in ROADS.items()})
        axis.set(xlabel="creep", ylabel="adhesion coefficient")
        axis.legend(loc="center right")
    with picture(figures.place("fig03"), "Fig. 3: Kiencke's curve beside Burckhardt's model, dry road") as axis:
        curves = {"Burckhardt": DRY_ROAD(CREEPS), "Kiencke": adhesion(CREEPS, DRY_ROAD.slope, like(DRY_ROAD))}
        peaked = (f"{name}: peak {mu.max():.3f} at {CREEPS[mu.argmax()]:.3f}" for name, mu in curves.items())
        draw_lines(axis, CREEPS, dict(zip(peaked, curves.values(), strict=True)))
        axis.set(xlabel="creep", ylabel="adhesion coefficient")
        axis.legend(loc="lower right")
