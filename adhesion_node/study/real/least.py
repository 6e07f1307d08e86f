# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The least error that mu, and the least excess that the safe curve could have in a case.

They are those of the best linear estimator of an easier task. It is told train, grade and the sensors' errors, that
adhesion limits and from when on, how it depends on speed on such a rail in the mean of days, but for a factor, and how
it swings about that: its autocovariance in the plant. Unknown are the factor, place and speed, scale and bias of the
sensors, and how the train pitches. For Gaussian swings no estimator does better.

    var(m | y) = w'K w - k'S^-1 k,   k = H K w,   S = H K H' + U U' + R

with the covariance K of the adhesion used u; its mean m = w'u, over 1 s about now (half of which still lies ahead) or
over the way ahead; what the sensors show, H u; what else is unknown, U; and their errors, R.

A way is in proportion to 1/(m + r), with the resistance r of train and grade. Where that is known in proportion, within
s, the shortest curve that holds with 99 % is in the mean longer than the true one by e^(2.33 s + s^2/2) - 1.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, toeplitz
from scipy.stats import norm

from sim_node.real.plant.journey import PERIOD_S, Journey
from sim_node.real.sensors.fitted import FITTED, Mounted
from sim_node.real.sensors.imu import Imu
from sim_node.real.sensors.position import Gnss, GnssFix
from sim_node.real.sensors.speed import Speedometer
from sim_node.real.sensors.wheels import Wheels

from ...core.physics.train import GRAVITY, Array
from ...run.results.score import CONVERGED_AFTER_MPS
from .cases import Case
from .score import AFTER_SHARE, LIMITS_FROM, LONG_WAY_M
from .trials import SLOWEST_MPS
from .truth import USED_S, slid

SEEDS = (5000, 5001, 5002, 5003)
"""Of the journeys; the bound is the mean over them."""

STEP_S, BEFORE_S, TIMES, TIMES_AHEAD = 0.2, 10.0, 4, 10
"""Of the grid; what is used of the time before the full brake; how many moments of a journey are asked about the
present, and about the way ahead, most of them early."""

HOLDS = float(norm.ppf(0.99))
"""Standard deviations below which 99 % lie."""

FACTOR_STD, FAR_M, FAST_MPS = 0.5, 1e3, 50.0
"""What is known beforehand of the factor, and of place and speed."""

PITCH_STD = 0.029
"""Of what an accelerometer feels too much as the nose dips under the brake, over what slows the train down: 0.3 to 1
degree at 1.2 m/s^2, which no train's papers tell."""

HONEST = (Gnss, GnssFix, Speedometer, Imu)
"""Sensors whose errors have a law; a wheel's are those of its slides."""

OF_STD = float(np.sqrt(2.0 / np.pi))
"""Mean absolute error of a Gaussian over its standard deviation."""


class Course(NamedTuple):
    """A journey from before the full brake on, at N steps of `STEP_S`, arrays (N,)."""

    time_s: Array
    """From the full brake on."""
    speed_mps: Array
    used: Array
    """Mean over a step."""
    smooth: Array
    """The same as it depends on speed on such a rail."""
    swings: Array
    """1 where adhesion limits and swings, else 0."""
    asked: Sequence[int]
    """Steps at which the error is asked for."""
    counted: Sequence[int]
    """Steps at which the excess counts."""


class Least(NamedTuple):
    """What no estimator goes below in a case; None where none is told."""

    error_percent: float | None = None
    """Mean absolute error of mu against used."""
    excess_percent: float | None = None
    """Mean excess of a curve that holds with 99 %."""


def least(case: Case) -> Least:
    """The bounds of a case: where adhesion limits, sensors' errors are known, and no wheels tell of the speed, too."""
    if case.fitted not in FITTED or case.rail == "patches":
        return Least()
    fitted = FITTED[case.fitted].sensors.values()
    if any(isinstance(one.sensor, Wheels) for one in fitted):
        return Least()
    mounted = [one for one in fitted if isinstance(one.sensor, HONEST)]
    courses = [course for course in _courses(case.scenario, case.built_after_s) if course.asked]
    if not mounted or not courses:
        return Least()
    autocovariance = autocovariance_of(courses)
    errors = [
        OF_STD * std_of(course, now, _present(course, now), mounted, autocovariance) / course.smooth[now]
        for course in courses
        for now in course.asked
    ]
    excesses = [_excess(course, mounted, autocovariance) for course in courses if len(course.counted)]
    return Least(100.0 * float(np.mean(errors)), 100.0 * float(np.mean(excesses)) if excesses else None)


def _excess(course: Course, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """Mean excess over the steps that count, of which some are computed."""
    counted = np.asarray(course.counted)
    some = counted[np.unique((np.linspace(0.0, 1.0, TIMES_AHEAD) ** 2 * (counted.size - 1)).round().astype(int))]
    stds = np.array([std_of(course, now, _ahead(course, now), mounted, autocovariance) for now in some])
    slowing = course.speed_mps[some] ** 2 / (2.0 * GRAVITY * _remaining_m(course.speed_mps)[some])
    known = np.interp(counted, some, stds / slowing)
    return float(np.mean(np.expm1(HOLDS * known + known**2 / 2.0)))


@lru_cache(maxsize=2)  # the cases of a scenario follow each other
def _courses(scenario: str, built_after_s: float) -> tuple[Course, ...]:
    journeys = (drive.journey for drive in Case(scenario, "gnss").drives(SEEDS))
    return on_the_mean([_course(journey, built_after_s) for journey in journeys])


def _course(journey: Journey, built_after_s: float) -> Course:
    stride = round(STEP_S / PERIOD_S)
    start = int(np.searchsorted(journey.time_s, journey.full_from_s - BEFORE_S))
    count = (journey.time_s.size - start) // stride
    time_s, speed, used, sliding = (
        column[start : start + count * stride].reshape(count, stride).mean(axis=1)
        for column in (journey.time_s - journey.full_from_s, journey.speed_mps, journey.used, slid(journey))
    )
    at_full = float(np.interp(0.0, time_s, speed))
    limits = (time_s >= built_after_s) & (sliding >= LIMITS_FROM) & (speed > SLOWEST_MPS)
    late = np.flatnonzero(limits & (speed < at_full - min(CONVERGED_AFTER_MPS, AFTER_SHARE * at_full)))
    asked = late[np.linspace(0, late.size - 1, TIMES).round().astype(int)].tolist() if late.size else []
    counted = (time_s >= built_after_s) & (_remaining_m(speed) > LONG_WAY_M) & (speed > SLOWEST_MPS)
    return Course(time_s, speed, used, used, limits.astype(np.float64), asked, np.flatnonzero(counted).tolist())


def _remaining_m(speed_mps: Array) -> Array:
    """Way to the end from every step on."""
    return STEP_S * np.cumsum(speed_mps[::-1])[::-1]


def on_the_mean(courses: Sequence[Course]) -> tuple[Course, ...]:
    """With adhesion as it depends on speed in the mean, a parabola of its logarithm, but for a factor of each."""
    limits = [course.swings > 0.0 for course in courses]
    if sum(map(np.count_nonzero, limits)) < len(courses) + 2:
        return tuple(courses)
    fastest = max(float(course.speed_mps.max()) for course in courses)
    rows = [
        np.column_stack([(v := course.speed_mps[where] / fastest), v**2, np.tile(one, (v.size, 1))])
        for course, where, one in zip(courses, limits, np.eye(len(courses)), strict=True)
    ]
    logarithms = [np.log(np.maximum(course.used[where], 1e-4)) for course, where in zip(courses, limits, strict=True)]
    fit = np.linalg.lstsq(np.vstack(rows), np.concatenate(logarithms), rcond=None)[0]
    result = list[Course]()
    for course, where, row in zip(courses, limits, rows, strict=True):
        smooth = course.used.copy()
        smooth[where] = np.exp(row @ fit)
        result.append(course._replace(smooth=smooth))
    return tuple(result)


def autocovariance_of(courses: Sequence[Course]) -> Array:
    """Of the swings, relative, at every distance in steps; biased, so that it is one of a process."""
    total, count = np.zeros(max(course.time_s.size for course in courses)), 0.0
    for course in courses:
        swing = course.swings * (course.used / np.maximum(course.smooth, 1e-6) - 1.0)
        total[: swing.size] += np.correlate(swing, swing, "full")[swing.size - 1 :]
        count += float(course.swings.sum())
    return np.asarray(total / max(count, 1.0))


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
    smooth, swings, braked = course.smooth[:end], course.swings[:end], course.time_s[:end] > 0.0
    spread = FACTOR_STD**2 * np.outer(braked, braked) + np.outer(swings, swings) * toeplitz(autocovariance[:end])
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
