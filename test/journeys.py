# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Brakings of a CRH3 on any rail by an integrator of its own, with the process noise that the estimator assumes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from oracles import Array, G, specific_resistance

from adhesion_node.core import Measurement

Rail = Callable[[float, float], float]
"""Adhesion at a time of braking, s, and speed, m/s."""

LIMIT = 0.09522
"""What a full brake of 410 kPa can use, B/(M g)."""


class Journey(NamedTuple):
    """What the sensors gave, and the truth at their times."""

    measurements: list[Measurement]
    mu: Array
    speed_mps: Array

    def truth(self, t_ns: int) -> float:
        """Adhesion at the time of an estimate."""
        return float(self.mu[round(t_ns / 1e8)])


def wet(scale: float = 1.0) -> Rail:
    """The wet law, scaled."""
    return lambda _, v: scale * (0.04 + 13.7 / (120.0 + 3.6 * v))


def braking(
    rail: Rail,
    seconds: float,
    seed: int,
    *,
    speed_mps: float = 80.0,
    cruise_s: float = 5.0,
    sigma_m: float = 0.5,
    grade: float = 0.0,
    pressure_pa: float = 410e3,
) -> Journey:
    """Cruise, then brake; a position every 0.1 s. `grade` resists under the brake."""
    rng = np.random.default_rng(seed)
    s, v, measurements, truth = 0.0, speed_mps, [], []
    cruising = round(cruise_s / 0.1)
    for k in range(cruising + round(seconds / 0.1)):
        braked = k >= cruising
        mu = rail((k - cruising) * 0.1, v)
        position = s + sigma_m * float(rng.standard_normal())
        measurements.append(Measurement(k * 100_000_000, position, sigma_m**2, pressure_pa if braked else 0.0))
        truth.append((mu, v))
        used = min(mu, LIMIT * pressure_pa / 410e3)
        slower = v - 0.1 * G * braked * (used + float(specific_resistance(np.array(v))) + grade)
        s += 0.05 * (v + slower) + 0.02 * float(rng.standard_normal())
        v = slower + 0.02 / 3.6 * float(rng.standard_normal())
    mus, speeds = np.array(truth).T
    return Journey(measurements, mus, speeds)
