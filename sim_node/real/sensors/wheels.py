# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The wheel speeds of every axle group, or of some; one bogie's may be missing for a while."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from adhesion_node.core.setting import check_settings, setting
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import WHEEL_SPEED

from ..plant.journey import Array
from .sensor import Measured, Ride
from .timing import NEVER, Spells, within


@dataclass(frozen=True, slots=True)
class Wheels:
    """The tachos of the axle groups. Raises ValueError naming what is out of range."""

    topic: ClassVar[Topic] = WHEEL_SPEED
    noise: float = setting(0.003, "Noise over the speed", "", 0.0, 0.5)
    resolution_radps: float = setting(0.02, "Step of the numbers", "rad/s", 1e-6, 10.0)
    dropouts: Spells = NEVER
    """In which one group, another every time, shows nothing."""
    heard: tuple[float, float] = (0.0, 1.0)
    """Part of the train, from its front on, whose groups have a tacho; of no length: the one group there."""

    def __post_init__(self) -> None:
        check_settings(self, "wheels ")

    def groups(self, count: int) -> range:
        """Return which of so many groups have one, counted from 0: one at least."""
        first, end = (int(part * count) for part in self.heard)
        return range(first, max(end, first + 1))

    def measure(self, ride: Ride, time_s: Array, rng: np.random.Generator) -> Measured:
        """Measure the angular speeds, rad/s."""
        true = np.column_stack([ride.at(time_s, speeds) for speeds in ride.journey.wheel_radps.T])
        noisy = true * (1.0 + self.noise * rng.standard_normal(true.shape))
        shown = np.round(noisy / self.resolution_radps) * self.resolution_radps
        spells = self.dropouts.draw(float(ride.journey.time_s[-1]), rng)
        missing = np.append(rng.integers(true.shape[1], size=len(spells)), -1)[within(time_s, spells)]
        shown[missing[:, np.newaxis] == np.arange(true.shape[1])] = np.nan
        return Measured(shown[:, self.groups(true.shape[1])], np.zeros(time_s.size))
