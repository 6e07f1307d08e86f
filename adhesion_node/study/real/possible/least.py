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
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sim_node.real.sensors.fitted import FITTED, Mounted
from sim_node.real.sensors.timing import Timing
from sim_node.real.sensors.wheels import Wheels

from ....core.physics.train import Array
from ..cases import Case
from ..truth import USED_S
from .courses import STEP_S, Course, autocovariance_of, courses_of
from .excess import excess_of
from .knowledge import HONEST, std_of

OF_STD = float(np.sqrt(2.0 / np.pi))
"""Mean absolute error of a Gaussian over its standard deviation."""


class Least(NamedTuple):
    """What no estimator goes below in a case; None where none is told."""

    error_percent: float | None = None
    """Mean absolute error of mu against used."""
    excess_percent: float | None = None
    """Mean excess of a curve that holds with 99 %."""


def least(case: Case) -> Least:
    """The bounds of a case: of the error where adhesion limits, of the excess where the rail does not change.

    None where sensors err by no law, or wheels tell of the speed, too. Outages, delays and stamps are left out.
    """
    if case.fitted not in FITTED:
        return Least()
    fitted = FITTED[case.fitted].sensors.values()
    mounted = [one for one in fitted if isinstance(one.sensor, HONEST)]
    if not mounted or any(isinstance(one.sensor, Wheels) for one in fitted):
        return Least()
    plain = tuple(one._replace(timing=Timing(rate_hz=one.timing.rate_hz)) for one in mounted)
    found = _least(case.scenario, case.built_after_s, plain)
    return found if case.rail != "patches" else found._replace(excess_percent=None)


@lru_cache(maxsize=32)  # many sets of sensors differ by what these leave out
def _least(scenario: str, built_after_s: float, mounted: tuple[Mounted, ...]) -> Least:
    courses = courses_of(scenario, built_after_s)
    limited = [course for course in courses if course.asked]
    longest = max(course.time_s.size for course in courses)
    autocovariance = autocovariance_of(limited) if limited else np.zeros(longest)
    errors = [
        OF_STD * std_of(course, now, _present(course, now), mounted, autocovariance) / course.smooth[now]
        for course in limited
        for now in course.asked
    ]
    excesses = [excess_of(course, mounted, autocovariance) for course in courses if len(course.counted)]
    return Least(*(100.0 * float(np.mean(each)) if each else None for each in (errors, excesses)))


def _present(course: Course, now: int) -> Array:
    """Weights of the mean over `USED_S` about the step `now`."""
    half = round(USED_S / 2 / STEP_S)
    mean = np.zeros(min(now + half + 1, course.time_s.size))
    mean[now - half :] = 1.0 / (mean.size - now + half)
    return mean
