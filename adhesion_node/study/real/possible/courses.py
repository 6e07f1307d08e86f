# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The journeys of a case as the bounds see them: what is used on a grid of time, in the mean of days and about that."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from sim_node.real.plant.journey import PERIOD_S, Journey
from sim_node.real.plant.validation import slid

from ....core.physics.train import Array
from ....run.results.score import AFTER_SHARE, CONVERGED_AFTER_MPS, SLOWEST_MPS
from ..cases import Case
from ..score import LIMITS_FROM, LONG_WAY_M, UNSEEN_S
from ..truth import Border, borders
from .unknown import STEP_S, Unknown, unknown_of

SEEDS = (5000, 5001, 5002, 5003)
"""Of the journeys."""

BEFORE_S, TIMES, TIMES_OF_PATCHES = 10.0, 4, 24
"""What is used of the time before the full brake; how many moments of a journey are asked about the present, more where
the rail changes."""


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
    factors: Array
    """1 where a factor of the adhesion of its own applies, shape (N, F): one from border to border of the rail."""
    braked: Array
    """1 from the first demand on: before it traction makes up for what slows the train down."""
    asked: Sequence[int]
    """Steps at which the error is asked for."""
    counted: Sequence[int]
    """Steps at which the excess counts."""
    since_s: float
    """The rail has changed for the last time; -inf: it does not change."""
    axles: int
    unknown: Unknown
    """What is not known of rail, train and track."""


@lru_cache(maxsize=2)  # the cases of a scenario follow each other
def courses_of(scenario: str, built_after_s: float) -> tuple[Course, ...]:
    """Journeys of a scenario, whose brake has built up everywhere after so long, on their mean."""
    journeys = (drive.journey for drive in Case(scenario, "gnss").drives(SEEDS))
    courses = on_the_mean([_course(journey, built_after_s) for journey in journeys])
    return tuple(course._replace(unknown=unknown_of(course, scenario)) for course in courses)


def _course(journey: Journey, built_after_s: float) -> Course:
    stride = round(STEP_S / PERIOD_S)
    start = int(np.searchsorted(journey.time_s, journey.full_from_s - BEFORE_S))
    count = (journey.time_s.size - start) // stride
    demanded = np.maximum.accumulate(journey.demanded_pa > 0.0)
    since_s, share = journey.time_s - journey.full_from_s, slid(journey).mean(axis=1)
    time_s, speed, used, sliding, braked = (
        column[start : start + count * stride].reshape(count, stride).mean(axis=1)
        for column in (since_s, journey.speed_mps, journey.used, share, demanded)
    )
    at_full = float(np.interp(0.0, time_s, speed))
    limits = (time_s >= built_after_s) & (sliding >= LIMITS_FROM) & (speed > SLOWEST_MPS)
    late = np.flatnonzero(limits & (speed < at_full - min(CONVERGED_AFTER_MPS, AFTER_SHARE * at_full)))
    between = borders(journey)
    factors = _factors(time_s + journey.full_from_s, between, limits)
    times = TIMES if factors.shape[1] == 1 else TIMES_OF_PATCHES
    asked = late[np.linspace(0, late.size - 1, times).round().astype(int)].tolist() if late.size else []
    changed_s = max((border.end_s for border in between), default=-np.inf) - journey.full_from_s
    counted = (time_s >= max(built_after_s, changed_s + UNSEEN_S)) & (remaining_m(speed) > LONG_WAY_M)
    swings = limits.astype(np.float64)
    factors = factors if factors.shape[1] > 1 else (time_s > 0.0).astype(np.float64)[:, np.newaxis]
    some = asked, np.flatnonzero(counted & (speed > SLOWEST_MPS)).tolist()
    known = Unknown(*np.zeros((3, count, 0)))
    return Course(
        time_s, speed, used, used, swings, factors, braked, *some, changed_s, journey.wheel_radps.shape[1], known
    )


def _factors(time_s: Array, between: Sequence[Border], limits: NDArray[np.bool_]) -> Array:
    """One factor from border to border, the next one coming in while the train passes; none where the brake limits."""
    passed = [np.interp(time_s, (border.start_s, border.end_s), (0.0, 1.0)) for border in between]
    ends = np.array([np.ones(time_s.size), *passed, np.zeros(time_s.size)])
    return np.asarray((ends[:-1] - ends[1:]).T * limits[:, np.newaxis])


def remaining_m(speed_mps: Array) -> Array:
    """Way to the end from every step on."""
    return STEP_S * np.cumsum(speed_mps[::-1])[::-1]


def on_the_mean(courses: Sequence[Course]) -> tuple[Course, ...]:
    """With adhesion as it depends on speed in the mean, a parabola of its logarithm, but for the factors of each."""
    limits = [course.swings > 0.0 for course in courses]
    own = block_diag(*(course.factors[where] for course, where in zip(courses, limits, strict=True)))
    if own.shape[0] < own.shape[1] + 2:
        return tuple(courses)
    fastest = max(float(course.speed_mps.max()) for course in courses)
    speed = np.concatenate([course.speed_mps[where] for course, where in zip(courses, limits, strict=True)]) / fastest
    rows = np.column_stack([speed, speed**2, own])
    logarithms = [np.log(np.maximum(course.used[where], 1e-4)) for course, where in zip(courses, limits, strict=True)]
    fitted = np.exp(rows @ np.linalg.lstsq(rows, np.concatenate(logarithms), rcond=None)[0])
    result = list[Course]()
    for course, where in zip(courses, limits, strict=True):
        smooth = course.used.copy()
        smooth[where], fitted = np.split(fitted, [np.count_nonzero(where)])
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
