# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Extended Kalman filter of R windows at a given adhesion, and what the measurements tell of that adhesion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...belief.gaussian import Gaussian
from ...physics.motion import Motion
from ...physics.train import GRAVITY, Array
from .windows import Windows

UNIT = np.eye(2)


class Filtered(NamedTuple):
    """The filter's pass through windows of K steps."""

    mean: Array
    """Of (s, v) after each measurement, (K, R, 2)."""
    covariance: Array
    """(K, R, 2, 2)."""
    sensitivity: Array
    """Derivative of the last mean with respect to mu, (R, 2)."""
    information: Array
    """Observed information on mu that the measurements hold, the prior's state being uncertain too, (R,)."""

    def of(self, run: int) -> Filtered:
        """That of one run, without the axis of runs."""
        return Filtered(self.mean[:, run], self.covariance[:, run], self.sensitivity[run], self.information[run, ...])

    def belief(self, index: int) -> Gaussian:
        """Filtered belief of (s, v) after the measurement of that index."""
        return Gaussian(self.mean[index].copy(), self.covariance[index].copy())


def filter_windows(motion: Motion, windows: Windows, mu: Array) -> Filtered:
    """Filter every window at its adhesion in `mu`, shape (R,).

    The innovations' derivative with respect to mu, squared and divided by their variance, sums to the observed
    information: exact for the linear Gaussian model that this is while adhesion limits.
    """
    dt, brake = windows.dt_s[..., 0], windows.brake[..., 0]
    push = -GRAVITY * np.stack((0.5 * dt**2, dt), axis=-1)
    noise = np.stack(motion.noise(dt), axis=-1)[..., None] * UNIT
    mean, covariance = windows.mean, windows.covariance
    sensitivity, information = np.zeros_like(mean), np.zeros_like(mu)
    means, covariances = np.empty((len(dt), *mean.shape)), np.empty((len(dt), *covariance.shape))
    for k, observed in enumerate(_observed(windows)):
        position, speed = mean.T
        brake_limits = motion.brake_limit(position, speed, brake[k]) < mu
        jacobian = motion.jacobian(speed, dt[k], brake_limits)
        sensitivity = (jacobian @ sensitivity[:, :, None])[:, :, 0] + push[k] * ~brake_limits[:, None]
        covariance = jacobian @ covariance @ jacobian.transpose(0, 2, 1) + noise[k]
        mean = np.array(motion.advance(position, speed, dt[k], brake[k], mu)).T
        for index, value, variance, finite in observed:
            total = covariance[:, index, index] + variance
            gain = covariance[:, :, index] / total[:, None]
            information = information + sensitivity[:, index] ** 2 / total
            sensitivity = sensitivity - gain * sensitivity[:, index, None]
            mean = mean + gain * (value - mean[:, index])[:, None]
            # Joseph form: stays symmetric and positive however small the variance is
            kept = UNIT - gain[:, :, None] * UNIT[index]
            covariance = kept @ covariance @ kept.transpose(0, 2, 1) + finite * (gain[:, :, None] * gain[:, None, :])
        means[k], covariances[k] = mean, covariance
    return Filtered(means, covariances, sensitivity, information)


def _observed(windows: Windows) -> list[list[tuple[int, Array, Array, Array]]]:
    """Of each step what was measured in any run: index of the state, values and variances (R,).

    The variances once more with 0 for infinity, (R, 1, 1): where nothing was measured the gain is 0 as well.
    """
    observed: list[list[tuple[int, Array, Array, Array]]] = [[] for _ in windows.dt_s]
    columns = (windows.position_m, windows.variance_m2), (windows.speed_mps, windows.speed_variance)
    for index, (values, variances) in enumerate(columns):
        seen = np.isfinite(variances)
        finite = np.where(seen, variances, 0.0)[..., None]
        for k in np.flatnonzero(seen.any(axis=(1, 2))):
            observed[k].append((index, values[k, :, 0], variances[k, :, 0], finite[k]))
    return observed
