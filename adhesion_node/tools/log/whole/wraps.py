# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Positions of a counter that begins anew behind its last number, while the train runs on at the same speed."""

import numpy as np
import pandas as pd

from ....core.physics.train import Array
from ....run.results.seen import FASTEST_MPS
from ..cell.numbers import Rows
from ..format import POSITION_UNITS, Format

LEAST_M = 100.0
"""A lesser leap may be an outlier."""

AROUND_S = 3.0
"""The speed is that over so long before and behind a leap."""

SAME_MPS, SAME, NEAR_M = 2.0, 0.2, 5.0
"""By so much the speeds of both sides may differ, or by this part, and the leap from what they make of it."""

BITS = (8, 10, 12, 14, 15, 16, 20, 24, 31, 32)


def unwrapped(rows: pd.DataFrame, form: Format) -> tuple[pd.DataFrame, list[str]]:
    """Return the rows with positions that go on where their counter wrapped, and what was done."""
    known = np.flatnonzero(rows["position"].notna()) if "position" in rows else np.zeros(0, dtype=np.intp)
    place, t_s = rows["position"].to_numpy()[known] if known.size else np.zeros(0), rows["t_ns"].to_numpy()[known] / 1e9
    leaps = np.flatnonzero(np.abs(np.diff(place)) > np.maximum(LEAST_M, FASTEST_MPS * np.diff(t_s)))
    if not 0 < 10 * len(leaps) < len(place):
        return rows, []
    unit = form.unit("position")
    scale = POSITION_UNITS[unit]
    ranges_m = _ranges(place / scale) * scale
    found = {_range_of(place, t_s, leap, ranges_m, leaps) for leap in leaps.tolist()}
    range_m = found.pop() if len(found) == 1 else None
    if range_m is None or np.ptp(place) > range_m:
        return rows, []
    turns = np.zeros(len(place))
    turns[leaps + 1] = -np.sign(place[leaps + 1] - place[leaps])
    rows.iloc[known, rows.columns.get_loc("position")] = place + range_m * np.cumsum(turns)
    times = "once" if len(leaps) == 1 else f"{len(leaps)} times"
    return rows, [
        f"position: a counter up to {range_m / scale:.6g} {unit} wrapped {times} as the train ran on: unwrapped"
    ]


def _ranges(written: Array) -> Array:
    """What a counter of such numbers may go up to: powers of 2 and of 10 of its resolution."""
    digits = next((n for n in range(4) if np.allclose(written, np.round(written, n), rtol=0.0, atol=1e-6)), 0)
    powers = [*(2.0**n for n in BITS), *(10.0**n for n in range(2, 8))]
    return np.unique([power * 10.0**-n for n in range(digits + 1) for power in powers])


def _range_of(place: Array, t_s: Array, leap: int, ranges_m: Array, leaps: Rows) -> float | None:
    """The range that the counter leapt back by, where the train ran on over the leap; None where it did not."""
    first, last = np.searchsorted(t_s, (t_s[leap] - AROUND_S, t_s[leap + 1] + AROUND_S))
    last = min(int(last), len(t_s) - 1)
    if np.count_nonzero((leaps >= first) & (leaps < last)) > 1 or first == leap or last == leap + 1:
        return None
    before, behind = ((place[b] - place[a]) / (t_s[b] - t_s[a]) for a, b in ((first, leap), (leap + 1, last)))
    step_s = t_s[leap + 1] - t_s[leap]
    way_m, leapt_m = (before + behind) / 2.0 * step_s, place[leap + 1] - place[leap]
    i = int(np.argmin(np.abs(ranges_m - abs(leapt_m - way_m))))
    fits = abs(ranges_m[i] - abs(leapt_m - way_m)) < NEAR_M + SAME * abs(way_m)
    same = abs(before - behind) < max(SAME_MPS, SAME * abs(before)) and before * leapt_m < 0.0
    return float(ranges_m[i]) if fits and same else None
