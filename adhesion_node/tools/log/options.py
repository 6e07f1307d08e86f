# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The options that say how a log is written and what its numbers are."""

import argparse
from collections.abc import Callable
from dataclasses import fields
from typing import Any

from ...core.physics.train import CRH3
from ...wire.files.train import read_train
from ...wire.settings.shared import AMBIENT
from .cell.units import known
from .format import (
    ACCELERATION_UNITS,
    OPTIONAL,
    POSITION_UNITS,
    PRESSURE_UNITS,
    SHARES,
    SPEED_UNITS,
    TIME_UNITS,
    WHEEL_UNITS,
    Format,
    option,
)
from .idle import asked

GAUGE = {"gauge": True, "absolute": False}
"""By --pressure-kind: whether pressures are above the air."""

OF_TRAIN = ("wheel_radius_m", "full_pressure_pa")
"""What of a log's format the train's file knows."""

_GUESSED = "when it is not as guessed"

_TOLD = "default: as the header says, else"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add them to a parser."""
    add = parser.add_argument
    for column in ("time", *OPTIONAL):
        add(option(column), dest=column, metavar="COL", help=f"name of the column, when not {column!r}")
    axles = "names of the columns of the axles, the first one first, when not 'wheel_speed_1' and so on"
    add("--wheel-speeds", dest="axles", metavar="COL", nargs="+", action="extend", default=[], help=axles)
    add("--signal", metavar="COL", help="name of the column of names, where a row has one signal, when not 'signal'")
    add("--value", metavar="COL", help="name of the column of its values, when not 'value'")
    rows = "read the rows alone that have this value in this column, such as those of one train; may be repeated"
    add("--where", metavar="COL=VALUE", action="append", default=[], help=rows)
    _text_options(parser.add_argument_group("how the log is written").add_argument)
    _unit_options(parser.add_argument_group("what its numbers are").add_argument)


def format_of(options: argparse.Namespace) -> Format:
    """Return what they say. Raises ValueError naming what is out of range."""
    given = vars(options)
    asked_for = asked(given)
    names = {column: given[column] for column in ("time", *OPTIONAL) if given[column] is not None}
    given |= {"named": names, "is_gauge": GAUGE.get(options.pressure_kind), "asked": asked_for}
    train = read_train(options.train).train if options.train else CRH3
    given |= {name: getattr(train, name) for name in OF_TRAIN if given[name] is None}
    given["delimiter"] = options.delimiter and options.delimiter.replace("\\t", "\t")
    return Format(**{field.name: given[field.name] for field in fields(Format) if field.name in given})


def _spelt(family: str) -> Callable[[str], str]:
    """What an option takes for a unit: as it is called here, or as headers have it, km/h."""
    return lambda text: known(text, family) or text


def _text_options(add: Callable[..., Any]) -> None:
    add("--encoding", metavar="NAME", help=f"such as cp1252, {_GUESSED}")
    add("--delimiter", metavar="CHAR", help=f"between two cells, \\t for a tab, {_GUESSED}")
    add("--decimal", choices=[".", ","], help=f"decimal sign, {_GUESSED}")
    add("--skip-rows", type=int, metavar="N", help=f"lines above the header, {_GUESSED}")
    add(
        "--time-unit",
        type=_spelt("time"),
        choices=[*TIME_UNITS, "iso"],
        help=f"of times that are numbers, {_GUESSED}; iso: dates",
    )
    strptime = "such as '%%d.%%m.%%Y %%H:%%M:%%S.%%f'"
    add("--time-format", metavar="FORMAT", help=f"of dates, {strptime}, {_GUESSED}")
    add(
        "--time-zone",
        metavar="ZONE",
        default="UTC",
        help="of dates that name none, such as Europe/Berlin",
    )
    add("--hold", action="store_true", help="pressures are written where they change alone: as they were in between")
    add("--sort", action="store_true", help="sort the rows by time")


def _unit_options(add: Callable[..., Any]) -> None:
    turned = "down: the chainage falls as the train runs, and is turned"
    add("--direction", choices=["up", "down"], default="up", help=turned)
    add("--position-unit", type=_spelt("position"), choices=list(POSITION_UNITS), help=f"{_TOLD} m; variance is in m^2")
    std = "of all positions, without a variance (default: 0.5, of latitude and longitude unknown; by coarse steps)"
    add("--position-std", dest="position_std_m", type=float, metavar="M", help=std)
    add("--pressure-unit", type=_spelt("pressure"), choices=[*PRESSURE_UNITS, *SHARES], help=f"{_TOLD} pa")
    add("--pressure-kind", choices=list(GAUGE), help=f"of all pressures, {_TOLD} gauge")
    air = f"of the air, which a gauge pressure is above; give the estimator the same as {AMBIENT.name}"
    add("--ambient-pressure", dest=AMBIENT.name, type=float, default=AMBIENT.default, metavar="PA", help=air)
    released = "of the brake pipe while released, in the unit of pressures (default: its 9th decile as the train runs)"
    add("--pipe-released", type=float, metavar="P", help=released)
    full = f"of the cylinders that a full brake demands, by the pipe or as a share (default: {CRH3.full_pressure_pa:g})"
    add("--full-pressure", dest="full_pressure_pa", type=float, metavar="PA", help=full)
    add("--speed-unit", type=_spelt("speed"), choices=list(SPEED_UNITS), help=f"{_TOLD} mps")
    add("--acceleration-unit", type=_spelt("acceleration"), choices=list(ACCELERATION_UNITS), help=f"{_TOLD} mps2")
    add("--wheel-unit", type=_spelt("wheel"), choices=WHEEL_UNITS, help=f"{_TOLD} radps; mps and kmh: of the rim")
    radius = f"of the wheels, for those (default: {CRH3.wheel_radius_m:g})"
    add("--wheel-radius", dest="wheel_radius_m", type=float, metavar="M", help=radius)
    add(
        "--train",
        metavar="FILE",
        help="the train's file (doc/train.md), which has full pressure and wheel radius",
    )
