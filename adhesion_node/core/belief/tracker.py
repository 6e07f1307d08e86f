# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Position and speed without the adhesion: a Kalman filter whose speed is a random walk (`gaussian.coast`).

It follows the train while it coasts, tells outliers, finds the speed again after a start or a gap, and gives the
first window of every braking its prior.
"""

import math

import numpy as np

from ..intake.samples import MAX_VARIANCE_M2, Measurement
from .gaussian import Gaussian, observe


def meet(measurement: Measurement, unknown_speed_mps: float) -> Gaussian:
    """Belief of a train of which one position is known, and of the speed only how large it may be.

    Without a position it is anywhere within 10 km of 0.
    """
    position, variance = measurement[1:3] if measurement.has_position else (0.0, MAX_VARIANCE_M2)
    return Gaussian(np.array([position, unknown_speed_mps]), np.diag([variance, unknown_speed_mps**2]))


def place(belief: Gaussian, measurement: Measurement) -> Gaussian:
    """Give a train its first position; its speed is known."""
    mean = np.array([measurement.position_m, belief.mean[1]])
    return Gaussian(mean, np.diag([measurement.variance_m2, belief.covariance[1, 1]]))


def innovation(predicted: Gaussian, measurement: Measurement) -> float:
    """Deviation of the measured position, if there is one, from the prediction in standard deviations."""
    if not measurement.has_position:
        return 0.0
    variance = predicted.covariance[0, 0] + measurement.variance_m2
    return abs(measurement.position_m - float(predicted.mean[0])) / math.sqrt(variance)


def correct(predicted: Gaussian, measurement: Measurement, speed_variance: float) -> Gaussian:
    """Take in the measured position, if there is one, and the measured speed unless `speed_variance` is infinite."""
    belief = predicted
    if measurement.has_position:
        belief = observe(belief, 0, measurement.position_m, measurement.variance_m2)
    if measurement.speed_mps is not None and math.isfinite(speed_variance):
        belief = observe(belief, 1, measurement.speed_mps, speed_variance)
    return belief


def speed_apart(tracked: Gaussian, other: Gaussian) -> float:
    """How far another belief's speed lies from the tracker's, in standard deviations of their difference.

    The variances are added, as if nothing that both have seen were the same.
    """
    variance = tracked.covariance[1, 1] + other.covariance[1, 1]
    return abs(float(other.mean[1] - tracked.mean[1])) / math.sqrt(variance)


def is_settled(belief: Gaussian, measured_rate: float, noise_rate: float, ratio: float) -> bool:
    """Whether the variance of the speed is below `ratio` times what the tracker comes to in the long run.

    `measured_rate` is a position's variance times the time between two, m^2 s. With it and the noise rate q,
    (m/s)^2/s, that is sqrt(2) q^(3/4) rate^(1/4), the Riccati equation's solution.
    """
    stationary = math.sqrt(2.0) * noise_rate**0.75 * measured_rate**0.25
    return bool(belief.covariance[1, 1] <= ratio * stationary)
