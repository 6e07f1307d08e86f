# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A speed that lies: it repeats itself while the train slows."""

from __future__ import annotations

import math
from typing import NamedTuple

COARSEST_MPS = 0.5
"""No sensor has greater steps: a mile per hour."""

STEPS = 4.0
"""Steps of the sensor that a train has lost, beside the sensor's error, whose speed cannot be the same any more."""

BY_CHANCE = 1
"""How often a speed comes again by chance: one of many that err by few steps does so now and then."""


class Repeating(NamedTuple):
    """A speed as it was measured last, and by how much the train had slowed when it was first measured so."""

    speed_mps: float = math.nan
    slowed_mps: float = 0.0
    step_mps: float = COARSEST_MPS
    """Smallest step that the sensor has ever made: a coarse one repeats itself while it works."""
    again: int = 0
    """How often it has come again."""

    def after(self, speed_mps: float, slowed_mps: float) -> Repeating:
        """Note the next speed, NaN if it is not known, and by how much the train has slowed under the brake in all."""
        if math.isnan(speed_mps):
            return self
        if speed_mps == self.speed_mps:
            return self._replace(again=self.again + 1)
        step_mps = abs(speed_mps - self.speed_mps)
        return Repeating(speed_mps, slowed_mps, step_mps if step_mps < self.step_mps else self.step_mps)  # not if NaN

    def is_stuck(self, slowed_mps: float, variance: float) -> bool:
        """Whether the train cannot have this speed any more, which has such a variance; at 0 it stands."""
        lost_mps = slowed_mps - self.slowed_mps
        lost = lost_mps > STEPS * self.step_mps + math.sqrt(variance)
        return lost and self.again > BY_CHANCE and self.speed_mps != 0.0
