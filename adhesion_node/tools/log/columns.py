# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which column of a log is which of ours, and in what unit, as its header says."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from .cell.units import kind_of, known, meant, parted
from .format import FAMILIES, OPTIONAL, PLACES, UNITS, Format, option

AXLE = re.compile(r"wheel_speed_\d+", re.IGNORECASE)
"""What the columns of the axles are called where none is named."""


VALUES = frozenset(("value", "values", "wert", "valeur", "valor"))
"""What the column is called that holds all signals."""


class Columns(NamedTuple):
    """Names in the header by ours, those of the axles, those that mean nothing, and units that are in doubt."""

    names: dict[str, str]
    axles: tuple[str, ...]
    unread: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


def columns_of(header: Sequence[str], source: str, form: Format) -> Columns:
    """Return the columns in use; ValueError names the first that is missing or there twice."""
    try:
        return _columns_of(header, source, form)
    except ValueError as error:
        names = "".join(header)
        if "\ufffd" in names or (form.encoding == "cp1252" and not names.isascii()):
            raise ValueError(f"{error}; read as {form.encoding}, are its letters wrong? --encoding") from None
        raise


def _columns_of(header: Sequence[str], source: str, form: Format) -> Columns:
    used = {ours: _the_one(name, ours, header, source) for ours, name in form.named.items()}
    axles = tuple(_the_one(name, "wheel_speed", header, source) for name in form.axles)
    rest = [name for name in header if name not in (*used.values(), *axles)]
    for ours in ("time", *OPTIONAL):
        if ours not in used and (ours == "time" or meant(ours, ours, rest)):
            used[ours] = _the_one(ours, ours, rest if meant(ours, ours, rest) else header, source)
    axles = axles or tuple(name for name in rest if AXLE.fullmatch(parted(name, "wheel_speed")[0]))
    for name in (*used.values(), *axles):
        require_once(name, header, source)
    if len({"lat", "lon"} & set(used)) == 1:
        ((ours, other),) = ((ours, other) for ours, other in (("lat", "lon"), ("lon", "lat")) if ours in used)
        if ours in form.named:
            raise ValueError(
                f"{source}: {ours} = {used[ours]!r}: a place needs both, name the other with --{other} COL"
            )
        used = {ours: name for ours, name in used.items() if ours not in ("lat", "lon")}
    if not (axles or any(set(group) <= set(used) for group in PLACES)):
        lacks = "has neither position, lat and lon, speed nor wheels"
        by_signal = any(name.casefold() in VALUES for name in header)
        remedy = "a signal to a row? --signal COL --value COL; else " if by_signal else ""
        remedy += "name one with --position COL, or --lat COL and --lon COL, or --speed COL, or --wheel-speeds COL"
        raise ValueError(f"{source}: columns {_listed(header)}: {lacks}: {remedy}")
    if {"brake_pipe", "brake_demand"} <= set(used):
        raise ValueError(f"{source}: a brake pipe and a brake demand: leave one out, the pipe becomes the demand")
    unread = tuple(name for name in header if name and name not in (*used.values(), *axles))
    return Columns(used, axles, unread)


def require_once(name: str, header: Sequence[str], source: str) -> None:
    """Raise ValueError where a column that is used has a namesake."""
    if header.count(name) > 1:
        raise ValueError(f"{source}: column {name!r} is there {header.count(name)} times: rename one")


def units_told(columns: Columns, header: Sequence[str], form: Format) -> dict[str, str]:
    """Return the units as the log writes them, by column of ours, where it does; `wheel_speed` are all axles."""
    below = {name: text for name, text in zip(header, form.units or (), strict=False) if text != name}

    def told(name: str, ours: str) -> str:
        return parted(name, ours)[1] or below.get(name, "").strip("[](){}<>- ")

    units = {ours: told(name, ours) for ours, name in columns.names.items()}
    units["wheel_speed"] = " and ".join(
        dict.fromkeys(filter(None, (told(name, "wheel_speed") for name in columns.axles)))
    )
    return {ours: unit for ours, unit in units.items() if unit}


def in_doubt(told: Mapping[str, str], form: Format) -> Iterator[str]:
    """Say which units of a log are unknown, or other than an option says."""
    for ours, text in told.items():
        unit, given, how = known(text, ours), form.given(ours), f"--{FAMILIES.get(ours)}-unit"
        if unit and given not in (unit, None):
            yield f"{ours} is said to be in {text!r}, and by {how} in {given}: which is right?"
        elif (kind := kind_of(text, ours)) and form.is_gauge not in (kind == "gauge", None):
            other = "absolute" if kind == "gauge" else "gauge"
            yield f"{ours} is said to be in {text!r}, {kind}, and by --pressure-kind {other}: which is right?"
        elif unit is None and given is None:
            *more, last = UNITS[FAMILIES.get(ours, ours)]
            cure = f"say which with {how} {', '.join(more)} or {last}" if more else "convert it"
            yield f"{ours} is said to be in {text!r}, an unknown unit, and read in {form.unit(ours)}: {cure}"


def _the_one(name: str, ours: str, header: Sequence[str], source: str) -> str:
    """The one column that is meant by a name."""
    how = option(ours) if ours != "wheel_speed" else "--wheel-speeds"
    found = meant(name, ours, header)
    if not found:
        split = next((mark for mark in (";", "\t", "|", " ") if len(header) == 1 and mark in header[0].strip()), None)
        cure = f"name one with {how} COL" if split is None else f"is the --delimiter {split!r}?"
        raise ValueError(f"{source}: column {name!r} is missing: it has {_listed(header)}; {cure}")
    if len(set(found)) > 1:
        raise ValueError(f"{source}: column {name!r} may be {_listed(found)}: name one with {how} COL")
    return found[0]


def _listed(header: Sequence[str]) -> str:
    text = str(list(header))
    return text if len(text) <= 400 else f"{text[:400]}..."
