# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The least error that mu, and the least excess that the safe curve could have in a case.

They are those of the best linear estimator of an easier task. It is told the sensors' errors and by how much each wheel
slides, that adhesion limits and from when on, where the rail changes, how it depends on speed on such a rail in the
mean of days, but for a factor between two changes and a power of the speed, and how it swings about that: its
autocovariance in the plant. Unknown are factors and power, place and speed, scale and bias of the sensors, how the
train pitches, and by how much it differs from its papers (`unknown`). For Gaussian swings no
estimator does better in the mean over such laws of the speed, rails and trains; on a single one it may.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from sim_node.real.sensors.fitted import FITTED, Mounted
from sim_node.real.sensors.timing import Timing

from ....command.running import Arrays, Running, run_all
from ....core.physics.train import Array
from ....run.results.used import USED_S
from ..cases import Case
from .courses import Course, autocovariance_of, courses_of
from .excess import excess_of
from .knowledge import HONEST, std_of
from .unknown import STEP_S

OF_STD = float(np.sqrt(2.0 / np.pi))
"""Mean absolute error of a Gaussian over its standard deviation."""


class Least(NamedTuple):
    """What no estimator goes below in a case; None where none is told."""

    error_percent: float | None = None
    """Mean absolute error of mu against used."""
    excess_percent: float | None = None
    """Mean excess of a curve that holds with 99 %."""


class Bounds(NamedTuple):
    """The bounds of a scenario with some sensors: a task."""

    scenario: str
    built_after_s: float
    mounted: tuple[Mounted, ...]

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"least-{self.scenario}"

    @property
    def weight(self) -> float:
        """How much work it is beside the others: each sensor adds as many rows."""
        return float(len(self.mounted)) ** 2

    def compute(self) -> Arrays:
        """Error and excess, percent; NaN where there is none."""
        courses = courses_of(self.scenario, self.built_after_s)
        autocovariance = autocovariance_of(courses)
        errors = [
            OF_STD * std_of(course, now, _present(course, now), self.mounted, autocovariance) / course.smooth[now]
            for course in courses
            for now in course.asked
        ]
        excesses = [excess_of(course, self.mounted, autocovariance) for course in courses if len(course.counted)]
        return {
            name: np.array(100.0 * np.mean(each) if each else np.nan)
            for name, each in zip(Least._fields, (errors, excesses), strict=True)
        }


def least(cases: Iterable[Case], where: Running) -> Mapping[Case, Least]:
    """The bounds of cases: of the error where adhesion limits, of the excess everywhere.

    None where sensors err by no law. Outages, delays and stamps are left out.
    """
    tasks = {case: task for case in cases if (task := _bounds(case)) is not None}
    found = zip(tasks, run_all(list(tasks.values()), where), strict=True)
    told = {
        case: Least(*(None if np.isnan(value := arrays[name].item()) else value for name in Least._fields))
        for case, arrays in found
    }
    return {case: told.get(case, Least()) for case in cases}


def _bounds(case: Case) -> Bounds | None:
    if case.fitted not in FITTED:
        return None
    honest = (one for one in FITTED[case.fitted].sensors.values() if isinstance(one.sensor, HONEST))
    plain = tuple(one._replace(timing=Timing(rate_hz=one.timing.rate_hz)) for one in honest)
    return Bounds(case.scenario, case.built_after_s, plain) if plain else None


def _present(course: Course, now: int) -> Array:
    """Weights of the mean over `USED_S` about the step `now`."""
    half = round(USED_S / 2 / STEP_S)
    mean = np.zeros(min(now + half + 1, course.time_s.size))
    mean[now - half :] = 1.0 / (mean.size - now + half)
    return mean
