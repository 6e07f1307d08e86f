# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""When a device measures, what stamps it gives, and when its messages arrive."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from adhesion_node.core.setting import check_settings, setting

from ..plant.journey import Array


@dataclass(frozen=True, slots=True)
class Spells:
    """Spells of time at random; `every_s` = 0: none."""

    every_s: float = 0.0
    """Mean time between two, exponential."""
    shortest_s: float = 2.0
    longest_s: float = 10.0

    def draw(self, until_s: float, rng: np.random.Generator) -> Array:
        """Beginnings and ends up to a time, s; shape (K, 2), in order."""
        found, at_s = list[tuple[float, float]](), 0.0
        while self.every_s > 0:
            begins_s = at_s + rng.exponential(self.every_s)
            if begins_s >= until_s:
                break
            at_s = begins_s + rng.uniform(self.shortest_s, self.longest_s)
            found.append((begins_s, at_s))
        return np.array(found).reshape(-1, 2)


NEVER = Spells()


def within(time_s: Array, spells: Array) -> NDArray[np.int64]:
    """Which spell, from 0, every one of N moments falls into, -1: into none; shape (N,)."""
    index = np.searchsorted(spells[:, 0], time_s, side="right") - 1
    ends = np.append(spells[:, 1], -np.inf)  # index -1 takes the last one
    return np.where(time_s < ends[index], index, -1)


@dataclass(frozen=True, slots=True)
class Timing:
    """The rhythm of a device. Raises ValueError naming what is out of range."""

    rate_hz: float = setting(10.0, "Measurements per second", "Hz", 0.01, 1000.0)
    latency_s: float = setting(0.02, "From the measurement to the message's arrival, at least", "s", 0.0, 60.0)
    jitter_s: float = setting(0.01, "Further latency, evenly from 0 to this", "s", 0.0, 60.0)
    history_s: float = setting(0.0, "What was measured in the first seconds arrives at their end", "s", 0.0, 60.0)
    stamp_error_s: float = setting(0.0, "By how much stamps are early or late, in spells", "s", 0.0, 3600.0)
    stamp_errors: Spells = NEVER
    outages: Spells = NEVER
    """In which nothing is measured."""

    def __post_init__(self) -> None:
        check_settings(self, "timing ")


class Schedule(NamedTuple):
    """N measurements in seconds of the journey; arrays of shape (N,)."""

    time_s: Array
    """When it is measured, a constant period apart, outages included."""
    stamp_s: Array
    """What the device believes that time to be."""
    arrival_s: Array
    """Never before an earlier measurement's."""
    works: NDArray[np.bool_]
    """Not in an outage."""


def schedule(timing: Timing, until_s: float, rng: np.random.Generator) -> Schedule:
    """Draw the measurements of a journey: the device begins at a random moment of its first period."""
    period_s = 1.0 / timing.rate_hz
    time_s = np.arange(rng.uniform(0.0, min(period_s, until_s)), until_s, period_s)
    late_s = timing.latency_s + timing.jitter_s * rng.random(time_s.size)
    wrong = timing.stamp_errors.draw(until_s, rng)
    errors_s = np.append(timing.stamp_error_s * rng.choice([-1.0, 1.0], len(wrong)), 0.0)
    return Schedule(
        time_s,
        time_s + errors_s[within(time_s, wrong)],
        np.maximum.accumulate(np.maximum(time_s + late_s, timing.history_s)),
        within(time_s, timing.outages.draw(until_s, rng)) < 0,
    )
