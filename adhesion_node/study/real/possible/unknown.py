# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.


"""What is not known before a braking: of the rail, of the train, and of the track where no profile is told.

The train is one of its type: its mass, resistance, pads and rotating mass differ from its papers as they do in the
plant, which is told. So they do where a scenario forces one of them: of that nothing is told.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sim_node.real import known
from sim_node.real.plant.scenarios import SCENARIOS, Scenario
from sim_node.real.plant.train import FADE_MPS, USUAL
from sim_node.real.plant.way import CELL_M, LEVEL, draw

from ....core.physics.train import Array
from ....run.results.score import SLOWEST_MPS
from .. import point_mass

if TYPE_CHECKING:
    from .courses import Course

FACTOR_STD = 0.5
"""What is known beforehand of a factor of the adhesion."""

POWER_STD = 0.06
"""What is known beforehand of the power of the speed: published laws fall with the powers 0 (a film of leaves) to 0.2
(`wet`), what a train with slide protection uses with 0 to 0.06 in the plant."""

DRAWN = 100
"""Profiles, where none is told."""

STEP_S = 0.2
"""Of a course."""


class Unknown(NamedTuple):
    """What each unknown changes by one standard deviation, at N steps, over g."""

    used: Array
    """Of the adhesion used, shape (N, K)."""
    slowing: Array
    """Of all that slows the train down, as an accelerometer feels it, shape (N, K): the same unknowns."""
    grade: Array
    """Of the grade, which none feels, shape (N, J)."""

    def on_a_steady_rail(self) -> Unknown:
        """Where adhesion does not depend on the speed: without the first of them, its power."""
        return self._replace(used=self.used[:, 1:], slowing=self.slowing[:, 1:])


def unknown_of(course: Course, scenario: str) -> Unknown:
    """All unknowns of a course; of the point mass those of the rail alone."""
    used = _of_the_rail(course)
    if scenario == point_mass.NAME:
        return Unknown(used, used, np.zeros((course.time_s.size, 0)))
    told = SCENARIOS[scenario]
    resisting = course.braked * known.train(told).specific_resistance(course.speed_mps)
    brakes = np.zeros_like(resisting) if course.asked else course.smooth
    over_speed = np.minimum(course.speed_mps / FADE_MPS, 1.0) - 0.5
    turning = (course.smooth + resisting) / (1.0 + told.nominal.rotating)
    nothing = np.zeros_like(resisting)
    of_train = [
        (-USUAL.mass_std, brakes, brakes + resisting),
        (USUAL.pads_std, brakes, brakes),
        (USUAL.pads_std, over_speed * brakes, over_speed * brakes),
        (USUAL.resistance_std, nothing, resisting),
        (-USUAL.rotating_std, nothing, turning),
    ]
    own, all_in_all = (np.column_stack([std * each[index] for std, *each in of_train]) for index in (0, 1))
    grade = np.zeros((nothing.size, 0)) if told.grade is LEVEL or told.known_grade else _drawn(course, told)
    return Unknown(np.hstack([used, own]), np.hstack([used, all_in_all]), grade)


def _of_the_rail(course: Course) -> Array:
    """The power of the speed and the factors of its adhesion; 0 where the brake limits all the time."""
    slower = np.log(np.maximum(course.speed_mps, SLOWEST_MPS) / course.speed_mps[0])
    power = POWER_STD * course.factors.sum(axis=1) * slower
    columns = np.column_stack([power, FACTOR_STD * course.factors])
    return np.asarray(course.smooth[:, np.newaxis] * columns * bool(course.asked))


def _drawn(course: Course, told: Scenario) -> Array:
    """Grades along the course by profiles that are as likely as its own: their mean square is the covariance."""
    place, length_m = np.cumsum(STEP_S * course.speed_mps), told.nominal.length_m
    ways = (draw(told.rail, told.grade, length_m, place[-1], np.random.default_rng(seed)) for seed in range(DRAWN))
    grades = [np.interp(place, way.start_m + CELL_M * np.arange(way.grade.size), way.grade) for way in ways]
    return np.asarray(np.column_stack(grades) / np.sqrt(DRAWN))
