# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The sensors: position with Gaussian or heavy-tailed noise, outliers and dropouts; brake pressure; odometer.

The wheel-speed sensors have a file of their own, `wheels`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from .plant import Truth

ATMOSPHERE_PA = 101325.0
"""Standard atmosphere: the sensor measures absolute pressure, the brake works by the pressure above this."""


@dataclass(frozen=True, slots=True)
class SensorSettings:
    """Noise of the sensors. Raises ValueError naming the setting that is out of range."""

    position_std_m: float = 0.5
    """Gaussian standard deviation; with `student_dof` the scale of Student's t, which it is the limit of."""
    student_dof: float = 0.0
    """Degrees of freedom of Student's t, at least 1; 0 = Gaussian."""
    outlier_fraction: float = 0.0
    """Probability that a position is off by `outlier_size_m`, to either side."""
    outlier_size_m: float = 20.0
    dropout_fraction: float = 0.0
    """Probability that a position is missing."""
    pressure_std_pa: float = 0.0
    speed_std_mps: float = 0.0
    """0 = the train has no odometer."""
    wheel_speed_std_radps: float = 0.0
    """0 = the train has no wheel-speed sensors."""

    def __post_init__(self) -> None:
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if not math.isfinite(value) or value < 0:
                raise ValueError(f"sensor {name} = {value!r}: give a finite number of at least 0")
        if self.position_std_m == 0:
            raise ValueError("sensor position_std_m = 0: give a number above 0, the receivers need a variance")
        if 0 < self.student_dof < 1:
            raise ValueError(f"sensor student_dof = {self.student_dof!r}: give 0 (Gaussian) or at least 1")
        for name in ("outlier_fraction", "dropout_fraction"):
            if getattr(self, name) > 1:
                raise ValueError(f"sensor {name} = {getattr(self, name)!r}: give a fraction from 0 to 1")


class Reading(NamedTuple):
    """What the sensors show of one sample; a value that is None is not published."""

    t_ns: int
    position_m: float | None
    pressure_pa: float
    """Absolute."""
    speed_mps: float | None
    wheel_radps: tuple[float, ...] | None = None
    """Angular speed of each axle group."""


def measure(truth: Truth, settings: SensorSettings, rng: np.random.Generator) -> Reading:
    """Measure one true sample, the wheels apart.

    Every call draws the same basic numbers, whatever the settings: outliers, dropouts and an odometer come on top
    of an otherwise equal run.
    """
    position_noise, pressure_noise, speed_noise, side = rng.standard_normal(4)
    outlier, dropout = rng.random(2)
    if settings.student_dof > 0:
        # t = z / sqrt(chi2/dof), from a stream of its own kind: it comes last and only here.
        position_noise /= math.sqrt(rng.chisquare(settings.student_dof) / settings.student_dof)
    position = truth.position_m + settings.position_std_m * position_noise
    if outlier < settings.outlier_fraction:
        position += math.copysign(settings.outlier_size_m, side)
    return Reading(
        t_ns=truth.t_ns,
        position_m=None if dropout < settings.dropout_fraction else float(position),
        pressure_pa=float(truth.pressure_pa + ATMOSPHERE_PA + settings.pressure_std_pa * pressure_noise),
        speed_mps=float(truth.speed_mps + settings.speed_std_mps * speed_noise) if settings.speed_std_mps else None,
    )
