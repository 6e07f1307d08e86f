# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A 0 that stands for no value among pressures or a wheel's turns: gone for a moment, and back the same."""

from collections.abc import Iterator

import numpy as np

from ....core.physics.train import Array
from ..cell.numbers import Flags
from ..format import PRESSURES
from ..whole import Log

LEAST_TIMES, LONGEST_S = 3, 2.5
"""So often a value is gone, and for no longer: a brake is released, and cylinders are vented, for longer."""

SAME = 0.05
"""By so much of it values differ before and behind: what slide protection vents comes back little by little."""

LEAST_PA, LEAST_RADPS = 5e4, 10.0
"""Of less nothing is said: a brake that begins or ends, and wheels that stop."""


def dropouts(log: Log) -> Iterator[str]:
    """Say which columns are 0 for moments only."""
    t_s = log.rows["t_ns"].to_numpy() / 1e9
    for name in (*PRESSURES[:2], *log.columns.axles):
        if name not in log.rows:
            continue
        values = log.rows[name].to_numpy() - log.form.offset(name)
        is_pipe = name not in log.columns.names and name in PRESSURES  # empty, it asks for a full brake
        gone = _gone(t_s, values, values == (np.nanmax(values, initial=0.0) if is_pipe else 0.0), _least(name))
        if gone:
            yield (
                f"{'brake_pipe' if is_pipe else name} is {'at its lowest' if is_pipe else '0'} in {gone} rows between "
                "others of the same value: no value? Leave those cells empty"
            )


def _least(name: str) -> float:
    return LEAST_PA if name in PRESSURES else LEAST_RADPS


def _gone(t_s: Array, values: Array, is_mark: Flags, least: float) -> int:
    """In how many rows a value is the mark for a moment, and the same before and behind; 0 where it seldom is."""
    known = np.isfinite(values)
    t_s, values, is_mark = t_s[known], values[known], is_mark[known]
    edges = np.diff(is_mark.astype(np.int8), prepend=0, append=0)
    first, behind = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    inside = (first > 0) & (behind < len(values))
    first, behind = first[inside], behind[inside]
    a, b, mark = values[first - 1], values[behind], values[first]
    is_same = np.abs(a - b) < SAME * np.maximum(np.abs(a - mark), np.abs(b - mark))
    brief = is_same & (np.abs(a - mark) > least) & (t_s[behind] - t_s[first - 1] < LONGEST_S)
    return int((behind - first)[brief].sum()) if brief.sum() >= LEAST_TIMES else 0
