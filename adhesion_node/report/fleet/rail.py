# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Tables of brakings and of the rail as `brakings` writes them, and where the rail was low."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from ...core.physics.train import KMH
from ...run.results.brakings import CELL_M
from ...run.results.copies import without_copies
from ...run.results.rail_map import map_of
from .tables import read_table


class Fleet(NamedTuple):
    """Brakings in the order of time, and the rail by piece of track and date."""

    brakings: pd.DataFrame
    rail: pd.DataFrame
    by_piece: bool
    """The rail is a map that was written beside the brakings; else each braking counts alike along its whole way."""
    remarks: Sequence[str] = ()
    """Which brakings are there twice, and count once; which the map lacks."""


class Spot(NamedTuple):
    """Neighbouring pieces in each of which a braking showed a low adhesion."""

    from_m: float
    to_m: float
    lowest: float
    mu_lower: float
    """The least bound of its low pieces."""
    seen: int
    limited: int
    """Brakings that showed it; those whose adhesion limited there."""
    dates: int
    low_dates: int
    """Dates on which it was seen, and was low."""
    newest: str
    """Date on which it was low."""


def read_fleet(paths: Sequence[Path]) -> Fleet:
    """Read tables of brakings and at most one map. Raises ValueError with what to mend."""
    tables, maps = list[pd.DataFrame](), list[pd.DataFrame]()
    for path in paths:
        frame, is_map = read_table(path)
        (maps if is_map else tables).append(frame)
    if not tables or len(maps) > 1:
        raise ValueError(f"tables = {len(tables)} of brakings, {len(maps)} maps: give one or more, and one map at most")
    once, copies = without_copies(pd.concat([table for table in tables if not table.empty] or tables))
    brakings = once.sort_values("t_ns", ignore_index=True)
    if brakings.empty:
        raise ValueError(f"tables = {', '.join(map(str, paths))}: hold no braking, there is nothing to show")
    brakings["time"] = pd.to_datetime(brakings["t_ns"], utc=True)
    rail = maps[0] if maps else spread(brakings)
    remarks = (*copies, *_unmapped(brakings, rail))
    return Fleet(brakings, rail.sort_values(["date", "place_m"], ignore_index=True), bool(maps), remarks)


def _unmapped(brakings: pd.DataFrame, rail: pd.DataFrame) -> Iterator[str]:
    """What is said of brakings on dates of which the map has no piece."""
    dates = brakings["time"].dt.strftime("%Y-%m-%d")
    lacking = dates[~dates.isin(rail["date"])]
    if len(lacking):
        which = ", ".join(sorted(set(lacking))[:3]) + (", ..." if lacking.nunique() > 3 else "")
        remedy = "give the map that the same call of `brakings` wrote"
        yield f"the map has no piece of {which}, on which {len(lacking)} of the brakings are: {remedy}"


def spread(brakings: pd.DataFrame, cell_m: float = CELL_M) -> pd.DataFrame:
    """The rail by piece and date, as if each braking had shown what it did on its whole way."""
    ends = np.floor(brakings[["place_m", "place_end_m"]].to_numpy(np.float64) / cell_m).astype(np.int64)
    ways = [np.arange(min(pair), max(pair) + 1) for pair in ends.tolist()]
    cells = brakings.loc[brakings.index.repeat([way.size for way in ways])].assign(
        cell=np.concatenate([np.arange(0), *ways]),
        limited=lambda rows: rows["mu"].notna(),
        speed_mps=lambda rows: 0.5 * KMH * (rows["from_kmh"] + rows["to_kmh"]),
    )
    return map_of(cells, cell_m)


def over_dates(rail: pd.DataFrame) -> pd.DataFrame:
    """The rail by piece: lowest adhesion and least bound of all dates, where any adhesion limited, else the highest."""
    least = rail["mu_lower"].where(rail["mu"].notna())
    by = rail.assign(least=least).groupby("place_m")
    found = by.agg(length_m=("length_m", "max"), mu=("mu_lowest", "min"), used=("used", "max"), least=("least", "min"))
    return found.assign(mu_lower=found["least"].fillna(by["mu_lower"].max())).reset_index()


def low_spots(rail: pd.DataFrame, low: float) -> list[Spot]:
    """Where an adhesion below `low` was identified, the lowest first."""
    pieces = rail[rail["mu_lowest"] < low].groupby("place_m")["length_m"].max()
    places, ends = pieces.index.to_numpy(np.float64), (pieces.index + pieces).to_numpy(np.float64)
    parts = np.split(np.arange(places.size), np.flatnonzero(places[1:] > ends[:-1] + 1e-6) + 1)
    spots = [_spot(rail[rail["place_m"].isin(places[part])], ends[part[-1]], low) for part in parts if part.size]
    return sorted(spots, key=lambda spot: spot.lowest)


def _spot(rows: pd.DataFrame, to_m: float, low: float) -> Spot:
    was_low = rows[rows["mu_lowest"] < low]
    by_date = rows.groupby("date")[["seen", "limited"]].max().sum()  # a braking shows several of the pieces
    return Spot(
        from_m=float(rows["place_m"].min()),
        to_m=float(to_m),
        lowest=float(rows["mu_lowest"].min()),
        mu_lower=float(was_low["mu_lower"].min()),
        seen=int(by_date["seen"]),
        limited=int(by_date["limited"]),
        dates=int(rows["date"].nunique()),
        low_dates=int(was_low["date"].nunique()),
        newest=str(was_low["date"].max()),
    )
