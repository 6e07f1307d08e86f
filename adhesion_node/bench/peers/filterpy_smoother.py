# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The window through `filterpy` (R. Labbe): its Kalman filter and RTS smoother, step by step."""

from typing import NamedTuple

import numpy as np
from filterpy.kalman import KalmanFilter

from ...core.belief.gaussian import Gaussian
from ...core.belief.window import Window
from ...core.physics.motion import Motion
from ...core.physics.train import Array
from ..scene import Scene, Update, maximised

SPEED_STEP_MPS = 1e-3


class Laws(NamedTuple):
    """Smoothed laws of the K + 1 states of a window."""

    mean: Array
    """Shape (K + 1, 2)."""
    covariance: Array
    """Shape (K + 1, 2, 2)."""


def rts_window(motion: Motion, prior: Gaussian, window: Window, mu: float) -> Laws:
    """Smooth the deviations from the noise-free run, which are linear: `rts_smoother` knows no input."""
    path = np.empty((window.steps + 1, 2))
    path[0] = prior.mean
    for k in range(window.steps):
        path[k + 1] = motion.advance(path[k, 0], path[k, 1], window.dt_s[k], window.brake[k], mu)
    steps = _jacobians(motion, window, path, mu)
    noise = [np.diag(variances) for variances in np.stack(motion.noise(window.dt_s), axis=1)]
    kalman = KalmanFilter(dim_x=2, dim_z=1)
    kalman.P, kalman.H = prior.covariance, np.array([[1.0, 0.0]])
    mean, covariance, _, _ = kalman.batch_filter(
        window.position_m - path[1:, 0], Fs=steps, Qs=noise, Rs=[np.array([[r]]) for r in window.variance_m2]
    )
    # In front stands the prior; its own step and noise are never used.
    mean, covariance, _, _ = kalman.rts_smoother(
        np.concatenate([np.zeros((1, 2, 1)), mean]),
        np.concatenate([prior.covariance[None], covariance]),
        Fs=[steps[0], *steps],
        Qs=[noise[0], *noise],
    )
    return Laws(path + mean[:, :, 0], covariance)


def em(scene: Scene, start: float, iterations: int, tolerance: float) -> Update:
    """EM with `rts_window` as its E-step; stops when mu moves no more than the tolerance."""
    mu, moved, done, laws = start, np.inf, 0, Laws(np.empty(0), np.empty(0))
    while done < iterations and moved > tolerance:
        laws = rts_window(*scene, mu)
        # Of laws this narrow the means are enough: one particle.
        mu, before = maximised(scene, laws.mean.T[:, :, None], np.ones((len(laws.mean), 1)), mu), mu
        moved, done = abs(mu - before), done + 1
    return Update(mu, laws.mean[:, 1], done)


def _jacobians(motion: Motion, window: Window, path: Array, mu: float) -> Array:
    """By central differences, all steps at once, shape (K, 2, 2)."""
    position, speed = path[:-1].T
    low, high = (
        np.stack(motion.advance(position, speed + change, window.dt_s, window.brake, mu))
        for change in (-SPEED_STEP_MPS, SPEED_STEP_MPS)
    )
    steps = np.zeros((window.steps, 2, 2))
    steps[:, 0, 0] = 1.0
    steps[:, :, 1] = (high - low).T / (2.0 * SPEED_STEP_MPS)
    return steps
