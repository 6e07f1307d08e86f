# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A standstill of a train that runs, as a receiver without satellites tells it."""

from __future__ import annotations

import math
from typing import NamedTuple

from .outcome import Event, Outcome
from .plausibility import STRONGEST_MPS2, Pace
from .samples import Measurement, SpeedSample

S = 1_000_000_000

HELD_MPS = 3.0
"""What is slower is as good as standing: of such a train receivers tell that it stands."""

QUICKEST_NS = S // 10
"""Speeds that come faster may differ by as much as over this time: neither noise nor the last step of a train that
comes to a stand is a fall to a standstill."""


class Standing(NamedTuple):
    """A speed as it was measured last, and whether it is of a standstill that cannot be."""

    t_ns: int = 0
    speed_mps: float = math.nan
    silent: bool = False

    def fallen_mps(self, t_ns: int, strongest_mps2: float) -> float:
        """By how much a speed may have fallen until a time, where none falls faster."""
        return strongest_mps2 * max(abs(t_ns - self.t_ns), QUICKEST_NS) / S

    def after(self, t_ns: int, speed_mps: float, slowest_mps: float, runs: bool = False) -> Standing:
        """Note the next speed, NaN: not known; what was faster than `slowest_mps`, or `runs`, does not stand."""
        if math.isnan(speed_mps):
            return self
        silent = abs(speed_mps) < HELD_MPS and (self.silent or runs or abs(self.speed_mps) > slowest_mps)
        return Standing(t_ns, speed_mps, silent)


def moving(measurement: Measurement, standing: Standing, pace: Pace) -> tuple[Measurement, Standing, tuple[Event, ...]]:
    """Without speeds of a standstill that no brake brings about, or while positions run; and what is to be told."""
    newest_mps, kept, left_out = measurement.speed_mps, list[SpeedSample](), list[float]()
    for sample in measurement.all_speeds:
        slowest_mps = standing.fallen_mps(sample.t_ns, STRONGEST_MPS2) + HELD_MPS
        standing = standing.after(*sample[:2], slowest_mps, pace.runs)
        kept += [] if standing.silent else [sample]
        left_out += [sample.speed_mps] if standing.silent else []
    if not left_out:
        return measurement, standing, ()
    speeds = tuple(kept) if measurement.speeds else ()
    measurement = measurement._replace(speed_mps=None if standing.silent else newest_mps, speeds=speeds)
    return measurement, standing, (Event(Outcome.STUCK, f"speed x = {left_out[-1]:.6g}"),)
