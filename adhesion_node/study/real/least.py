# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The least error that mu, and the least excess that the safe curve could have in a case.

They are those of the best linear estimator of an easier task. It is told train, grade and the sensors' errors, that
adhesion limits and from when on, where the rail changes, how it depends on speed on such a rail in the mean of days,
but for a factor between two changes and a power of the speed, and how it swings about that: its autocovariance in the
plant. Unknown are factors and power, place and speed, scale and bias of the sensors, and how the train pitches. For
Gaussian swings no estimator does better.

    var(m | y) = w'K w - k'S^-1 k,   k = H K w,   S = H K H' + U U' + R

with the covariance K of the adhesion used u; its mean m = w'u, over 1 s about now (half of which still lies ahead) or
over the way ahead; what the sensors show, H u; what else is unknown, U; and their errors, R.

A way is in proportion to 1/(m + r), with the resistance r of train and grade. Where that is known in proportion, within
s, the shortest curve that holds with 99 % is in the mean longer than the true one by e^(2.33 s + s^2/2) - 1.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, toeplitz
from scipy.stats import norm

from sim_node.real.sensors.fitted import FITTED, Mounted
from sim_node.real.sensors.imu import Imu
from sim_node.real.sensors.position import Gnss, GnssFix
from sim_node.real.sensors.speed import Speedometer
from sim_node.real.sensors.wheels import Wheels

from ...core.physics.train import GRAVITY, Array
from .cases import Case
from .courses import STEP_S, Course, autocovariance_of, courses_of, remaining_m
from .trials import SLOWEST_MPS
from .truth import USED_S

TIMES_AHEAD = 10
"""Moments of a journey that are asked about the way ahead, most of them early."""

HOLDS = float(norm.ppf(0.99))
"""Standard deviations below which 99 % lie."""

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

OF_STD = float(np.sqrt(2.0 / np.pi))
"""Mean absolute error of a Gaussian over its standard deviation."""


class Least(NamedTuple):
    """What no estimator goes below in a case; None where none is told."""

    error_percent: float | None = None
    """Mean absolute error of mu against used."""
    excess_percent: float | None = None
    """Mean excess of a curve that holds with 99 %."""


def least(case: Case) -> Least:
    """The bounds of a case, of patches that of the error alone.

    Where adhesion limits, sensors' errors are known, and no wheels tell of the speed, too.
    """
    if case.fitted not in FITTED:
        return Least()
    fitted = FITTED[case.fitted].sensors.values()
    if any(isinstance(one.sensor, Wheels) for one in fitted):
        return Least()
    mounted = [one for one in fitted if isinstance(one.sensor, HONEST)]
    courses = [course for course in courses_of(case.scenario, case.built_after_s) if course.asked]
    if not mounted or not courses:
        return Least()
    autocovariance = autocovariance_of(courses)
    errors = [
        OF_STD * std_of(course, now, _present(course, now), mounted, autocovariance) / course.smooth[now]
        for course in courses
        for now in course.asked
    ]
    steady = () if case.rail == "patches" else courses
    excesses = [_excess(course, mounted, autocovariance) for course in steady if len(course.counted)]
    return Least(100.0 * float(np.mean(errors)), 100.0 * float(np.mean(excesses)) if excesses else None)


def _excess(course: Course, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """Mean excess over the steps that count, of which some are computed."""
    counted = np.asarray(course.counted)
    some = counted[np.unique((np.linspace(0.0, 1.0, TIMES_AHEAD) ** 2 * (counted.size - 1)).round().astype(int))]
    stds = np.array([std_of(course, now, _ahead(course, now), mounted, autocovariance) for now in some])
    slowing = course.speed_mps[some] ** 2 / (2.0 * GRAVITY * remaining_m(course.speed_mps)[some])
    known = np.interp(counted, some, stds / slowing)
    return float(np.mean(np.expm1(HOLDS * known + known**2 / 2.0)))


def _present(course: Course, now: int) -> Array:
    """Weights of the mean over `USED_S` about the step `now`."""
    half = round(USED_S / 2 / STEP_S)
    mean = np.zeros(min(now + half + 1, course.time_s.size))
    mean[now - half :] = 1.0 / (mean.size - now + half)
    return mean


def _ahead(course: Course, now: int) -> Array:
    """Weights of the mean over the way from the step `now` on."""
    way = np.where(np.arange(course.time_s.size) >= now, course.speed_mps, 0.0)
    return np.asarray(way / way.sum())


def std_of(course: Course, now: int, mean: Array, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """Standard deviation of a mean of the adhesion used, by its weights, given all that was measured until `now`."""
    end = mean.size
    smooth, swings, factors = course.smooth[:end], course.swings[:end], course.factors[:end]
    power = factors.sum(axis=1) * np.log(np.maximum(course.speed_mps[:end], SLOWEST_MPS) / course.speed_mps[now])
    spread = FACTOR_STD**2 * factors @ factors.T + POWER_STD**2 * np.outer(power, power)
    spread += np.outer(swings, swings) * toeplitz(autocovariance[:end])
    spread *= np.outer(smooth, smooth)
    seen = [_seen(one, course, now, end) for one in mounted if isinstance(one.sensor, HONEST)]
    shown, moved = np.vstack([part[0] for part in seen]), np.vstack([part[1] for part in seen])
    total = shown @ spread @ shown.T + moved @ moved.T + block_diag(*(part[2] for part in seen))
    cross = shown @ spread @ mean
    return float(np.sqrt(max(mean @ spread @ mean - cross @ cho_solve(cho_factor(total), cross), 0.0)))


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
