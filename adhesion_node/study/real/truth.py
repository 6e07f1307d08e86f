# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What truly was at the times of the estimates: adhesion used, sliding axles, the remaining way, the rail's borders."""

from typing import NamedTuple

import numpy as np

from sim_node.real.plant.journey import Journey
from sim_node.real.plant.validation import slid

from ...core.physics.train import Array
from ...run.results.used import averaged

BORDER_RATIO = 0.75
"""A rail has a border where its adhesion falls below this share of what it was, or rises above its inverse, ..."""

BORDER_M = 100.0
"""... within this distance."""

MARGIN = 0.05
"""Part of the change at either end of a border that does not count."""


class Border(NamedTuple):
    """Where the rail changes: times, s, between which the train passes it, and by what the adhesion is multiplied."""

    start_s: float
    end_s: float
    ratio: float


class Truth(NamedTuple):
    """What truly was at N times, arrays (N,), of a journey."""

    true_speed_mps: Array
    used: Array
    """Adhesion that the train's force used, averaged over a second."""
    available: Array
    slid: Array
    """Share of the axle groups that slid lately: slide protection lets them roll in between."""
    remaining_m: Array
    """Way to the standstill; NaN before the full brake."""


def truth_at(journey: Journey, t_s: Array) -> Truth:
    """Look the truth up at N times, s."""
    remaining = np.where(journey.time_s >= journey.full_from_s, journey.position_m[-1] - journey.position_m, np.nan)
    used = averaged(np.round(1e9 * journey.time_s).astype(np.int64), journey.used)
    columns = (journey.speed_mps, used, journey.available, slid(journey).mean(axis=1), remaining)
    return Truth(*(np.interp(t_s, journey.time_s, column) for column in columns))


def borders(journey: Journey) -> list[Border]:
    """Where the adhesion that the rail offers the train falls or rises by a quarter within 100 m, in order of passing.

    A border begins and ends where a twentieth and all but a twentieth of the change, in logarithms, is done: a long
    train takes its length to pass it.
    """
    moving = np.concatenate(([True], np.diff(journey.position_m) > 0.0))
    place, offered, time_s = journey.position_m[moving], np.log(journey.available[moving]), journey.time_s[moving]
    half = BORDER_M / 2
    change = np.interp(place + half, place, offered) - np.interp(place - half, place, offered)
    found = list[Border]()
    for which in (change < np.log(BORDER_RATIO), change > -np.log(BORDER_RATIO)):
        index = np.flatnonzero(which)
        apart = np.flatnonzero(np.diff(place[index]) > BORDER_M) + 1  # nearer ones are one, roughened
        for run in np.split(index, apart) if index.size else ():
            around = np.flatnonzero((place >= place[run[0]] - half) & (place <= place[run[-1]] + half))
            before, after = offered[around[[0, -1]]]
            done = (offered[around] - before) / (after - before)
            first, last = around[np.argmax(done > MARGIN)], around[::-1][np.argmax(done[::-1] < 1.0 - MARGIN)]
            found.append(Border(float(time_s[first]), float(time_s[max(first, last)]), float(np.exp(after - before))))
    return sorted(found)
