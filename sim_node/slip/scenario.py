# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Where a locomotive pulls: rail surfaces with their creep curves, the locomotive, and the scenarios as data."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from adhesion_node.core.physics.train import Array


@dataclass(frozen=True, slots=True)
class Surface:
    """A rail surface: initial slope mu_0 of its curve, its peak and the creep of the peak."""

    mu_max: float
    lambda_m: float = 0.1
    slope: float = 20.0

    def mu(self, creep: Array) -> Array:
        """Adhesion at a creep; the other way round for braking wheels.

        With x = |l|/l_m the curve reads mu_max x/(x + (1 - x)^2 mu_max/(mu_0 l_m)).
        """
        x = np.abs(creep) / self.lambda_m
        stiff = self.mu_max / (self.slope * self.lambda_m)
        return np.asarray(np.copysign(self.mu_max * x / (x + stiff * (1.0 - x) ** 2), creep))


DRY, WET = Surface(0.35), Surface(0.20)


@dataclass(frozen=True, slots=True)
class Locomotive:
    """A heavy freight locomotive and what it pulls."""

    axles: int = 6
    axle_load_kg: float = 25e3
    axle_spacing_m: float = 2.5
    wheel_radius_m: float = 0.625
    axle_inertia_kgm2: float = 400.0
    """Wheelset, gear and motor together."""
    train_mass_kg: float = 3.0e6
    resistance_n: float = 60e3
    full_torque_nm: float = 60e3
    """Per axle: more than the dry rail takes."""


@dataclass(frozen=True, slots=True)
class SlipScenario:
    """A pull: `surfaces` holds (from_position_m, surface); the first also holds before its position.

    Raises ValueError when there is no surface or the positions do not increase.
    """

    name: str
    surfaces: tuple[tuple[float, Surface], ...]
    end_s: float
    speed_mps: float = 8.0
    locomotive: Locomotive = Locomotive()

    def __post_init__(self) -> None:
        starts = tuple(start for start, _ in self.surfaces)
        if not starts or any(not later > earlier for earlier, later in pairwise(starts)):
            raise ValueError(f"surface positions = {starts}: give at least one, in increasing order")

    def surface(self, position_m: float) -> Surface:
        """Return the surface at a place."""
        return [surface for start, surface in self.surfaces if start <= position_m or start == self.surfaces[0][0]][-1]


SCENARIOS: Mapping[str, SlipScenario] = {
    scenario.name: scenario
    for scenario in (
        SlipScenario("creep_dry", ((0.0, DRY),), 40.0),
        SlipScenario("creep_switch", ((0.0, DRY), (450.0, WET)), 90.0),
    )
}
"""The scenarios by name."""


def find(name: str) -> SlipScenario:
    """Return the scenario of that name; ValueError listing the known ones when there is none."""
    if name not in SCENARIOS:
        raise ValueError(f"scenario = {name!r}: give one of {', '.join(SCENARIOS)}")
    return SCENARIOS[name]
