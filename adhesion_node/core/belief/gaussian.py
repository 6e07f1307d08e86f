# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Beliefs of (s, v) and how they change while nothing is assumed of the adhesion."""

import math
from typing import NamedTuple

import numpy as np

from ..physics.train import Array

UNIT = np.eye(2)


class Gaussian(NamedTuple):
    """Mean (2,) and covariance (2, 2) of position, m, and speed, m/s."""

    mean: Array
    covariance: Array

    @property
    def position_std(self) -> float:
        """Standard deviation of the position, m."""
        return math.sqrt(self.covariance[0, 0])

    @property
    def speed_std(self) -> float:
        """Standard deviation of the speed, m/s."""
        return math.sqrt(self.covariance[1, 1])

    def gain(self, index: int, variance: float) -> Array:
        """Kalman gain, shape (2,), of a measured position (`index` 0) or speed (`index` 1)."""
        gain: Array = self.covariance[:, index] / (self.covariance[index, index] + variance)
        return gain


def coast(belief: Gaussian, dt_s: float, speed_noise_rate: float) -> Gaussian:
    """Predict over `dt_s` with the speed a random walk of variance rate `speed_noise_rate`, (m/s)^2/s."""
    step = np.array([[1.0, dt_s], [0.0, 1.0]])
    walk = speed_noise_rate * np.array([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]])
    return Gaussian(step @ belief.mean, step @ belief.covariance @ step.T + walk)


def observe(belief: Gaussian, index: int, value: float, variance: float) -> Gaussian:
    """Condition on a measured position (`index` 0) or speed (`index` 1)."""
    gain = belief.gain(index, variance)
    kept = UNIT.copy()
    kept[:, index] -= gain
    # Joseph form: stays symmetric and positive however small the variance is
    covariance = kept @ belief.covariance @ kept.T + variance * (gain[:, None] * gain)
    return Gaussian(belief.mean + gain * (value - belief.mean[index]), covariance)
