# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How well the best linear estimator of an easier task knows the adhesion used, by all that the sensors have shown.

    var(m | y) = w'K w - k'S^-1 k,   k = H K w,   S = H K H' + U U' + R

with the covariance K of the adhesion used u; its mean m = w'u, over 1 s about now (half of which still lies ahead) or
over the way ahead; what the sensors show, H u; what else is unknown, U; and their errors, R.
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, toeplitz

from sim_node.real.sensors.fitted import Mounted
from sim_node.real.sensors.imu import Imu
from sim_node.real.sensors.position import Gnss, GnssFix
from sim_node.real.sensors.speed import Speedometer

from ....core.physics.train import GRAVITY, Array
from ..trials import SLOWEST_MPS
from .courses import STEP_S, Course

FACTOR_STD, FAR_M, FAST_MPS = 0.5, 1e3, 50.0
"""What is known beforehand of a factor, and of place and speed."""

POWER_STD = 0.06
"""What is known beforehand of the power of the speed: published laws fall with the powers 0 (a film of leaves) to 0.2
(`wet`), what a train with slide protection uses with 0 to 0.06 in the plant."""

PITCH_STD = 0.029
"""Of what an accelerometer feels too much as the nose dips under the brake, over what slows the train down: 0.3 to 1
degree at 1.2 m/s^2, which no train's papers tell."""

HONEST = (Gnss, GnssFix, Speedometer, Imu)
"""Sensors whose errors have a law; a wheel's are those of its slides."""


def std_of(course: Course, now: int, mean: Array, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """Standard deviation of a mean of the adhesion used, by its weights, given all that was measured until `now`."""
    end = mean.size
    smooth, factors = course.smooth[:end], course.factors[:end]
    power = factors.sum(axis=1) * np.log(np.maximum(course.speed_mps[:end], SLOWEST_MPS) / course.speed_mps[now])
    spread = FACTOR_STD**2 * factors @ factors.T + POWER_STD**2 * np.outer(power, power)
    spread = spread * np.outer(smooth, smooth) + _swinging(course, end, autocovariance)
    shown, errors = _shown(course, now, end, mounted)
    cross = shown @ spread @ mean
    told = cross @ cho_solve(cho_factor(shown @ spread @ shown.T + errors), cross)
    return float(np.sqrt(max(mean @ spread @ mean - told, 0.0)))


def apart(course: Course, now: int, others: Array, mounted: Sequence[Mounted], autocovariance: Array) -> Array:
    """How far from what the sensors have shown until `now` lies what they would have, had each of `others` been used.

    In standard deviations of the best test between both, shape (R,); `others`, shape (R, N), at each step.
    """
    end = now + 1
    shown, errors = _shown(course, now, end, mounted)
    total = cho_factor(shown @ _swinging(course, end, autocovariance) @ shown.T + errors)
    off = shown @ (course.used - others)[:, :end].T
    return np.asarray(np.sqrt(np.sum(off * cho_solve(total, off), axis=0)))


def _swinging(course: Course, end: int, autocovariance: Array) -> Array:
    """Covariance of the adhesion used about what it is in the mean of days."""
    swings = course.swings[:end] * course.smooth[:end]
    return np.asarray(np.outer(swings, swings) * toeplitz(autocovariance[:end]))


def _shown(course: Course, now: int, end: int, mounted: Sequence[Mounted]) -> tuple[Array, Array]:
    """What all sensors show until now of the adhesion used; the covariance of what else moves them."""
    seen = [_seen(one, course, now, end) for one in mounted if isinstance(one.sensor, HONEST)]
    moved = np.vstack([part[1] for part in seen])
    return np.vstack([part[0] for part in seen]), moved @ moved.T + block_diag(*(part[2] for part in seen))


def _seen(mounted: Mounted, course: Course, now: int, end: int) -> tuple[Array, Array, Array]:
    """What a sensor shows until now: of the adhesion used; of place and speed at first; its errors' covariance."""
    sensor = mounted.sensor.gnss if isinstance(mounted.sensor, GnssFix) else mounted.sensor
    per_step = mounted.timing.rate_hz * STEP_S
    every, together = max(round(1.0 / per_step), 1), max(per_step, 1.0)
    at = np.arange(now % every, now + 1, every)
    time_s, one = course.time_s[at] - course.time_s[0], np.ones(at.size)
    slower = -GRAVITY * STEP_S * np.tri(now + 1, end)
    if isinstance(sensor, Imu):
        steady = sensor.bias_std_mps2**2 + (GRAVITY * sensor.mounting_std_rad) ** 2
        pitched = PITCH_STD * GRAVITY * course.smooth[at] * (course.time_s[at] > 0.0)
        errors = sensor.white_std_mps2**2 / together * np.eye(at.size) + steady + np.outer(pitched, pitched)
        return -GRAVITY * np.eye(now + 1, end)[at], np.zeros((at.size, 2)), errors
    assert isinstance(sensor, Gnss | Speedometer)  # the last that are honest
    lasting = np.exp(-np.abs(time_s[:, np.newaxis] - time_s) / sensor.correlation_s)
    if isinstance(sensor, Gnss):
        errors = sensor.white_std_m**2 / together * np.eye(at.size) + sensor.correlated_std_m**2 * lasting
        return (STEP_S * np.cumsum(slower, axis=0))[at], np.column_stack([FAR_M * one, FAST_MPS * time_s]), errors
    scale = sensor.scale_std * course.speed_mps[at]
    errors = sensor.white_std_mps**2 / together * np.eye(at.size) + sensor.correlated_std_mps**2 * lasting
    return slower[at], np.column_stack([0.0 * one, FAST_MPS * one]), errors + np.outer(scale, scale)
