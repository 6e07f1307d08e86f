# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The least excess that the safe curve could have: at each moment the greatest of three bounds, of easier tasks.

The mean of what slows the train down ahead is unknown. A way is in proportion to its inverse. Where it is known in
proportion, within s, the shortest curve that holds with 99 % is in the mean longer than the true one by
e^(2.33 s + s^2/2) - 1. That it rises with lower speeds, or along the way, no sensor tells: on a rail on which it stays
as it is here, the way is R times as long, and the curve must hold there, too: R e^(2.33 s' + s'^2/2) - 1.

The rail may be another one. On a rail that gives less, u' = min(u, part m), the way is longer, and the curve must hold
there, too. What the sensors have shown until then lies d standard deviations apart. So the curve is at least as long
here as the way there with a probability of Phi(2.33 - d) at least (Neyman and Pearson 1933), and over all such rails

    excess >= integral of Phi(2.33 - d) over way'/way.

Told are all errors of the sensors, and the moment from which on either rail limits.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import norm

from sim_node.real.sensors.fitted import Mounted

from ....core.physics.train import GRAVITY, Array
from .courses import Course, remaining_m
from .knowledge import apart, std_of_slowing
from .unknown import STEP_S

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
        max(way_ahead(course, now, mounted, autocovariance), on_another_rail(course, now, mounted, autocovariance))
        for now in some.tolist()
    ]
    return float(np.mean(np.interp(counted, some, excess)))


def way_ahead(course: Course, now: int, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """Excess from the step `now` on, as it is unknown what will slow the train down in the mean."""
    slowing, ahead = _slowing(course, now), _ahead(course, now)
    steadily: float = slowing / (slowing - float(ahead @ (course.smooth - _foreseen(course, now))))
    flat = course._replace(unknown=course.unknown.on_a_steady_rail())

    def longer(rail: Course) -> float:
        known = std_of_slowing(rail, now, ahead, mounted, autocovariance) / slowing
        return float(np.exp(HOLDS * known + known**2 / 2.0))

    return max(longer(course), steadily * longer(flat)) - 1.0


def on_another_rail(course: Course, now: int, mounted: Sequence[Mounted], autocovariance: Array) -> float:
    """Excess from the step `now` on, as the rail may give less."""
    slowing, ahead, foreseen = _slowing(course, now), _ahead(course, now), _foreseen(course, now)
    parts = np.geomspace(1.0, min(LOWEST_MU / float(ahead @ course.smooth), 1.0), RAILS + 1)[:, np.newaxis]
    first = min(course.counted)
    gives = np.where(np.arange(foreseen.size) < first, foreseen[first], foreseen)
    less = np.maximum(course.smooth - parts * gives, 0.0) * (course.time_s > max(course.since_s, 0.0))
    faster = 1.0 + GRAVITY * STEP_S * np.sum(less[:, : now + 1], axis=1) / course.speed_mps[now]
    longer = faster**2 * slowing / (slowing - less @ ahead)
    taken = norm.cdf(HOLDS - apart(course, now, course.used - less, mounted, autocovariance))
    return float(np.sum(np.diff(longer, prepend=1.0) * taken))  # of each step the rail that is told apart best


def _foreseen(course: Course, now: int) -> Array:
    """What is used, ahead no more than a rail gives that does not rise from the step `now` on."""
    limits = course.swings[now] > 0.0
    ahead = limits & (np.arange(course.smooth.size) > now)
    return np.where(ahead, np.minimum(course.smooth, course.smooth[now]), course.smooth)


def _slowing(course: Course, now: int) -> float:
    """Mean deceleration over g from the step `now` on."""
    return float(course.speed_mps[now] ** 2 / (2.0 * GRAVITY * remaining_m(course.speed_mps)[now]))


def _ahead(course: Course, now: int) -> Array:
    """Weights of the mean over the way from the step `now` on."""
    way = np.where(np.arange(course.time_s.size) >= now, course.speed_mps, 0.0)
    return np.asarray(way / way.sum())
