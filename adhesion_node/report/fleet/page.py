# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The page of many brakings: low spots, the rail over place and date, a row for each braking."""

from collections.abc import Iterator
from html import escape
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from ...web import as_json, page
from ..drawn.parts import table_html, value_or, versions
from ..drawn.thinning import rounded
from ..found.distances import FIXED_MU
from .rail import Fleet, Spot, low_spots, over_dates

EDGES = (0.05, FIXED_MU, 0.1, 0.15)
"""Between the colours of the map."""

MOST_DATES = 100
"""Dates of the map, the newest; the others count for the low spots and the line over all dates."""

ALL = "all dates"

AS_BRAKINGS = (
    "Each braking counts by its median along its whole way; <code>brakings --map</code> tells the pieces apart."
)


def fleet_page(fleet: Fleet, low: float) -> str:
    """Return the page; an adhesion below `low` is a low spot."""
    dates = sorted(set(fleet.rail["date"]))[: -MOST_DATES - 1 : -1]
    rail, track = fleet.rail, _track(fleet.rail)
    lines = {ALL: _line(over_dates(rail))} | {day: _line(rail[rail["date"] == day]) for day in dates}
    highest = float(np.nanmax([low, *rail["mu"], *rail["used"]]))
    data = {"lines": lines, "track": [each / 1e3 for each in track], "highest": round(1.1 * highest, 4), "low": low}
    subtitle = "Wheel–rail adhesion as many brakings showed it. μ̂ is told where the adhesion limited; else there is"
    left_out = len(set(rail["date"])) - len(dates)
    return page(
        "fleet",
        title=escape(f"{len(fleet.brakings)} brakings"),
        subtitle=f"{subtitle} at least what the train used, μ ≥. Places and dates are those of the tables, UTC.",
        findings=_findings(fleet),
        low=f"{low:g}",
        spots=_spots(fleet, low),
        note="" if fleet.by_piece else AS_BRAKINGS,
        legend=_legend(),
        map=_map(fleet, dates, track) + (f"<p>and {left_out} earlier dates</p>" if left_out else ""),
        dates="".join(f"<option>{escape(name)}</option>" for name in lines),
        brakings=_brakings(fleet.brakings),
        versions=versions(),
        data=as_json(data),
    )


def _track(rail: pd.DataFrame) -> tuple[float, float]:
    """From the first piece to the end of the last, m."""
    return (
        (float(rail["place_m"].min()), float((rail["place_m"] + rail["length_m"]).max())) if len(rail) else (0.0, 1.0)
    )


def _line(rail: pd.DataFrame) -> dict[str, Any]:
    """Steps over place, km: a piece has its value from its beginning to its end; a gap where no train braked."""
    from_m, length = rail["place_m"].to_numpy(np.float64), rail["length_m"].to_numpy(np.float64)
    to_m = from_m + length
    mu, used = rail["mu"], rail["used"].where(rail["mu"].isna())
    columns = [column.to_numpy(np.float64) for column in (mu, used, rail["mu_lower"])]
    gap = np.append(from_m[1:] > to_m[:-1] + 1e-6, True) if len(rail) else np.array([], bool)
    # One place has one value: the end of a piece is a millimetre before the beginning of the next.
    places = np.column_stack([from_m, to_m - 1e-3, np.where(gap, to_m, np.nan)])
    kept = ~np.isnan(places)
    steps = [np.column_stack([each, each, np.full(each.size, np.nan)])[kept] for each in columns]
    names = ("identified", "atleast", "bound")
    return {"x": rounded(places[kept] / 1e3, 6)} | {k: rounded(v, 5) for k, v in zip(names, steps, strict=True)}


def _findings(fleet: Fleet) -> str:
    of, rail = fleet.brakings, fleet.rail
    low, high = _track(rail)
    limited = of[of["mu"].notna()]
    rows = [["Brakings", str(len(of))], ["Trains", str(of["train"].nunique())]]
    rows.append(["Recordings", str(of["recording"].nunique())])
    rows.append(["Time", f"{of['time'].min():%Y-%m-%d %H:%M} to {of['time'].max():%Y-%m-%d %H:%M}"])
    rows.append(["Track", f"{low / 1e3:.1f} to {high / 1e3:.1f} km"])
    rows.append(["Adhesion identified", f"in {len(limited)} of {len(of)} brakings"])
    if len(limited):
        rows.append(["μ̂, median of these", f"{limited['mu'].median():.4f}"])
    return table_html(["finding", "all"], rows)


def _spots(fleet: Fleet, low: float) -> str:
    spots = low_spots(fleet.rail, low)
    if spots:
        header = ("place", "lowest μ̂", "lower bound", "brakings", "adhesion limited in", "low on", "last low")
        return table_html(header, map(_spot, spots))
    known = fleet.rail[fleet.rail["mu_lowest"].notna()]
    if known.empty:
        return "<p>None known: the adhesion limited in no braking.</p>"
    at = known.loc[known["mu_lowest"].idxmin()]
    return f"<p>None. The lowest is {at['mu_lowest']:.4f} at {at['place_m'] / 1e3:.2f} km on {escape(at['date'])}.</p>"


def _spot(spot: Spot) -> list[str]:
    place = _button(f"{spot.from_m / 1e3:.2f} to {spot.to_m / 1e3:.2f} km", spot.from_m, spot.to_m)
    values = [f"{spot.lowest:.4f}", value_or(spot.mu_lower, "{:.4f}"), str(spot.seen), str(spot.limited)]
    return [place, *values, f"{spot.low_dates} of {spot.dates} dates", escape(spot.newest)]


def _button(text: str, from_m: float, to_m: float, date: str = ALL) -> str:
    ends = f'data-from="{min(from_m, to_m) / 1e3:.3f}" data-to="{max(from_m, to_m) / 1e3:.3f}"'
    return f'<button type="button" {ends} data-date="{escape(date)}">{escape(text)}</button>'


def _legend() -> str:
    between = (f"{low:g} to {high:g}" for low, high in pairwise(EDGES))
    names = (f"below {EDGES[0]:g}", *between, f"from {EDGES[-1]:g}")
    return " ".join(f'<span><i class="tile m{kind}"></i>{name}</span>' for kind, name in enumerate(names))


def _map(fleet: Fleet, dates: list[str], track: tuple[float, float]) -> str:
    body = []
    for day in dates:
        rail = fleet.rail[fleet.rail["date"] == day]
        lowest = value_or(rail["mu_lowest"].min(), "{:.4f}")
        strip = (
            f'<svg class="strip" viewBox="{track[0]} 0 {track[1] - track[0]} 2" preserveAspectRatio="none" role="img"'
        )
        strip += f' aria-label="Rail on {escape(day)}: lowest μ̂ {lowest}">'
        strip += "".join([*_tiles(rail, "mu", 0), *_tiles(rail, "mu_lower", 1)]) + "</svg>"
        bound = value_or(rail["mu_lower"].min(), "{:.4f}")
        body.append([_button(day, *_track(rail), day), strip, str(int(rail["seen"].max())), lowest, bound])
    way = f"{track[0] / 1e3:.1f} to {track[1] / 1e3:.1f} km: μ̂ above, its lower bound below"
    return table_html(["date", way, "brakings at a place, most", "lowest μ̂", "least bound"], body)


def _tiles(rail: pd.DataFrame, column: str, row: int) -> Iterator[str]:
    """Rectangles, m wide; neighbours of one colour are one."""
    known = rail[rail[column].notna()]
    kinds, starts = np.digitize(known[column], EDGES), known["place_m"].to_numpy(np.float64)
    ends = starts + known["length_m"].to_numpy(np.float64)
    apart = (np.diff(kinds) != 0) | (starts[1:] > ends[:-1] + 1e-6)
    for part in np.split(np.arange(starts.size), np.flatnonzero(apart) + 1) if starts.size else ():
        first, last = part[0], part[-1]
        place = f'x="{starts[first]:g}" y="{row}" width="{ends[last] - starts[first]:g}" height="1"'
        lowest = known[column].to_numpy(np.float64)[part].min()
        told = f"{starts[first] / 1e3:.2f} to {ends[last] / 1e3:.2f} km: {lowest:.4f}"
        yield f'<rect class="tile m{kinds[first]}" {place}><title>{told}</title></rect>'


def _brakings(brakings: pd.DataFrame) -> str:
    header = ("time, UTC", "train", "place, km", "km/h", "m/s²", "limited by", "μ̂ identified", "lowest", "else μ ≥")
    foreseen = ("lower bound", "safe distance, m", "by μ̂, m")
    return table_html([*header, *foreseen], map(_row, brakings.to_dict("records")))


def _row(row: dict[str, Any]) -> list[str]:
    identified = row["mu"] == row["mu"]
    limits = (("adhesion", "share_adhesion"), ("the brake", "share_brake"), ("nothing is claimed", "share_unclaimed"))
    mu = f"{row['mu']:.4f} ± {row['mu_std']:.4f}" if identified else "–"
    return [
        _button(f"{row['time']:%Y-%m-%d %H:%M:%S}", row["place_m"], row["place_end_m"], f"{row['time']:%Y-%m-%d}"),
        escape(str(row["train"])),
        f"{row['place_m'] / 1e3:.2f} → {row['place_end_m'] / 1e3:.2f}",
        f"{row['from_kmh']:.0f} → {row['to_kmh']:.0f}",
        f"{row['deceleration_mps2']:.2f}",
        ", ".join(f"{name} {row[share]:.0%}" for name, share in limits if row[share] > 0.005),
        mu,
        value_or(row["mu_least"], "{:.4f}"),
        "–" if identified else value_or(row["used"], "{:.4f}"),
        value_or(row["mu_lower"], "{:.4f}"),
        value_or(row["safe_m"], "{:.0f}"),
        value_or(row["nominal_m"], "{:.0f}"),
    ]
