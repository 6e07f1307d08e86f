# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whether an accelerometer shows gravity as it should: across the track and in m/s^2, or not at all.

Where its message has all three axes, these tell of themselves what the one along the track cannot: the unit, and
whether the device lies as it is told to.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from ..wire.messages.parts import NS
from ..wire.messages.refused import Reason, Rejected

MEAN_S, LEAST, MOST_ERROR_MPS2 = 30.0, 4.0, 0.1
"""Time of the mean that is looked at, longer than a curve or a braking lasts; how much must have come for it, and its
standard deviation, beyond which shocks hide what it is."""

G_MPS2, MOST_MPS2 = (0.9, 1.1), 12.0
"""Gravity in g as m/s^2, and what is more than gravity; a device that takes it out shows none."""

SHOWN = 1e4
"""More is no acceleration in any unit."""

ALONG_MPS2, SIGMA = 4.0, 3.0
"""No train gains or loses speed so for long; a device that lies so askew shows a part of its gravity."""


class Gravity(NamedTuple):
    """What an accelerometer shows in the mean along its three axes, older samples fading."""

    t_ns: int = 0
    weight: float = 0.0
    """How many samples that is."""
    mean_mps2: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spread: float = 0.0
    """Sum of the squares by which samples differ from it."""

    def after(self, t_ns: int, shown: Any) -> Gravity:
        """Note what it shows next, a vector; an axis without a number counts as 0."""
        fading = math.exp(-max(t_ns - self.t_ns, 0) / (MEAN_S * NS))
        weight = fading * self.weight + 1.0
        axes = [float(each) if abs(each) <= SHOWN else 0.0 for each in (shown.x, shown.y, shown.z)]
        x, y, z = (mean + (each - mean) / weight for each, mean in zip(axes, self.mean_mps2, strict=True))
        apart = sum((each - was) * (each - now) for each, was, now in zip(axes, self.mean_mps2, (x, y, z), strict=True))
        return Gravity(t_ns, weight, (x, y, z), fading * self.spread + apart)

    def check(self) -> None:
        """Raise Rejected where that is no acceleration along the track in m/s^2."""
        error = math.sqrt(self.spread) / self.weight
        if self.weight <= LEAST:
            return
        along, across = self.mean_mps2[0], math.hypot(*self.mean_mps2[1:])
        sure = error < MOST_ERROR_MPS2 and G_MPS2[0] < across < G_MPS2[1]
        if sure or across - SIGMA * error > MOST_MPS2:
            raise Rejected(
                Reason.ACCELERATION_UNIT, f"imu linear_acceleration across the track = {across:.3g} in the mean"
            )
        if abs(along) - SIGMA * error > ALONG_MPS2:
            raise Rejected(Reason.GRAVITY_ALONG, f"imu linear_acceleration x = {along:.3g} in the mean")
