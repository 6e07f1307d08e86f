# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The counterparts of Figs. 1-3 of He et al. 2017: measured adhesion over creep, Burckhardt's model, Kiencke beside it.

The paper prints no coefficients. Burckhardt's are those he gives for roads; Kiencke's curve has the same initial slope
and the p1, p2 of least squares.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import curve_fit

from ...core.creep.curve import adhesion
from ...core.physics.train import Array
from ..trial.drawing import STYLES, picture
from .runs import DRY, NOISE_STD, SLOPE, measure, on_one

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


def draw(folder: Path) -> None:
    """Draw fig01.png to fig03.png into a folder."""
    with picture(folder / "fig01.png", "Fig. 1: adhesion as measured, simulated") as axis:
        truth = adhesion(CREEPS, SLOPE, DRY)
        measured = measure(CREEPS, on_one(CREEPS), 1, 1, in_mu=True).adhesion[:, 0]
        axis.plot(CREEPS, measured, color="0.0", marker="+", ls="", label="measured")
        for sign, label in ((1, "within two standard deviations"), (-1, None)):
            axis.plot(CREEPS, truth + sign * 2.0 * NOISE_STD, color=STYLES[1][0], ls="--", label=label)
        axis.set(xlabel="creep", ylabel="adhesion coefficient")
        axis.legend(loc="lower right")
    with picture(folder / "fig02.png", "Fig. 2: Burckhardt's model, roads") as axis:
        for (color, dashes), (name, model) in zip(STYLES, ROADS.items(), strict=False):
            axis.plot(CREEPS, model(CREEPS), color=color, ls=dashes, lw=1.8, label=name)
        axis.set(xlabel="creep", ylabel="adhesion coefficient")
        axis.legend(loc="center right")
    with picture(folder / "fig03.png", "Fig. 3: Kiencke's curve beside Burckhardt's model, dry road") as axis:
        curves = {"Burckhardt": DRY_ROAD(CREEPS), "Kiencke": adhesion(CREEPS, DRY_ROAD.slope, like(DRY_ROAD))}
        for (color, dashes), (name, values) in zip(STYLES, curves.items(), strict=False):
            label = f"{name}: peak {values.max():.3f} at {CREEPS[values.argmax()]:.3f}"
            axis.plot(CREEPS, values, color=color, ls=dashes, lw=1.8, label=label)
        axis.set(xlabel="creep", ylabel="adhesion coefficient")
        axis.legend(loc="lower right")
