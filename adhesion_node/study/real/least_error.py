# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The least error that mu could have in a case: that of the best linear estimator of an easier task.

It is told train, grade and the sensors' errors, when the brake takes hold, the course of the adhesion used but for one
factor, and how it swings about that course: its autocovariance in the plant. Unknown are the factor, place and speed,
scale and bias of the sensors. For Gaussian swings no estimator does better.

    var(m | y) = w'K w - k'S^-1 k,   k = H K w,   S = H K H' + U U' + R

with the covariance K of the adhesion used, whose mean over 1 s about now is m = w'u; what the sensors show, H u; what
else is unknown, U; and their errors, R. Half of that second still lies ahead.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, cho_factor, cho_solve, toeplitz

from sim_node.real.plant.journey import PERIOD_S, Journey
from sim_node.real.sensors.fitted import FITTED, Mounted
from sim_node.real.sensors.imu import Imu
from sim_node.real.sensors.position import Gnss, GnssFix
from sim_node.real.sensors.speed import Speedometer

from ...core.physics.train import GRAVITY, Array
from ...run.score import CONVERGED_AFTER_MPS
from .cases import Case
from .score import AFTER_SHARE, LIMITS_FROM
from .trials import SLOWEST_MPS
from .truth import USED_S, slid

SEEDS = (5000, 5001)
"""Of the journeys; the bound is the mean over them."""

STEP_S, BEFORE_S, TIMES = 0.2, 10.0, 4
"""Of the grid; what is used of the time before the full brake; how many moments of a journey are asked about."""

FACTOR_STD, FAR_M, FAST_MPS = 0.5, 1e3, 50.0
"""What is known beforehand of the factor, and of place and speed."""

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
    """The same without its swings."""
    swings: Array
    """1 where adhesion limits and swings, else 0."""
    asked: Sequence[int]
    """Steps at which the error is asked for."""


def least_error_percent(case: Case) -> float | None:
    """Mean absolute error of mu against used, relative, that no estimator goes below; None where none is told."""
    if case.fitted not in FITTED or case.rail == "patches":
        return None
    mounted = [one for one in FITTED[case.fitted].sensors.values() if isinstance(one.sensor, HONEST)]
    if not mounted:
        return None
    courses = _courses(case.scenario, case.built_after_s)
    autocovariance = autocovariance_of(courses)
    errors = [
        OF_STD * std_of(course, now, mounted, autocovariance) / course.smooth[now]
        for course in courses
        for now in course.asked
    ]
    return 100.0 * float(np.mean(errors)) if errors else None


@lru_cache(maxsize=2)  # the cases of a scenario follow each other
def _courses(scenario: str, built_after_s: float) -> tuple[Course, ...]:
    journeys = (drive.journey for drive in Case(scenario, "gnss").drives(SEEDS))
    return tuple(_course(journey, built_after_s) for journey in journeys)


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
    smooth = used.copy()
    if np.count_nonzero(limits) > 3:
        smooth[limits] = np.polynomial.Polynomial.fit(time_s[limits], used[limits], 2)(time_s[limits])
    late = np.flatnonzero(limits & (speed < at_full - min(CONVERGED_AFTER_MPS, AFTER_SHARE * at_full)))
    asked = late[np.linspace(0, late.size - 1, TIMES).round().astype(int)].tolist() if late.size else []
    return Course(time_s, speed, used, smooth, limits.astype(np.float64), asked)


def autocovariance_of(courses: Sequence[Course]) -> Array:
    """Of the swings, relative, at every distance in steps; biased, so that it is one of a process."""
    total, count = np.zeros(max(course.time_s.size for course in courses)), 0.0
    for course in courses:
        swing = course.swings * (course.used / np.maximum(course.smooth, 1e-6) - 1.0)
        total[: swing.size] += np.correlate(swing, swing, "full")[swing.size - 1 :]
        count += float(course.swings.sum())
    return np.asarray(total / max(count, 1.0))


def std_of(course: Course, now: int, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """Standard deviation of the adhesion used about the step `now`, given all that was measured until then."""
    half = round(USED_S / 2 / STEP_S)
    end = min(now + half + 1, course.time_s.size)
    smooth, swings, braked = course.smooth[:end], course.swings[:end], course.time_s[:end] > 0.0
    spread = FACTOR_STD**2 * np.outer(braked, braked) + np.outer(swings, swings) * toeplitz(autocovariance[:end])
    spread *= np.outer(smooth, smooth)
    mean = np.zeros(end)
    mean[now - half :] = 1.0 / (end - now + half)
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
        errors = sensor.white_std_mps2**2 / together * np.eye(at.size) + sensor.bias_std_mps2**2
        return -GRAVITY * np.eye(now + 1, end)[at], np.zeros((at.size, 2)), errors
    assert isinstance(sensor, Gnss | Speedometer)  # the last that are honest
    lasting = np.exp(-np.abs(time_s[:, np.newaxis] - time_s) / sensor.correlation_s)
    if isinstance(sensor, Gnss):
        errors = sensor.white_std_m**2 / together * np.eye(at.size) + sensor.correlated_std_m**2 * lasting
        return (STEP_S * np.cumsum(slower, axis=0))[at], np.column_stack([FAR_M * one, FAST_MPS * time_s]), errors
    scale = sensor.scale_std * course.speed_mps[at]
    errors = sensor.white_std_mps**2 / together * np.eye(at.size) + sensor.correlated_std_mps**2 * lasting
    return slower[at], np.column_stack([0.0 * one, FAST_MPS * one]), errors + np.outer(scale, scale)
