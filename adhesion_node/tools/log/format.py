# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How a log is written: its text, the units of its columns, and what they may hold."""

import argparse
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from zoneinfo import ZoneInfo

from ...core.intake.samples import (
    MAX_ACCELERATION_MPS2,
    MAX_POSITION_M,
    MAX_SPEED_MPS,
    MAX_VARIANCE_M2,
    MIN_VARIANCE_M2,
)
from ...core.physics.train import CRH3, KMH
from ...wire.line import ATMOSPHERE_PA, MAX_ABSOLUTE_PA, MIN_ABSOLUTE_PA, Line
from ...wire.messages.refused import MAX_WHEEL_RADPS
from .named import NO_TEXT, NO_ZONE, decodes, require, require_format

TIME_UNITS = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1, "min": 60 * 10**9, "h": 3600 * 10**9}
TIME_UNITS |= {"excel": 86_400 * 10**9}
"""In ns; besides there is `iso`, a date. `excel`: days, those of 1970 from 25569 on, else of none."""

EXCEL_1970 = 25_569
"""The day of a spreadsheet on which the epoch begins."""

POSITION_UNITS = {"m": 1.0, "km": 1e3, "ft": 0.3048, "cm": 0.01, "mm": 1e-3, "mi": 1609.344}
PRESSURE_UNITS = {"pa": 1.0, "kpa": 1e3, "bar": 1e5, "mbar": 1e2, "mpa": 1e6, "psi": 6894.757, "kgcm2": 98066.5}
SHARES = {"percent": 0.01, "full": 1.0}
"""Units of pressures that are parts of a full brake's; `full` is that of a flag, too, true or false."""

SPEED_UNITS = {"mps": 1.0, "kmh": KMH, "mph": 0.44704, "kn": 1852.0 / 3600.0}
ACCELERATION_UNITS = {"mps2": 1.0, "g": 9.80665, "mg": 9.80665e-3}
WHEEL_UNITS = ("radps", "rpm", "mps", "kmh")
"""The last two of the rim."""

PRESSURES = ("brake_pressure", "brake_demand", "brake_pipe")

PLACES = (("position",), ("lat", "lon"), ("speed",))
"""Columns of which a log has one group at least, beside the time."""

OPTIONAL = (
    *("date", "position", "lat", "lon", "height", "variance"),
    *(*PRESSURES, "speed", "speed_std", "acceleration"),
)
"""All columns but the time and the axles."""

FAMILIES = {
    **{name: name for name in ("time", "position", "speed", "acceleration")},
    **{"speed_std": "speed", "wheel_speed": "wheel"},
    **dict.fromkeys(PRESSURES, "pressure"),
}
"""By column of what its unit is: so the option is called that says it, `--speed-unit`."""

UNITS: Mapping[str, Sequence[str]] = {
    **{"time": tuple(TIME_UNITS), "position": tuple(POSITION_UNITS), "speed": tuple(SPEED_UNITS)},
    **{"pressure": (*PRESSURE_UNITS, *SHARES), "acceleration": tuple(ACCELERATION_UNITS), "wheel": WHEEL_UNITS},
    **{"lat": ("deg",), "lon": ("deg",), "height": ("m",), "variance": ("m2",), "date": ()},
}
"""By family, the first one where nothing is said; the last ones by column, of which there is no other."""

_IS_PRESSURE = "Pa absolute: is the --pressure-unit, --pressure-kind or --ambient-pressure another?"
_NMEA = "Or ddmm.mmmm, as NMEA has it: write N, S, E or W behind it, in its cell"
_ABSOLUTE = (MIN_ABSOLUTE_PA, MAX_ABSOLUTE_PA, _IS_PRESSURE)

LIMITS = {
    "position": (-MAX_POSITION_M, MAX_POSITION_M, "m: is the --position-unit another?"),
    "lat": (-90.0, 90.0, f"degrees: are latitude and longitude exchanged, or is it in 1e-7 degrees? {_NMEA}"),
    "lon": (-180.0, 180.0, f"degrees: is it in 1e-7 degrees? {_NMEA}"),
    "height": (-500.0, 10_000.0, "m"),
    "variance": (MIN_VARIANCE_M2, MAX_VARIANCE_M2, "m^2: leave it empty where unknown"),
    "brake_pressure": _ABSOLUTE,
    "brake_demand": _ABSOLUTE,
    "brake_pipe": _ABSOLUTE,
    "speed": (-MAX_SPEED_MPS, MAX_SPEED_MPS, "m/s: is the --speed-unit another?"),
    "speed_std": (1e-6, MAX_SPEED_MPS, "m/s: leave it empty where unknown"),
    "acceleration": (-MAX_ACCELERATION_MPS2, MAX_ACCELERATION_MPS2, "m/s^2: is the --acceleration-unit another?"),
    "wheel_speed": (-MAX_WHEEL_RADPS, MAX_WHEEL_RADPS, "rad/s: is the --wheel-unit another?"),
}
"""Least and greatest value in SI, and its unit with the remedy, by column."""


def option(column: str) -> str:
    """Return the option that names a column.

    >>> option("brake_pressure"), option("speed_std")
    ('--pressure', '--speed-std')
    """
    return "--" + column.removeprefix("brake_").replace("_", "-")


@dataclass(frozen=True, slots=True)
class Format:
    """How to read a log. `named` are the columns the user named, `axles` those of the axles: these have to be there.

    What is None is guessed (text.py).
    """

    named: Mapping[str, str]
    axles: Sequence[str] = ()
    where: Sequence[str] = ()
    """Which rows are read, COLUMN=VALUE."""
    signal: str | None = None
    """The column with the name of the signal, where a row has one signal."""
    value: str | None = None
    asked: argparse.Namespace | None = None
    """What options ask for that may mean nothing for a log (idle.py)."""
    encoding: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    thousands: bool = False
    """Whether whole numbers may be in groups of thousands, 20.000: where the decimal sign is sure to be the other."""
    skip_rows: int | None = None
    """Lines above the header."""
    units: Sequence[str] | None = None
    """Cells of the line of units between the header and the first row, where there is one."""
    units_at: int = 0
    """Which line below the header that is."""
    below: int = 0
    """Lines below the header that are no rows: units, comments, types."""
    told: Mapping[str, str] = field(default_factory=dict)
    """Units of columns, as the log itself names them; an option counts more."""
    absolute: frozenset[str] = frozenset()
    """Pressures that the log itself names absolute, `bara`."""
    time_unit: str | None = None
    """One of `TIME_UNITS`, or `iso`."""
    time_format: str | None = None
    """Of a date, as strptime takes it."""
    time_zone: str = "UTC"
    """Of dates that name none."""
    sort: bool = False
    hold: bool = False
    """Whether a pressure that a row does not tell is that of the last one which did."""
    direction: str = "up"
    """Whether the chainage rises as the train runs, or falls: `down`."""
    position_unit: str | None = None
    position_std_m: float | None = None
    """Stands in where the log gives no variance; None: see steps.py."""
    pressure_unit: str | None = None
    is_gauge: bool | None = None
    """Whether all pressures are above the air; None: those which the log does not name absolute."""
    ambient_pressure_pa: float = ATMOSPHERE_PA
    pipe_released: float | None = None
    """Of the brake pipe, in the unit of pressures, where the brake is released; None: 9th decile as the train runs."""
    full_pressure_pa: float = CRH3.full_pressure_pa
    """What a full brake demands of the cylinders, gauge."""
    speed_unit: str | None = None
    acceleration_unit: str | None = None
    wheel_unit: str | None = None
    wheel_radius_m: float = CRH3.wheel_radius_m

    def __post_init__(self) -> None:
        if self.delimiter is not None and (len(self.delimiter) != 1 or self.delimiter in '"\r\n'):
            raise ValueError(f"delimiter = {self.delimiter!r}: give one character, such as ',' or ';'")
        if self.skip_rows is not None and self.skip_rows < 0:
            raise ValueError(f"skip-rows = {self.skip_rows}: give the number of lines above the header")
        if self.encoding is not None:
            require(decodes, NO_TEXT, "encoding", self.encoding, "such as utf-8, cp1252 or utf-16")
        if self.time_format is not None:
            require_format(self.time_format)
        require(ZoneInfo, NO_ZONE, "time-zone", self.time_zone, "such as UTC or Europe/Berlin")
        std = self.position_std_m
        least, most = MIN_VARIANCE_M2**0.5, MAX_VARIANCE_M2**0.5
        if std is not None and not least <= std <= most:
            raise ValueError(f"position-std = {std!r}: give a standard deviation from {least:g} to {most:g}, in m")
        if not 0.01 <= self.wheel_radius_m <= 5.0:
            raise ValueError(f"wheel-radius = {self.wheel_radius_m!r}: give a radius of 0.01 to 5 m")
        if not 1e5 <= self.full_pressure_pa <= 1e6:
            raise ValueError(f"full-pressure = {self.full_pressure_pa!r}: give 100000 to 1000000 Pa, gauge")
        Line(ambient_pressure_pa=self.ambient_pressure_pa)

    def given(self, column: str) -> str | None:
        """The unit of a column that an option says; the axles together are `wheel_speed`."""
        unit: str | None = getattr(self, f"{FAMILIES[column]}_unit", None) if column in FAMILIES else None
        return unit

    def unit(self, column: str) -> str:
        """The unit of a column: that of the option, else as the log says of it or of its like, else SI."""
        family = FAMILIES.get(column, column)
        of_family = (unit for other, unit in self.told.items() if FAMILIES.get(other) == family)
        return self.given(column) or self.told.get(column) or next(of_family, UNITS[family][0])

    def offset(self, column: str) -> float:
        """What is added to the numbers of a column in SI: the pressure of the air to those above it."""
        is_gauge = column not in self.absolute if self.is_gauge is None else self.is_gauge
        return self.ambient_pressure_pa if column in PRESSURES and (is_gauge or self.is_share(column)) else 0.0

    def is_share(self, column: str) -> bool:
        """Whether a pressure is told as a part of a full brake's."""
        return column in PRESSURES and self.unit(column) in SHARES

    def pascals(self, column: str) -> float:
        """What one unit of a pressure is in Pa."""
        unit = self.unit(column)
        return SHARES[unit] * self.full_pressure_pa if unit in SHARES else PRESSURE_UNITS[unit]

    def factors(self) -> Mapping[str, float]:
        """What one unit of a column is in SI, where it is not 1."""
        return {
            "position": POSITION_UNITS[self.unit("position")],
            **{name: self.pascals(name) for name in PRESSURES},
            **{name: SPEED_UNITS[self.unit(name)] for name in ("speed", "speed_std")},
            "acceleration": ACCELERATION_UNITS[self.unit("acceleration")],
            "wheel_speed": wheel_units(self.wheel_radius_m)[self.unit("wheel_speed")],
        }


def wheel_units(radius_m: float) -> Mapping[str, float]:
    """What one of each of `WHEEL_UNITS` is in rad/s."""
    return dict(zip(WHEEL_UNITS, (1.0, math.pi / 30.0, 1.0 / radius_m, KMH / radius_m), strict=True))
