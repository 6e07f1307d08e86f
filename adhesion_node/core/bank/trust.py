# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which sensors a braking shows to lie: a speed that repeats itself, an accelerometer that is turned round."""

from __future__ import annotations

import math
from typing import NamedTuple

from .layout import SPEED, Bank

COARSEST_MPS = 0.5
"""No sensor has greater steps: a mile per hour."""

STEPS = 4.0
"""Steps of the sensor that a train has lost, beside the sensor's error, whose speed cannot be the same any more."""

FORWARD_MPS2, BACKWARD_MPS2, MEAN_S, MEAN_SIGMA = 0.2, 0.1, 1.0, 3.0
"""What an accelerometer feels under the brake in the mean over such a time, beyond its noise, once it is turned round,
and once it is seen not to be."""


class Repeating(NamedTuple):
    """A speed, and what the train must have lost under the brake since it was first measured so."""

    speed_mps: float = math.nan
    lost_mps: float = 0.0
    step_mps: float = COARSEST_MPS
    """Smallest step that the sensor has ever made: a coarse one repeats itself while it works."""

    def slowed(self, before: Bank, bank: Bank) -> Repeating:
        """The train is foreseen to have slowed from one belief to the next."""
        return self._replace(lost_mps=self.lost_mps + before.mean_of(SPEED) - bank.mean_of(SPEED))

    def after(self, speed_mps: float) -> Repeating:
        """Note the next speed."""
        if speed_mps == self.speed_mps:
            return self
        step_mps = abs(speed_mps - self.speed_mps)
        return Repeating(speed_mps, 0.0, step_mps if step_mps < self.step_mps else self.step_mps)  # never true of NaN

    def is_stuck(self, variance: float) -> bool:
        """Whether the train cannot have this speed any more, which has such a variance; at 0 it stands."""
        return self.speed_mps != 0.0 and self.lost_mps > STEPS * self.step_mps + math.sqrt(variance)


class Pointing(NamedTuple):
    """Where an accelerometer points, by what it feels under the brake in the mean of the last second."""

    mean_mps2: float = 0.0
    """Forward positive."""
    forward: bool | None = None
    """Whether it points forward as it should; None: no braking has shown it yet."""

    def after(self, felt_mps2: float, variance: float, elapsed_s: float) -> Pointing:
        """Note the mean of what was felt under the brake since the time before, of such a variance."""
        part = -math.expm1(-elapsed_s / MEAN_S)
        mean = self.mean_mps2 + part * (felt_mps2 - self.mean_mps2)
        noise = MEAN_SIGMA * math.sqrt(0.5 * part * variance)
        if mean > FORWARD_MPS2 + noise:
            return Pointing(mean, False)
        return Pointing(mean, True if mean < -BACKWARD_MPS2 - noise else self.forward)
