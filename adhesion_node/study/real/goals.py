# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the estimator shall reach in every case of `study real`, and how far it is from that."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from .cases import AIDED, UNSOUND, Case
from .possible.information import soonest_s
from .score import FOUND_SHARE


class Goal(NamedTuple):
    """The range that a figure shall lie in."""

    figure: str
    least: float = -float("inf")
    most: float = float("inf")

    def missed_by(self, value: float) -> float:
        """How far a value lies outside; negative where it is too small.

        >>> goal = Goal("coverage95", 0.92, 0.99)
        >>> [goal.missed_by(value) for value in (0.5, 0.95, 1.0)]
        [-0.42, 0.0, 0.01]
        """
        return round(min(value - self.least, 0.0) + max(value - self.most, 0.0), 6)


OF_ALL = (
    Goal("bound_kept", least=0.95),
    Goal("coverage95", 0.92, 0.99),
    Goal("safe", least=0.99),
    Goal("shortfall_percent", most=5.0),
    Goal("regime_wrong", most=0.05),
    Goal("false_changes_per_hour", most=1.0),
    Goal("speed_beyond_3_std", most=0.02),
    Goal("silence_s", most=1.0),
)
"""Of every case."""

EXCESS = Goal("excess_percent", most=20.0)
"""Where the sensors are sound; where they are not, the curve of low adhesion is the right answer."""

FOUND_S, OF_SOONEST, PATCH_USED = 1.0, 1.2, 0.04
"""Patches are found within the first with wheels, Doppler or an accelerometer; by positions alone within so many times
what their information allows on a patch where so much adhesion is used."""

ERRORS = {"patches": 6.0, "leaves": 4.0}
"""Greatest error, %, by the rail; on other rails by the sensors."""

ERROR_OF_POSITIONS, ERROR_AIDED = 4.0, 2.0


def goals(case: Case) -> tuple[Goal, ...]:
    """The goals of a case."""
    aided = case.fitted in AIDED
    error = Goal("error_percent", most=ERRORS.get(case.rail, ERROR_AIDED if aided else ERROR_OF_POSITIONS))
    excess = () if case.fitted in UNSOUND else (EXCESS,)
    return error, *OF_ALL, *excess, *_found(case)


def soonest(case: Case) -> float | None:
    """When the sensors of a case could find a patch at best, s; None: too late to matter, or not told."""
    return soonest_s(case.fitted, PATCH_USED, FOUND_SHARE)


def _found(case: Case) -> tuple[Goal, ...]:
    if case.rail != "patches":
        return ()
    if case.fitted in AIDED or "wheels" in case.fitted:
        return (Goal("found_s", most=FOUND_S),)
    bound_s = soonest(case)
    return () if bound_s is None else (Goal("found_s", most=OF_SOONEST * bound_s),)


def missed(case: Case, row: Mapping[str, Any]) -> dict[str, float]:
    """By how much a row misses its goals, by figure; only those that it misses."""
    judged = ((goal, row[goal.figure]) for goal in goals(case))
    distances = {goal.figure: goal.missed_by(value) for goal, value in judged if value is not None}
    return {figure: distance for figure, distance in distances.items() if distance}
