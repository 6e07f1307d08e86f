# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a recording holds besides the estimates: the truth, the brake pressure, the creep curves."""

from operator import attrgetter

from ...wire import topics
from ...wire.topic import Topic
from .creep import CreepTaken
from .gathered import Numbers
from .messages import Take
from .run import Run


class Inputs:
    """Truth, creep curves and the brake pressure above the air, or the demand without a pressure, while read."""

    def __init__(self) -> None:
        self.pressure, self.demand = (Numbers(attrgetter("pressure_pa")) for _ in range(2))
        self.creep, self._mu, self._limited = CreepTaken(), Numbers(), Numbers()
        self._position, self._speed = Numbers(attrgetter("position_m")), Numbers(attrgetter("speed_mps"))
        self.truth: tuple[tuple[Topic, Take], ...] = (
            (topics.TRUTH_MU, self._mu.take),
            (topics.TRUTH_LIMITED, self._limited.take),
            (topics.TRUTH_STATE, self._position.take),
            (topics.TRUTH_STATE, self._speed.take),
        )
        """Who takes what of the truth."""

    @property
    def takes(self) -> tuple[tuple[Topic, Take], ...]:
        """Who takes what."""
        pressures = (topics.BRAKE_PRESSURE, self.pressure.take), (topics.BRAKE_DEMAND, self.demand.take)
        return (*self.truth, *pressures, (topics.DIAGNOSTICS, self.creep.take))

    @property
    def run(self) -> Run:
        """What was read."""
        pressure = self.pressure.series
        return Run(
            creep=self.creep.curves(),
            true_mu=self._mu.series,
            true_limited=self._limited.series,
            true_position=self._position.series,
            true_speed=self._speed.series,
            pressure=pressure if pressure.t_ns.size else self.demand.series,
        )
