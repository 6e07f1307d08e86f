# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which sensors a braking shows to lie: those that repeat themselves, an accelerometer that is turned round."""

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

STILL_S = 2.0
"""No accelerometer shows the same to the bit for so long behind the brake's application as before it."""


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
    """Whether it points forward as it should, and shows anything; None: no braking has shown it yet."""
    rested_mps2: float = math.nan
    """What it showed last before the brake, while it has shown nothing else since, ..."""
    still_s: float = 0.0
    """... and for how long behind the brake's application."""

    def resting(self, shown_mps2: float) -> Pointing:
        """Note what it shows while no brake is applied."""
        return self._replace(rested_mps2=shown_mps2, still_s=0.0)

    def after(self, shown_mps2: float, felt_mps2: float, variance: float, elapsed_s: float) -> Pointing:
        """Note what it shows under the brake, and the mean of that since the time before, of such a variance."""
        if shown_mps2 == self.rested_mps2:
            still_s = self.still_s + elapsed_s
            return self._replace(still_s=still_s, forward=False if still_s > STILL_S else self.forward)
        part = -math.expm1(-elapsed_s / MEAN_S)
        mean = self.mean_mps2 + part * (felt_mps2 - self.mean_mps2)
        noise = MEAN_SIGMA * math.sqrt(0.5 * part * variance)
        forward = False if mean > FORWARD_MPS2 + noise else True if mean < -BACKWARD_MPS2 - noise else self.forward
        return Pointing(mean, forward)
