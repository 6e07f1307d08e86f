# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A train before a target, by the equations of motion alone: it shares no code with what supervises it.

The train runs with a constant acceleration and is never braked, whatever is told. Its brake would slow it by
a(v) = a0/(1 + v/v0), as adhesion falls with speed, or as drag rises where v0 < 0: from v to u on (F(v) - F(u))/a0 with
F(v) = v^2/2 + v^3/(3 v0); but nowhere by more than its force gives.
"""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ...core.physics.train import Array

Number = TypeVar("Number", float, Array)

BEYOND_MPS = 1000.0
"""No train is as fast."""


@dataclass(frozen=True, slots=True)
class Brake:
    """The emergency brake: times until it is built up, s, and how it slows then."""

    pulling_s: float
    """While the traction is still on."""
    coasting_s: float
    """From there until the brake is built up."""
    standing_mps2: float
    """Deceleration when nearly at a stand."""
    fading_mps: float
    """Speed at which the deceleration is half of that; where it is below 0, it rises with speed."""
    most_mps2: float
    """Deceleration that the brake gives at most, whatever the rail would bear."""
    pull_mps2: float
    """Acceleration while pulling; at most 0.4 while coasting, down a grade."""

    def times(self, share: float) -> "Brake":
        """A brake that slows so much less."""
        return replace(self, standing_mps2=self.standing_mps2 * share, most_mps2=self.most_mps2 * share)

    def slowing(self, speed_mps: Array) -> Array:
        """Deceleration, m/s^2, at each speed."""
        return np.minimum(self.standing_mps2 / (1.0 + speed_mps / self.fading_mps), self.most_mps2)

    def way(self, speed_mps: Array) -> Array:
        """Way, m, to a standstill of a train whose brake is built up."""
        knee = min(max(self.fading_mps * (self.standing_mps2 / self.most_mps2 - 1.0), 0.0), BEYOND_MPS)
        below, above = (self._by_force, self._by_rail) if self.fading_mps > 0.0 else (self._by_rail, self._by_force)
        return below(np.minimum(speed_mps, knee)) + above(np.maximum(speed_mps, knee)) - above(np.asarray(knee))

    def _by_rail(self, speed_mps: Array) -> Array:
        return (speed_mps**2 / 2.0 + speed_mps**3 / (3.0 * self.fading_mps)) / self.standing_mps2

    def _by_force(self, speed_mps: Array) -> Array:
        return speed_mps**2 / (2.0 * self.most_mps2)

    def needed(self, speed_mps: Array, allowed_mps: float) -> Array:
        """Way, m, from the command to brake until the train is no faster than allowed; -inf where it is not now."""
        rolling = min(self.pull_mps2, 0.4)
        off = speed_mps + self.pull_mps2 * self.pulling_s
        built_up = off + rolling * self.coasting_s
        before = (speed_mps + off) / 2.0 * self.pulling_s + (off + built_up) / 2.0 * self.coasting_s
        slowing = self.way(built_up) - self.way(np.asarray(allowed_mps))
        return np.where(speed_mps > allowed_mps, before + slowing, -np.inf)


@dataclass(frozen=True, slots=True)
class Train:
    """Runs from place 0 at time 0 on."""

    speed_mps: float
    acceleration_mps2: float
    brake: Brake

    def speed(self, t_s: Number) -> Number:
        """Speed, m/s."""
        return self.speed_mps + self.acceleration_mps2 * t_s

    def place(self, t_s: Number) -> Number:
        """Place of the front end, m."""
        return self.speed_mps * t_s + self.acceleration_mps2 * t_s**2 / 2.0


def allowed(target_mps: float) -> float:
    """Speed at which a train may pass a target: 7.5 km/h above, 15 from 210 km/h on; none above a stop."""
    if target_mps == 0.0:
        return 0.0
    return target_mps + float(np.interp(target_mps * 3.6, [110.0, 210.0], [7.5, 15.0])) / 3.6
