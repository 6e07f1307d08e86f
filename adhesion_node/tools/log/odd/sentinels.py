# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Numbers that stand for no value, -9999 or 65535: in many rows to the bit, and far from all others."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from ....core.physics.train import Array
from ....run.results.seen import FASTEST_MPS
from ..cell.marks import marks
from ..whole.read import Log

LEAST_ROWS = 3
"""A single number far from the others is an outlier."""

FAR, FAR_MARK = 3.0, 0.01
"""From the next number: in spreads of all others; for one of the marks in its own size."""

LEAPS, MOSTLY = {"position": (100.0, FASTEST_MPS), "speed": (5.0, 30.0)}, 0.9
"""No train's place or speed changes by the first and so much in a second besides."""

OF_A_PLACE = ("position", "lat", "lon", "height")
"""They change little by little, whereas a pressure or an acceleration may leave 0 at once."""


def sentinels(log: Log) -> Iterator[str]:
    """Say which number of a column seems to stand for no value."""
    factors = log.form.factors()
    for name in log.rows.columns.drop("t_ns"):
        kind = "wheel_speed" if name in log.columns.axles else name
        values = log.rows[name].dropna().to_numpy() - log.form.offset(name)
        for mark, rows in _extremes(values):
            written = mark / factors.get(kind, 1.0)
            others = values[values != mark]
            away = float(np.abs(others - mark).min())
            is_mark = bool(marks(np.array(written))) and away > FAR_MARK * abs(mark)
            if is_mark or _leaps(log.rows, name, mark) or (name in OF_A_PLACE and away > FAR * np.ptp(others) > 0.0):
                yield f"{name} is {written:.6g} in {rows} rows, far from all others: no value? Leave those cells empty"


def _leaps(rows: pd.DataFrame, name: str, mark: float) -> bool:
    """Whether a train's place or speed leaps to 0, or below, and back as none can, nearly whenever it has it."""
    if name not in LEAPS or mark > 0.0:
        return False
    known = rows[["t_ns", name]].dropna().to_numpy()
    is_mark = known[:, 1] == mark
    at = np.flatnonzero(is_mark[1:] != is_mark[:-1])
    steps_s, steps = np.diff(known, axis=0)[at].T
    least, per_s = LEAPS[name]
    return len(at) > 2 * LEAST_ROWS and bool((np.abs(steps) > least + per_s * steps_s / 1e9).mean() > MOSTLY)


def _extremes(values: Array) -> Iterator[tuple[float, int]]:
    """The least and the greatest number, where many rows have it, and how many."""
    for mark in (float(values.min()), float(values.max())) if len(values) and np.ptp(values) > 0.0 else ():
        if (rows := int(np.count_nonzero(values == mark))) >= LEAST_ROWS:
            yield mark, rows
