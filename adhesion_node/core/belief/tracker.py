# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Position and speed without the adhesion: a Kalman filter whose speed is a random walk.

It follows the train while it coasts, tells outliers, finds the speed again after a start or a gap, and gives the
first window of every braking its prior.
"""

from __future__ import annotations

import math

import numpy as np

from ..intake.samples import Measurement
from .gaussian import Gaussian, coast, observe

MET_SPEED_MPS = 50.0
"""Mean and standard deviation of the speed of a train just met."""

BRAKED_NOISE_RATE = 1.0
"""(m/s)^2/s: an unknown deceleration of up to about 1 m/s^2, taken as a random walk."""

SETTLED = 1.5
"""Ratio of the speed's variance to its stationary value at which the tracker counts as settled."""


def meet(measurement: Measurement) -> Gaussian:
    """Law of a train of which one position is known and no speed."""
    mean = np.array([measurement.position_m, MET_SPEED_MPS])
    return Gaussian(mean, np.diag([measurement.variance_m2, MET_SPEED_MPS**2]))


def predict(law: Gaussian, dt_s: float, braked: bool, coasting_noise_rate: float) -> Gaussian:
    """Predict over `dt_s`; variance rate of the coasting speed in (m/s)^2/s."""
    return coast(law, dt_s, BRAKED_NOISE_RATE if braked else coasting_noise_rate)


def innovation(predicted: Gaussian, measurement: Measurement) -> float:
    """Deviation of the measured position from the prediction in standard deviations."""
    variance = predicted.covariance[0, 0] + measurement.variance_m2
    return abs(measurement.position_m - float(predicted.mean[0])) / math.sqrt(variance)


def correct(predicted: Gaussian, measurement: Measurement, speed_variance: float) -> Gaussian:
    """Take in the measured position, and the measured speed unless `speed_variance` is infinite."""
    law = observe(predicted, 0, measurement.position_m, measurement.variance_m2)
    if measurement.speed_mps is not None and math.isfinite(speed_variance):
        law = observe(law, 1, measurement.speed_mps, speed_variance)
    return law


def speed_apart(tracked: Gaussian, other: Gaussian) -> float:
    """How far another belief's speed lies from the tracker's, in standard deviations of their difference.

    The variances are added, as if nothing that both have seen were the same.
    """
    variance = tracked.covariance[1, 1] + other.covariance[1, 1]
    return abs(float(other.mean[1] - tracked.mean[1])) / math.sqrt(variance)


def is_settled(law: Gaussian, measured_rate: float) -> bool:
    """Whether the speed is known about as well as the tracker can know it under the brake.

    `measured_rate` is a position's variance times the time between two, m^2 s. With it and the noise rate q, the
    stationary variance of the speed is sqrt(2) q^(3/4) rate^(1/4), the Riccati equation's solution.
    """
    stationary = math.sqrt(2.0) * BRAKED_NOISE_RATE**0.75 * measured_rate**0.25
    return bool(law.covariance[1, 1] <= SETTLED * stationary)
