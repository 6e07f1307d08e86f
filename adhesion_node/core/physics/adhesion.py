# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Adhesion as a function of speed: the published laws for dry and wet rail, Xie et al. 2019, section 3.1."""

import math
from dataclasses import dataclass
from typing import Protocol, overload

import numpy as np

from .train import KMH, Array


class AdhesionLaw(Protocol):
    """Adhesion coefficient as a function of speed in m/s, element by element."""

    def __call__(self, speed_mps: Array) -> Array: ...


@dataclass(frozen=True, slots=True)
class SpeedLaw:
    """mu(v) = scale (floor + gain/(offset + v)) with v, gain and offset in km/h.

    Raises ValueError naming the coefficient when the law is not finite and positive at every speed.

    >>> [round(float(DRY(np.array(v * KMH))), 4) for v in (300, 250)]
    [0.1432, 0.1514]
    >>> [round(float(WET(np.array(v * KMH))), 4) for v in (300, 250, 100, 50, 0)]
    [0.0726, 0.077, 0.1023, 0.1206, 0.1542]
    """

    floor: float
    gain_kmh: float = 0.0
    offset_kmh: float = 1.0
    scale: float = 1.0

    def __post_init__(self) -> None:
        for name, least in (("floor", 0.0), ("gain_kmh", 0.0), ("offset_kmh", 1e-9), ("scale", 1e-9)):
            value = getattr(self, name)
            if not math.isfinite(value) or value < least:
                raise ValueError(f"adhesion law {name} = {value!r}: give a finite number of at least {least}")

    @overload
    def __call__(self, speed_mps: float) -> float: ...

    @overload
    def __call__(self, speed_mps: Array) -> Array: ...

    def __call__(self, speed_mps: float | Array) -> float | Array:
        speed_kmh = (max(speed_mps, 0.0) if isinstance(speed_mps, float) else np.maximum(speed_mps, 0.0)) / KMH
        return self.scale * (self.floor + self.gain_kmh / (self.offset_kmh + speed_kmh))

    def slope(self, speed_mps: Array) -> Array:
        """Derivative with respect to the speed, s/m."""
        speed_kmh = np.maximum(speed_mps, 0.0) / KMH
        return -self.scale * self.gain_kmh / (self.offset_kmh + speed_kmh) ** 2 / KMH


DRY = SpeedLaw(0.06, 46.6, 260.0)
WET = SpeedLaw(0.04, 13.7, 120.0)
SNOW = SpeedLaw(0.03, 8.0, 130.0)

LAWS: dict[str, SpeedLaw] = {"dry": DRY, "wet": WET, "snow": SNOW}
"""The laws by name, as parameters and command lines spell them."""
