# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Values over time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.physics.train import Array

Times = NDArray[np.int64]

MOST_ROWS = 4096
"""Rows that are Python's numbers at once."""


class Series(NamedTuple):
    """Values at increasing times; both of shape (n,)."""

    t_ns: Times
    values: NDArray[Any]

    def at(self, t_ns: Times) -> Array:
        """Values interpolated at other times; held constant before the first and after the last."""
        return np.asarray(np.interp(t_ns, self.t_ns, self.values), dtype=np.float64)

    def exactly(self, t_ns: Times, absent: Any = np.nan) -> NDArray[Any]:
        """Values at those very times, the last of several; `absent` where there is none."""
        if not self.t_ns.size:
            return np.full(t_ns.shape, absent)
        found = np.searchsorted(self.t_ns, t_ns, side="right") - 1
        return np.where((found >= 0) & (self.t_ns[found] == t_ns), self.values[found], absent)

    @property
    def known(self) -> Series:
        """Those that are numbers."""
        there = ~np.isnan(self.values)
        return Series(self.t_ns[there], self.values[there])

    def map(self, change: Callable[[Array], Any]) -> Series:
        """What `change` makes of the values, at the same times."""
        return self._replace(values=np.asarray(change(self.values)))

    def by_time(self) -> dict[int, Any]:
        """Values by time."""
        return dict(zip(self.t_ns.tolist(), self.values.tolist(), strict=True))


def in_rows(*columns: NDArray[Any]) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of columns as Python's own numbers, few at once: as objects they take four times their memory."""
    for first in range(0, columns[0].size, MOST_ROWS):
        yield from zip(*(column[first : first + MOST_ROWS].tolist() for column in columns), strict=True)


NONE = Series(np.array([], dtype=np.int64), np.array([]))
"""Of what was not recorded."""
