# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A run split into its brakings."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...run.results.brakings import split
from ...run.results.seen import BRAKED_PA
from ..read.numbers import number
from ..read.run import Run
from ..read.series import Series

RELEASED_NS = 3_000_000_000
"""The brake is released once it has not worked for so long, longer than a dump lasts."""

SLOWS_NS, SLOWS_MPS = 3_000_000_000, 0.6
"""Without a recorded pressure a train brakes that has lost so much speed in so long: no resistance does that."""


class Braking(NamedTuple):
    """A braking from when to when, and which estimates are of it: indices from `first` to `last`."""

    start_ns: int
    end_ns: int
    first: int
    last: int


@lru_cache
def brakings(run: Run) -> list[Braking]:
    """Return the brakings in their order."""
    (t_ns, speed), under_brake = run.speed, _under_brake(run)
    parts = split(range(t_ns.size), under_brake.item, lambda at: (t_ns.item(at), speed.item(at)))
    return [Braking(t_ns.item(part[0]), t_ns.item(part[-1]), part[0], part[-1]) for part in parts]


def _under_brake(run: Run) -> NDArray[np.bool_]:
    """Whether the brake works at the estimates, a dump by the slide protection included; shape (n,)."""
    times = run.speed.t_ns
    if not run.pressure.t_ns.size:
        speed = run.speed.map(np.abs)
        return np.asarray(speed.at(times - SLOWS_NS) - speed.values > SLOWS_MPS)
    braked_ns = run.pressure.t_ns[run.pressure.values >= BRAKED_PA]
    never = np.iinfo(np.int64).max // 4
    around = np.concatenate([[-never], braked_ns, [never]])
    after = np.searchsorted(around, times)
    return np.asarray((around[after] == times) | (around[after] - around[after - 1] <= RELEASED_NS))


def rises(series: Series, start_ns: int, end_ns: int) -> list[int]:
    """Times within which a counter has risen."""
    first, end = np.searchsorted(series.t_ns, [start_ns, end_ns + 1])
    part = slice(max(first - 1, 0), end)
    counts = np.nan_to_num([number(value) for value in series.values[part].tolist()])
    return [int(t) for t in series.t_ns[part][1:][np.diff(counts) > 0]]
