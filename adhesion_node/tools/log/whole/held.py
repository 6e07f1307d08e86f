# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Values that a slow receiver holds: repeated to the bit in every row until the next one, they are measured once.

So do values of a coarse resolution repeat while they change slowly. But such change by one step of the resolution, and
the faster the more often; held ones change every so many rows, and by what the train has moved meanwhile.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from ....core.physics.train import Array
from ..cell.numbers import Flags, Rows

LEAST_CHANGES = 10
"""Of fewer nothing is said."""

REGULAR, ONE_STEP, TOGETHER = 0.8, 0.8, 0.95
"""Shares of the changes: in the usual time, by the least step of all, and of the speed in the row of a new place."""


class Held(NamedTuple):
    """Which of the rows repeat a held value, where a new one stands, and how many rows it is held."""

    repeats: Flags
    begins: Flags
    usual: float


def without_held(rows: pd.DataFrame) -> tuple[pd.DataFrame, list[str]]:
    """Return the rows without the values that are held, and what was left out."""
    left_out: dict[str, Held] = {}
    for place in (["position"], ["lat", "lon"]):
        if set(place) <= set(rows) and (held := held_in(rows[place].to_numpy())):
            left_out |= dict.fromkeys(place, held)
    if "speed" in rows:
        speed = rows[["speed"]].to_numpy()
        held = next((each for each in left_out.values() if _with_place(speed, each)), None) or held_in(speed)
        left_out |= {"speed": held} if held else {}
    step_s = float(np.median(np.diff(rows["t_ns"]))) / 1e9 if left_out else 0.0
    notes = []
    for name, held in left_out.items():
        known, repeats = rows[name].notna(), held.repeats & rows[name].notna().to_numpy()
        rows[name] = rows[name].mask(repeats)
        notes.append(
            f"{name}: {repeats.sum()} of {known.sum()} rows repeat the one before, a new one comes every "
            f"{held.usual * step_s:.3g} s: left out, as held values"
        )
    return rows, notes


def held_in(values: Array) -> Held | None:
    """Return where values, shape (n, k), are held; None where they are not, or it is not plain.

    Of a long standstill one value is kept for each time that a value is usually held.
    """
    known = np.flatnonzero(np.isfinite(values).all(axis=1))
    begins = changes(values[known])
    held_rows = np.diff(begins)
    if len(held_rows) < LEAST_CHANGES:
        return None
    usual = float(np.median(held_rows))
    regular = (np.abs(held_rows - usual) <= max(1.0, usual / 4.0)) & (held_rows > 1)
    steps = np.abs(np.diff(values[known][begins], axis=0)).max(axis=1)
    by_one = steps < steps.min() * (1.0 + 1e-6)
    if usual < 2.0 or regular.mean() < REGULAR or by_one.mean() > ONE_STEP:
        return None
    since = np.arange(len(known)) - np.repeat(begins, np.diff(begins, append=len(known)))
    repeats, begin = (np.zeros(len(values), dtype=np.bool_) for _ in range(2))
    repeats[known] = since % int(np.ceil(1.5 * usual)) > 0
    begin[known[begins]] = True
    return Held(repeats, begin, usual)


def _with_place(speed: Array, place: Held) -> bool:
    """Whether a speed, shape (n, 1), changes where the place does, alone."""
    known = np.flatnonzero(np.isfinite(speed[:, 0]))
    rows = known[changes(speed[known])[1:]]
    return len(rows) >= LEAST_CHANGES and bool(place.begins[rows].mean() >= TOGETHER)


def changes(values: Array) -> Rows:
    """Rows that differ from the one before, and the first one."""
    return np.flatnonzero(np.append(True, (values[1:] != values[:-1]).any(axis=1))[: len(values)])
