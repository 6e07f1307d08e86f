# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How well the best linear estimator of an easier task knows the adhesion used, by all that the sensors have shown.

    var(m | y) = w'K w - k'S^-1 k,   k = H K w,   S = H K H' + U U' + R

with the covariance K of the adhesion used u and of all else that slows the train down; a mean m of it by its weights w,
over 1 s about now (half of which still lies ahead) or over the way ahead; what the sensors show, H; what else is
unknown, U; and their errors, R.
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, toeplitz

from sim_node.real.sensors.fitted import Mounted
from sim_node.real.sensors.imu import Imu
from sim_node.real.sensors.position import Gnss, GnssFix
from sim_node.real.sensors.speed import Speedometer
from sim_node.real.sensors.wheels import Wheels

from ....core.physics.train import GRAVITY, Array
from .courses import Course
from .unknown import STEP_S

FAR_M, FAST_MPS = 1e3, 50.0
"""What is known beforehand of place and speed."""

PITCH_STD = 0.029
"""Of what an accelerometer feels too much as the nose dips under the brake, over what slows the train down: as the
plant's trains differ, 0.3 to 1 degree at 1.2 m/s^2, which no train's papers tell."""

WORN_STD = 0.0087
"""Of the wheels' mean radius over that of new ones, as the plant's differ: up to 3 % are worn off."""

HONEST = (Gnss, GnssFix, Speedometer, Imu, Wheels)
"""Sensors whose errors have a law. Of wheels it is told by how much each slides: what they err by else is noise."""


def std_of(course: Course, now: int, mean: Array, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """Standard deviation of a mean of the adhesion used, by its weights, given all that was measured until `now`."""
    return _std_of(course, now, mean, course.unknown.used, mounted, autocovariance)


def std_of_slowing(course: Course, now: int, mean: Array, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """The same of all that slows the train down, over g: adhesion, resistance, grade and rotating mass."""
    return _std_of(course, now, mean, course.unknown.slowing, mounted, autocovariance, course.unknown.grade)


def _std_of(
    course: Course,
    now: int,
    mean: Array,
    wanted: Array,
    mounted: Sequence[Mounted],
    autocovariance: Array,
    graded: Array | None = None,
) -> float:
    end = mean.size
    slowing, grade = course.unknown.slowing[:end], course.unknown.grade[:end]
    swings, own = _swinging(course, end, autocovariance), wanted[:end].T @ mean
    shown, climbed, errors = _shown(course, now, end, mounted)
    cross = shown @ (swings @ mean + slowing @ own)
    variance = mean @ swings @ mean + own @ own
    if graded is not None:
        climbs = grade.T @ mean
        cross, variance = cross + climbed @ climbs, variance + climbs @ climbs
    total = shown @ (swings + slowing @ slowing.T) @ shown.T + climbed @ climbed.T + errors
    return float(np.sqrt(max(variance - cross @ cho_solve(cho_factor(total), cross), 0.0)))


def apart(course: Course, now: int, others: Array, mounted: Sequence[Mounted], autocovariance: Array) -> Array:
    """How far from what the sensors have shown until `now` lies what they would have, had each of `others` been used.

    In standard deviations of the best test between both, shape (R,); `others`, shape (R, N), at each step. Of the train
    and the track no more is told than else.
    """
    end = now + 1
    shown, climbed, errors = _shown(course, now, end, mounted)
    of_train = (course.unknown.slowing - course.unknown.used)[:end]
    moved = shown @ of_train
    total = shown @ _swinging(course, end, autocovariance) @ shown.T + moved @ moved.T + climbed @ climbed.T + errors
    off = shown @ (course.used - others)[:, :end].T
    return np.asarray(np.sqrt(np.sum(off * cho_solve(cho_factor(total), off), axis=0)))


def _swinging(course: Course, end: int, autocovariance: Array) -> Array:
    """Covariance of the adhesion used about what it is in the mean of days."""
    swings = course.swings[:end] * course.smooth[:end]
    return np.asarray(np.outer(swings, swings) * toeplitz(autocovariance[:end]))


def _shown(course: Course, now: int, end: int, mounted: Sequence[Mounted]) -> tuple[Array, Array, Array]:
    """What all sensors show until now of what slows the train down, and of the grade; the covariance of their errors.

    Place and speed at first count among these.
    """
    sensors = [one for one in mounted if isinstance(one.sensor, HONEST)]
    seen = [_seen(one, course, now, end) for one in sensors]
    grade = course.unknown.grade[:end]
    climbed = [part[0] @ grade * (not isinstance(one.sensor, Imu)) for part, one in zip(seen, sensors, strict=True)]
    moved = np.vstack([part[1] for part in seen])
    errors = moved @ moved.T + block_diag(*(part[2] for part in seen))
    return np.vstack([part[0] for part in seen]), np.vstack(climbed), errors


def _seen(mounted: Mounted, course: Course, now: int, end: int) -> tuple[Array, Array, Array]:
    """What a sensor shows until now: of what slows down; of place and speed at first; its errors' covariance."""
    sensor = mounted.sensor.gnss if isinstance(mounted.sensor, GnssFix) else mounted.sensor
    per_step = mounted.timing.rate_hz * STEP_S
    every, together = max(round(1.0 / per_step), 1), max(per_step, 1.0)
    at = np.arange(now % every, now + 1, every)
    time_s, one, speed = course.time_s[at] - course.time_s[0], np.ones(at.size), course.speed_mps[at]
    slower = -GRAVITY * STEP_S * np.tri(now + 1, end)
    first = np.column_stack([0.0 * one, FAST_MPS * one])
    if isinstance(sensor, Imu):
        steady = sensor.bias_std_mps2**2 + (GRAVITY * sensor.mounting_std_rad) ** 2
        pitched = PITCH_STD * GRAVITY * course.smooth[at] * (course.time_s[at] > 0.0)
        errors = sensor.white_std_mps2**2 / together * np.eye(at.size) + steady + np.outer(pitched, pitched)
        return -GRAVITY * np.eye(now + 1, end)[at], 0.0 * first, errors
    if isinstance(sensor, Wheels):
        noise, worn = (sensor.noise * speed) ** 2 / (len(sensor.groups(course.axles)) * together), WORN_STD * speed
        return slower[at], first, np.diag(noise) + np.outer(worn, worn)
    assert isinstance(sensor, Gnss | Speedometer)  # the last that are honest
    lasting = np.exp(-np.abs(time_s[:, np.newaxis] - time_s) / sensor.correlation_s)
    if isinstance(sensor, Gnss):
        errors = sensor.white_std_m**2 / together * np.eye(at.size) + sensor.correlated_std_m**2 * lasting
        return (STEP_S * np.cumsum(slower, axis=0))[at], np.column_stack([FAR_M * one, FAST_MPS * time_s]), errors
    scale = sensor.scale_std * speed
    errors = sensor.white_std_mps**2 / together * np.eye(at.size) + sensor.correlated_std_mps**2 * lasting
    return slower[at], first, errors + np.outer(scale, scale)
