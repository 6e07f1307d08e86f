# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a supervision is told: the train's state and its braking curve, or why there is none."""

from __future__ import annotations

from typing import NamedTuple

from ..physics.braking import BrakingCurve
from ..physics.train import Array
from .config import SupervisionConfig

NS_PER_S = 1e9


class TrainState(NamedTuple):
    """Where the train is, m along the track, and how fast, m/s, with standard deviations; 0 is exact."""

    t_ns: int
    position_m: float
    speed_mps: float
    position_std_m: float = 0.0
    speed_std_mps: float = 0.0

    def at_most(self, config: SupervisionConfig, now_ns: int) -> tuple[float, float]:
        """Foremost place of the front end, m, and highest speed, m/s, `margin_sigma` standard deviations ahead.

        Since its stamp the train may have accelerated by A_est. A train that rolls back counts as running forward.
        """
        age_s = self.age_s(now_ns)
        since_s = max(age_s, 0.0)
        speed = abs(self.speed_mps) + config.margin_sigma * self.speed_std_mps
        gained = config.acceleration_mps2 * since_s
        place = self.position_m + config.margin_sigma * self.position_std_m
        return place + (speed + gained / 2.0) * since_s, speed + gained

    def age_s(self, now_ns: int) -> float:
        """Time since its stamp."""
        return (now_ns - self.t_ns) / NS_PER_S


class StampedCurve(NamedTuple):
    """A braking curve, the time it was made for, and the place, m, at which it begins."""

    t_ns: int
    position_m: float
    curve: BrakingCurve
    sign: int = 1
    """-1 where the places fall along the curve."""

    @property
    def places_m(self) -> Array:
        """Where the train will be, m; shape as the curve's."""
        return self.position_m + self.sign * self.curve.distance_m

    def age_s(self, now_ns: int) -> float:
        """Time since its stamp."""
        return (now_ns - self.t_ns) / NS_PER_S


class Unavailable(NamedTuple):
    """Stands for a state or a curve that is not there; `why` says what was received instead and the remedy."""

    why: str

    def age_s(self, _now_ns: int) -> None:
        """Of what there is not."""
        return
