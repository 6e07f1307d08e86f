# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The train as a point mass: brake force and running resistance, Xie et al. 2019, (1)-(6).

Everything is SI. The published running-resistance coefficients take km/h; the conversion stays inside
`Train.resistance_si`.
"""

import math
from dataclasses import dataclass
from typing import TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from ..setting import check_settings, setting

Array = NDArray[np.float64]
Real = TypeVar("Real", float, Array)

GRAVITY = 9.8
"""Gravitational acceleration of the papers, m/s^2."""

KMH = 1.0 / 3.6
"""One kilometre per hour in m/s."""


@dataclass(frozen=True, slots=True)
class Train:
    """Braking and resistance constants of a train. The defaults are CRH3 (Table 1).

    Raises ValueError naming the constant, its value and its range when one is out of it.
    """

    mass_kg: float = setting(536e3, "Mass of the train", "kg", 1e3, 1e8)
    length_m: float = setting(200.0, "Length of the train", "m", 1.0, 5e3)
    cylinder_diameter_m: float = setting(0.203, "Diameter of a brake cylinder, d", "m", 1e-3, 2.0)
    full_pressure_pa: float = setting(
        410e3, "Brake-cylinder pressure (gauge) of a full emergency brake, P", "Pa", 1e3, 2e6
    )
    rigging_efficiency: float = setting(0.85, "Efficiency of the brake rigging, eta", "", 1e-3, 1.0)
    rigging_ratio: float = setting(2.55, "Ratio of the brake rigging, gamma", "", 1e-3, 1e3)
    pad_friction: float = setting(0.28, "Friction coefficient of the brake discs, mu_A", "", 1e-3, 2.0)
    disc_radius_m: float = setting(0.2976, "Mean friction radius of a brake disc, r", "m", 1e-3, 5.0)
    wheel_radius_m: float = setting(0.46, "Radius of a wheel, R", "m", 1e-2, 5.0)
    # Not printed in the paper; 32 axles x 3 reproduces its published braking distances.
    pads: int = setting(96, "Number of brake pads, N", "", 1, 100_000)
    # Not printed either: those of the CRH3.
    resistance_c0: float = setting(0.79, "Rolling resistance, c0", "N/kN", 0.0, 100.0)
    resistance_c1: float = setting(0.0064, "Mechanical resistance, c1", "N/kN per km/h", 0.0, 1.0)
    resistance_c2: float = setting(0.000115, "Air resistance, c2", "N/kN per (km/h)^2", 0.0, 0.01)
    rotating_mass_fraction: float = setting(
        0.0, "Inertia of the rotating parts as a fraction of the mass; the paper has none", "", 0.0, 1.0
    )

    def __post_init__(self) -> None:
        check_settings(self, "train.")

    def adhesion_force(self, mu: Real) -> Real:
        """Largest brake force, N, that adhesion `mu` transmits: F = mu M g (1).

        >>> round(CRH3.adhesion_force(0.0726))
        381353
        """
        return mu * (self.mass_kg * GRAVITY)

    def brake_force(self, pressure_pa: Real) -> Real:
        """Brake force, N, of a cylinder pressure in Pa, gauge (4).

        >>> round(CRH3.brake_force(410e3) / CRH3.mass_kg, 4)
        0.9332
        """
        piston_area = math.pi / 4 * self.cylinder_diameter_m**2
        rigging = self.rigging_efficiency * self.rigging_ratio * self.pad_friction * self.pads
        return piston_area * self.disc_radius_m / self.wheel_radius_m * rigging * pressure_pa

    def specific_resistance(self, speed_mps: Real) -> Real:
        """Basic running resistance per weight, N/N (6): (c0 + c1 v + c2 v^2) 1e-3 with v in km/h."""
        c0, c1, c2 = self.resistance_si  # one multiplication less per particle and step
        return c0 + speed_mps * (c1 + c2 * speed_mps)

    @property
    def resistance_si(self) -> tuple[float, float, float]:
        """Coefficients of (6) per weight, N/N, of a speed in m/s."""
        return 1e-3 * self.resistance_c0, 3.6e-3 * self.resistance_c1, 12.96e-3 * self.resistance_c2

    def resistance_slope(self, speed_mps: Array) -> Array:
        """Derivative of `specific_resistance` with respect to the speed, s/m."""
        _, c1, c2 = self.resistance_si
        return c1 + 2.0 * c2 * speed_mps

    def specific_brake(self, pressure_pa: Real) -> Real:
        """Brake force per weight B/(M g), N/N, of a cylinder pressure in Pa, gauge.

        >>> round(CRH3.specific_brake(410e3), 4)
        0.0952
        """
        return self.brake_force(pressure_pa) / (self.mass_kg * GRAVITY)

    @property
    def full_brake(self) -> float:
        """B/(M g) of the full brake, N/N."""
        return self.specific_brake(self.full_pressure_pa)

    @property
    def full_brake_mps2(self) -> float:
        """Deceleration by the full brake alone, with the rotating mass.

        >>> round(CRH3.full_brake_mps2, 2)
        0.93
        """
        return GRAVITY * self.full_brake / (1.0 + self.rotating_mass_fraction)

    @overload
    def used_adhesion(self, mu: float, specific_brake: float, resistance: float) -> float: ...

    @overload
    def used_adhesion(self, mu: float | Array, specific_brake: float | Array, resistance: Array) -> Array: ...

    @overload
    def used_adhesion(
        self, mu: float | Array, specific_brake: float | Array, resistance: float | Array
    ) -> float | Array: ...

    def used_adhesion(
        self, mu: float | Array, specific_brake: float | Array, resistance: float | Array
    ) -> float | Array:
        """Adhesion that the brakes make use of, min(F, B)/(M g), the two cases (2) and (3); all per weight, N/N.

        With rotating masses M (1 + rho) a = B + R holds while the brake limits and M a = F + R at the rail, so
        the brake can use no more than (B - rho R)/(1 + rho). Beyond that limit mu cannot be seen.
        """
        rho = self.rotating_mass_fraction
        limit = (specific_brake - rho * resistance) / (1.0 + rho) if rho else specific_brake
        return min(mu, limit) if isinstance(mu, float) and isinstance(limit, float) else np.minimum(mu, limit)

    @overload
    def deceleration(self, mu: float, specific_brake: float, resistance: float) -> float: ...

    @overload
    def deceleration(self, mu: float | Array, specific_brake: float | Array, resistance: Array) -> Array: ...

    def deceleration(
        self, mu: float | Array, specific_brake: float | Array, resistance: float | Array
    ) -> float | Array:
        """Deceleration, m/s^2, under adhesion `mu`, brake B/(M g) and resistance R/(M g), (2) and (3)."""
        return GRAVITY * (self.used_adhesion(mu, specific_brake, resistance) + resistance)


CRH3 = Train()
"""The train of Xie et al. 2019, Table 1."""
