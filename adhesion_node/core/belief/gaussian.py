# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Beliefs of (s, v) and how they change while nothing is assumed of the adhesion."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..physics.train import Array


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


def coast(belief: Gaussian, dt_s: float, speed_noise_rate: float) -> Gaussian:
    """Predict over `dt_s` with the speed a random walk of variance rate `speed_noise_rate`, (m/s)^2/s."""
    step, walk = _walked(dt_s, speed_noise_rate)
    return Gaussian(step.dot(belief.mean), step.dot(belief.covariance).dot(step.T) + walk)


@lru_cache(maxsize=16)  # most measurements are as far apart as the last ones were
def _walked(dt_s: float, speed_noise_rate: float) -> tuple[Array, Array]:
    """How the state moves over `dt_s`, and the covariance that this adds; both (2, 2)."""
    walk = np.array([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]])
    return np.array([[1.0, dt_s], [0.0, 1.0]]), speed_noise_rate * walk


def observe(belief: Gaussian, index: int, value: float, variance: float) -> Gaussian:
    """Condition on a measured position (`index` 0) or speed (`index` 1)."""
    # The parts of two are reckoned as numbers, which takes half the time of arrays.
    mean, parts = belief.mean.tolist(), belief.covariance.tolist()
    total, off = parts[index][index] + variance, value - mean[index]
    gain_s, gain_v = parts[0][index] / total, parts[1][index] / total
    kept = np.array(((1.0, -gain_s), (0.0, 1.0 - gain_v)) if index else ((1.0 - gain_s, 0.0), (-gain_v, 1.0)))
    both = variance * (gain_s * gain_v)
    told = np.array(((variance * (gain_s * gain_s), both), (both, variance * (gain_v * gain_v))))
    # Joseph form: stays symmetric and positive however small the variance is
    covariance = kept.dot(belief.covariance).dot(kept.T) + told
    return Gaussian(np.array((mean[0] + gain_s * off, mean[1] + gain_v * off)), covariance)
