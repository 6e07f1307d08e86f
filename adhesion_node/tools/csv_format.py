# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""How a CSV log is written: the units of its columns, and what they may hold."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

from ..core.intake.samples import MAX_ACCELERATION_MPS2, MAX_POSITION_M, MAX_SPEED_MPS, MAX_VARIANCE_M2, MIN_VARIANCE_M2
from ..core.physics.train import CRH3
from ..wire.codecs import ATMOSPHERE_PA, MAX_ABSOLUTE_PA, MAX_WHEEL_RADPS, MIN_ABSOLUTE_PA, Line

KMH = 1 / Decimal("3.6")

POSITION_UNITS = {"m": Decimal(1), "km": Decimal(1000)}
PRESSURE_UNITS = {"pa": Decimal(1), "kpa": Decimal(1000), "bar": Decimal(100_000)}
SPEED_UNITS = {"mps": Decimal(1), "kmh": KMH}
ACCELERATION_UNITS = {"mps2": Decimal(1), "g": Decimal("9.80665")}
WHEEL_UNITS = ("radps", "rpm", "mps", "kmh")
"""The last two of the rim."""

PRESSURES = ("brake_pressure", "brake_demand")

_IS_PRESSURE = "Pa absolute: is the --pressure-unit, --pressure-kind or --ambient-pressure another?"
_ABSOLUTE = (MIN_ABSOLUTE_PA, MAX_ABSOLUTE_PA, _IS_PRESSURE)

LIMITS = {
    "position": (-MAX_POSITION_M, MAX_POSITION_M, "m: is the --position-unit another?"),
    "lat": (-90.0, 90.0, "degrees: are latitude and longitude exchanged?"),
    "lon": (-180.0, 180.0, "degrees"),
    "height": (-500.0, 10_000.0, "m"),
    "variance": (MIN_VARIANCE_M2, MAX_VARIANCE_M2, "m^2: leave it empty where unknown"),
    "brake_pressure": _ABSOLUTE,
    "brake_demand": _ABSOLUTE,
    "speed": (-MAX_SPEED_MPS, MAX_SPEED_MPS, "m/s: is the --speed-unit another?"),
    "speed_std": (1e-6, MAX_SPEED_MPS, "m/s: leave it empty where unknown"),
    "acceleration": (-MAX_ACCELERATION_MPS2, MAX_ACCELERATION_MPS2, "m/s^2: is the --acceleration-unit another?"),
    "wheel_speed": (-MAX_WHEEL_RADPS, MAX_WHEEL_RADPS, "rad/s: is the --wheel-unit another?"),
}
"""Least and greatest value in SI, and its unit with the remedy, by column."""


@dataclass(frozen=True, slots=True)
class Format:
    """How to read a log. `named` are the columns the user named, `axles` those of the axles: these have to be there."""

    named: Mapping[str, str]
    axles: Sequence[str] = ()
    delimiter: str = ","
    time_unit: str = "s"
    position_unit: str = "m"
    position_std_m: float | None = None
    """Stands in where the log gives no variance; None: 0.5 m along the track, unknown of latitude and longitude."""
    pressure_unit: str = "pa"
    pressure_is_gauge: bool = True
    ambient_pressure_pa: float = ATMOSPHERE_PA
    speed_unit: str = "mps"
    acceleration_unit: str = "mps2"
    wheel_unit: str = "radps"
    wheel_radius_m: float = CRH3.wheel_radius_m

    def __post_init__(self) -> None:
        if len(self.delimiter) != 1 or self.delimiter in '"\r\n':
            raise ValueError(f"delimiter = {self.delimiter!r}: give one character, such as ',' or ';'")
        std = self.position_std_m
        if std is not None and not MIN_VARIANCE_M2 <= std**2 <= MAX_VARIANCE_M2:
            raise ValueError(f"position-std = {std!r}: give a standard deviation above 0, in m")
        if not 0.01 <= self.wheel_radius_m <= 5.0:
            raise ValueError(f"wheel-radius = {self.wheel_radius_m!r}: give a radius of 0.01 to 5 m")
        Line(ambient_pressure_pa=self.ambient_pressure_pa)

    def factors(self) -> Mapping[str, Decimal]:
        """What one unit of a column is in SI, where it is not 1."""
        radius = Decimal(self.wheel_radius_m)
        wheel = {"radps": Decimal(1), "rpm": Decimal(math.pi) / 30, "mps": 1 / radius, "kmh": KMH / radius}
        return {
            "position": POSITION_UNITS[self.position_unit],
            **dict.fromkeys(PRESSURES, PRESSURE_UNITS[self.pressure_unit]),
            **dict.fromkeys(("speed", "speed_std"), SPEED_UNITS[self.speed_unit]),
            "acceleration": ACCELERATION_UNITS[self.acceleration_unit],
            "wheel_speed": wheel[self.wheel_unit],
        }
