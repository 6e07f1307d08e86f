# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Series made short enough for a page: no peak is lost, and no gap is bridged."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.physics.train import Array
from ..read.series import Series, Times

GAP_STEPS, GAP_NS = 5.0, 3e9
"""Values further apart than so many usual steps, and than so long, have a gap between them."""


def evenly(size: int, most: int) -> Times:
    """Indices of about `most` of `size` values, evenly spread, with the first and the last."""
    return np.unique(np.linspace(0, size - 1, min(size, most)).round().astype(np.int64)) if size else np.arange(0)


def peaks(values: Array, most: int) -> Times:
    """Indices of about `most` values: the lowest and the highest of equal parts, with the first and the last.

    >>> peaks(np.array([0.0, 1.0, 9.0, 1.0, 1.0, -5.0, 1.0, 0.0]), 4).tolist()
    [0, 2, 4, 5, 7]
    """
    if values.size <= most:
        return np.arange(values.size)
    kept = [0, values.size - 1]
    for part in np.array_split(np.arange(values.size), max(most // 2, 1)):
        known = part[np.isfinite(values[part])]
        unknown = part[:1] if known.size < part.size else part[:0]
        kept += [*known[[np.argmin(values[known]), np.argmax(values[known])]], *unknown] if known.size else [*unknown]
    return np.unique(np.array(kept, dtype=np.int64))


def with_gaps(series: Series) -> Series:
    """Put a value that is none between values that are far apart."""
    steps = np.diff(series.t_ns)
    if not steps.size:
        return series
    wide = np.flatnonzero(steps > max(GAP_STEPS * float(np.median(steps)), GAP_NS))
    times = series.t_ns[wide] + steps[wide] // 2
    values = np.insert(np.asarray(series.values, dtype=np.float64), wide + 1, np.nan)
    return Series(np.insert(series.t_ns, wide + 1, times), values)


def rounded(values: ArrayLike, digits: int) -> list[float | None]:
    """Numbers for JSON; None, a gap in the chart, for what is not finite."""
    numbers: list[float] = np.round(np.asarray(values, dtype=np.float64), digits).tolist()
    return [number if math.isfinite(number) else None for number in numbers]


def number(value: Any, digits: int) -> float | None:
    """One of them."""
    return rounded([value], digits)[0]
