# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Gaussian laws of (s, v): the prior that windows hand on, and the two Kalman filters that carry it.

`coast` needs no adhesion: it follows position and speed while the brake tells nothing of them. `filter_window`
is the extended Kalman filter of the braking train at a given adhesion.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..physics.motion import LOG_2PI, Motion
from ..physics.train import GRAVITY, Array
from .window import Window

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

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Draw `count` states, shape (count, 2)."""
        root = np.linalg.cholesky(self.covariance)
        return self.mean + rng.standard_normal((count, 2)) @ root.T

    def log_density(self, states: Array) -> Array:
        """ln p(x) of states of shape (..., 2)."""
        deviation = states - self.mean
        distance = np.sum(deviation * np.linalg.solve(self.covariance, deviation[..., None])[..., 0], axis=-1)
        result: Array = -0.5 * (distance + np.linalg.slogdet(self.covariance)[1]) - LOG_2PI
        return result


def coast(law: Gaussian, dt_s: float, speed_noise_rate: float) -> Gaussian:
    """Predict over `dt_s` with the speed a random walk of variance rate `speed_noise_rate`, (m/s)^2/s."""
    step = np.array([[1.0, dt_s], [0.0, 1.0]])
    walk = speed_noise_rate * np.array([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]])
    return Gaussian(step @ law.mean, step @ law.covariance @ step.T + walk)


def observe(law: Gaussian, index: int, value: float, variance: float) -> Gaussian:
    """Condition on a measured position (`index` 0) or speed (`index` 1)."""
    gain = law.gain(index, variance)
    kept = UNIT.copy()
    kept[:, index] -= gain
    # Joseph form: stays symmetric and positive however small the variance is
    covariance = kept @ law.covariance @ kept.T + variance * (gain[:, None] * gain)
    return Gaussian(law.mean + gain * (value - law.mean[index]), covariance)


class Filtered(NamedTuple):
    """The extended Kalman filter's pass through a window."""

    laws: list[Gaussian]
    """Filtered law after each of the K measurements."""
    sensitivity: Array
    """Derivative of the last mean with respect to mu, shape (2,)."""
    information: float
    """Observed information on mu that the measurements hold, the prior's state being uncertain too."""


def filter_window(motion: Motion, prior: Gaussian, window: Window, mu: float) -> Filtered:
    """Extended Kalman filter of the window with adhesion `mu`, and what the measurements tell of `mu`.

    The innovations' derivative with respect to mu, squared and divided by their variance, sums to the observed
    information: exact for the linear Gaussian model that this is while adhesion limits.
    """
    law, laws = prior, []
    sensitivity, information = np.zeros(2), 0.0
    for k in range(window.steps):
        dt_s = float(window.dt_s[k])
        position, speed = motion.advance(law.mean[0], law.mean[1], dt_s, float(window.brake[k]), mu)
        brake_limits = bool(motion.brake_limit(law.mean[0], law.mean[1], float(window.brake[k])) < mu)
        jacobian = motion.jacobian(float(law.mean[1]), dt_s, brake_limits)
        sensitivity = jacobian @ sensitivity
        if not brake_limits:
            sensitivity -= GRAVITY * dt_s * np.array([0.5 * dt_s, 1.0])
        covariance = jacobian @ law.covariance @ jacobian.T + np.diag(np.array(motion.noise(dt_s), dtype=np.float64))
        law = Gaussian(np.array([position, speed]), covariance)
        for index, value, variance in window.observations[k]:
            information += sensitivity[index] ** 2 / (law.covariance[index, index] + variance)
            sensitivity = sensitivity - law.gain(index, variance) * sensitivity[index]
            law = observe(law, index, value, variance)
        laws.append(law)
    return Filtered(laws, sensitivity, float(information))
