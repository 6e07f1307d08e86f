# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The core's extended Kalman filter of a window for many runs at once (`core.gaussian.filter_window`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.physics.motion import Motion
from ...core.physics.train import GRAVITY, Array
from .batch_particles import Windows


class FilteredRuns(NamedTuple):
    """What the pass through the windows left behind, with a leading axis of runs."""

    mean: Array
    """Filtered mean (R, 2) and covariance (R, 2, 2) after the last measurement."""
    covariance: Array
    passed_mean: Array
    """The same after the measurement asked for."""
    passed_covariance: Array
    sensitivity: Array
    """Derivative of the last mean with respect to mu, (R, 2)."""
    information: Array
    """Observed information on mu, (R,)."""


def filter_windows(motion: Motion, windows: Windows, covariance: Array, mu: Array, passing: int) -> FilteredRuns:
    """Filter every run with its `mu`, shape (R,), from the priors' `covariance`; keep the laws after `passing`."""
    mean = windows.mean
    sensitivity, information = np.zeros_like(mean), np.zeros(len(mean))
    passed = mean, covariance
    for k in range(len(windows.dt_s)):
        dt, brake = windows.dt_s[k, :, 0], windows.brake[k, :, 0]
        position, speed = motion.advance(mean[:, 0], mean[:, 1], dt, brake, mu)
        free = ~(motion.brake_limit(mean[:, 0], mean[:, 1], brake) < mu)
        jacobian = _jacobians(motion, mean[:, 1], dt, free)
        push = -GRAVITY * dt[:, None] * np.stack([0.5 * dt, np.ones_like(dt)], axis=1)
        sensitivity = (jacobian @ sensitivity[:, :, None])[:, :, 0] + push * free[:, None]
        covariance = jacobian @ covariance @ jacobian.transpose(0, 2, 1)
        covariance[:, 0, 0] += motion.noise(dt)[0]
        covariance[:, 1, 1] += motion.noise(dt)[1]
        mean = np.stack([position, speed], axis=1)
        for index, value, variance in (
            (0, windows.position_m[k, :, 0], windows.variance_m2[k, :, 0]),
            (1, windows.speed_mps[k, :, 0], windows.speed_variance[k, :, 0]),
        ):
            if not np.isfinite(variance).any():
                continue
            gain = covariance[:, :, index] / (covariance[:, index, index] + variance)[:, None]
            information = information + sensitivity[:, index] ** 2 / (covariance[:, index, index] + variance)
            sensitivity = sensitivity - gain * sensitivity[:, index, None]
            mean = mean + gain * (value - mean[:, index])[:, None]
            covariance = _joseph(covariance, gain, index, variance)
        if k + 1 == passing:
            passed = mean, covariance
    return FilteredRuns(mean, covariance, *passed, sensitivity, information)


def _joseph(covariance: Array, gain: Array, index: int, variance: Array) -> Array:
    """Covariances after measurements of state `index`; without one, at infinite variance, they stay."""
    kept = np.broadcast_to(np.eye(2), covariance.shape).copy()
    kept[:, :, index] -= gain
    noise = np.where(np.isfinite(variance), variance, 0.0)[:, None, None]
    updated: Array = kept @ covariance @ kept.transpose(0, 2, 1) + noise * (gain[:, :, None] * gain[:, None, :])
    return updated


def _jacobians(motion: Motion, speed_mps: Array, dt_s: Array, free: NDArray[np.bool_]) -> Array:
    """`motion.jacobian` of every run, (R, 2, 2); `free` where adhesion limits."""
    train = motion.train
    slope = 3.6e-3 * (train.resistance_c1 + 2.0 * train.resistance_c2 * 3.6 * speed_mps)
    kept = 1.0 - dt_s * GRAVITY * np.where(free, slope, slope / (1.0 + train.rotating_mass_fraction))
    jacobian = np.zeros((len(dt_s), 2, 2))
    jacobian[:, 0, 0] = 1.0
    jacobian[:, 0, 1] = 0.5 * dt_s * (1.0 + kept)
    jacobian[:, 1, 1] = kept
    return jacobian
