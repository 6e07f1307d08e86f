# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The least excess that the safe curve could have: at each moment the greater of two bounds, of easier tasks.

The way ahead is as unknown as its mean adhesion. A way is in proportion to 1/(m + r), with the resistance r of train
and grade. Where that is known in proportion, within s, the shortest curve that holds with 99 % is in the mean longer
than the true one by e^(2.33 s + s^2/2) - 1.

The rail may be another one. On a rail that gives less, u' = min(u, part m), the way is longer, and the curve must hold
there, too. What the sensors have shown until then lies d standard deviations apart. So the curve is at least as long
here as the way there with a probability of Phi(2.33 - d) at least (Neyman and Pearson 1933), and over all such rails

    excess >= integral of Phi(2.33 - d) over way'/way.

Told are the train, its brake, the grade, all errors of the sensors, and the moment from which on either rail limits.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import norm

from sim_node.real.sensors.fitted import Mounted

from ....core.physics.train import GRAVITY, Array
from .courses import STEP_S, Course, remaining_m
from .knowledge import apart, std_of

HOLDS = float(norm.ppf(0.99))
"""Standard deviations below which 99 % lie."""

TIMES_AHEAD = 16
"""Moments of a journey that are asked, most of them early."""

LOWEST_MU, RAILS = 0.02, 60
"""The rail that gives least, and how many are looked at from there on."""


def excess_of(course: Course, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """Mean excess over the steps that count, of which some are computed."""
    counted = np.asarray(course.counted)
    some = counted[np.unique((np.linspace(0.0, 1.0, TIMES_AHEAD) ** 2 * (counted.size - 1)).round().astype(int))]
    excess = [
        max(_way_ahead(course, now, mounted, autocovariance), on_another_rail(course, now, mounted, autocovariance))
        for now in some.tolist()
    ]
    return float(np.mean(np.interp(counted, some, excess)))


def _way_ahead(course: Course, now: int, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """As its mean adhesion is unknown, where adhesion limits."""
    if not course.asked:
        return 0.0
    known = std_of(course, now, _ahead(course, now), mounted, autocovariance) / _slowing(course, now)
    return float(np.expm1(HOLDS * known + known**2 / 2.0))


def on_another_rail(course: Course, now: int, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """As the rail may give less."""
    used, slowing = float(_ahead(course, now) @ course.used), _slowing(course, now)
    parts = np.geomspace(1.0, min(LOWEST_MU / used, 1.0), RAILS + 1)[1:, np.newaxis]
    first = min(course.counted)
    gives = np.where(np.arange(course.time_s.size) < first, course.smooth[first], course.smooth)
    others = np.where(course.time_s > 0.0, np.minimum(course.used, parts * gives), course.used)
    faster = 1.0 + GRAVITY * STEP_S * np.sum((course.used - others)[:, : now + 1], axis=1) / course.speed_mps[now]
    longer = faster**2 * slowing / (slowing - used * (1.0 - parts[:, 0]))
    taken = norm.cdf(HOLDS - apart(course, now, others, mounted, autocovariance))
    return float(np.sum(np.diff(longer, prepend=1.0) * taken))  # of each step the rail that is told apart best


def _slowing(course: Course, now: int) -> float:
    """Mean deceleration over g from the step `now` on."""
    return float(course.speed_mps[now] ** 2 / (2.0 * GRAVITY * remaining_m(course.speed_mps)[now]))


def _ahead(course: Course, now: int) -> Array:
    """Weights of the mean over the way from the step `now` on."""
    way = np.where(np.arange(course.time_s.size) >= now, course.speed_mps, 0.0)
    return np.asarray(way / way.sum())
