# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The state-space model x = (s, v): step (2)(3), Jacobian and noise, Xie et al. 2019.

    s' = s + T (v + v')/2 + w_s          w_s ~ N(0, q_s T)
    v' = v - T (min(F, B) + R)/M + w_v   w_v ~ N(0, q_v T)
    y  = s + e                           e   ~ N(0, r)

with v' in the first line before its noise. Positions and speeds are arrays of any one shape; the step's length T
and brake B/(M g) broadcast against it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .track import Track
from .train import GRAVITY, Array, Train


@dataclass(frozen=True, slots=True)
class Motion:
    """A train on a track with the variances per second of its process noise."""

    train: Train
    track: Track
    position_noise_rate: float
    """q_s, m^2/s."""
    speed_noise_rate: float
    """q_v, (m/s)^2/s."""

    def resistance(self, position_m: Array, speed_mps: Array) -> Array:
        """Running resistance per weight R/(M g), N/N: basic (6) plus grade, curve and tunnel (7), as in (5)."""
        basic = self.train.specific_resistance(speed_mps)
        return basic + self.track.specific_resistance(position_m) if self.track.sections else basic

    def advance(
        self, position_m: Array, speed_mps: Array, dt_s: float | Array, brake: float | Array, mu: float | Array
    ) -> tuple[Array, Array]:
        """Noise-free step (2)(3): position and speed after `dt_s` under brake B/(M g) and adhesion `mu`."""
        resistance = self.resistance(position_m, speed_mps)
        speed = speed_mps - dt_s * self.train.deceleration(mu, brake, resistance)
        return position_m + 0.5 * dt_s * (speed_mps + speed), speed

    def brake_limit(self, position_m: float | Array, speed_mps: float | Array, brake: float | Array) -> Array:
        """Largest adhesion that brake B/(M g) makes use of; the motion tells of mu only that it is not below."""
        resistance = self.resistance(np.asarray(position_m), np.asarray(speed_mps))
        return np.asarray(self.train.used_adhesion(np.inf, brake, resistance))

    def jacobian(self, speed_mps: float | Array, dt_s: float | Array, brake_limits: bool | NDArray[np.bool_]) -> Array:
        """Derivative of the step with respect to (s, v), shape (..., 2, 2), the track's profile held fixed."""
        slope = self.train.resistance_slope(np.asarray(speed_mps))
        # M (1 + rho) a = B + R while the brake limits
        slope = np.where(brake_limits, slope / (1.0 + self.train.rotating_mass_fraction), slope)
        kept = 1.0 - dt_s * GRAVITY * slope
        jacobian = np.zeros((*kept.shape, 2, 2))
        jacobian[..., 0, 0] = 1.0
        jacobian[..., 0, 1] = 0.5 * dt_s * (1.0 + kept)
        jacobian[..., 1, 1] = kept
        return jacobian

    def noise(self, dt_s: float | Array) -> tuple[float | Array, float | Array]:
        """Variances of w_s, m^2, and w_v, (m/s)^2, over a step of `dt_s`."""
        return self.position_noise_rate * dt_s, self.speed_noise_rate * dt_s
