# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Speeds of 0: of a train that stands they are right, of one that runs they are not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from adhesion_node.core import Measurement, Outcome, SpeedSample
from adhesion_node.core.intake.plausibility import Pace, believed
from adhesion_node.core.intake.standing import Standing, moving

S = 1_000_000_000


def measured(t_s: float, *speeds_mps: float) -> Measurement:
    """Speeds of the last tenth of a second, and the newest."""
    t_ns, count = round(t_s * S), len(speeds_mps)
    samples = tuple(
        SpeedSample(t_ns - (count - 1 - index) * S // 100, speed, 0.01) for index, speed in enumerate(speeds_mps)
    )
    return Measurement(t_ns, 0.0, math.inf, speed_mps=speeds_mps[-1], speeds=samples)


@pytest.mark.parametrize("shown_mps", [0.0, 0.2, -0.1])
@pytest.mark.parametrize(("was_mps", "gap_s", "right"), [(40.0, 0.1, False), (40.0, 14.0, True), (2.5, 0.1, True)])
def test_a_train_stops_no_faster_than_brakes_allow(was_mps: float, gap_s: float, right: bool, shown_mps: float) -> None:
    _, standing, _ = moving(measured(1.0, was_mps), Standing(), Pace())
    left, standing, told = moving(measured(1.0 + gap_s, shown_mps), standing, Pace())
    assert (left.speed_mps is not None) == bool(left.speeds) == (told == ()) == right
    assert standing.silent != right
    again, standing, _ = moving(measured(1.2 + gap_s, shown_mps), standing, Pace())
    assert (again.speed_mps is not None) == right


def test_it_right_again_once_it_shows_a_speed() -> None:
    _, standing, _ = moving(measured(1.0, 40.0), Standing(), Pace())
    left, standing, told = moving(measured(1.1, 40.0, 0.0, 39.9), standing, Pace())
    assert [sample.speed_mps for sample in left.speeds] == [40.0, 39.9]
    assert left.speed_mps == 39.9
    assert [event.outcome for event in told] == [Outcome.STUCK]
    assert not standing.silent


def test_a_speed_without_its_samples_is_judged_too() -> None:
    standing = Standing()
    for speed_mps, kept_mps in ((40.0, 40.0), (0.0, None), (0.0, None), (38.0, 38.0)):
        one = Measurement(standing.t_ns + S // 10, 0.0, math.inf, speed_mps=speed_mps)
        left, standing, _ = moving(one, standing, Pace())
        assert left.speed_mps == kept_mps


def paced(places_m: list[float]) -> Pace:
    pace = Pace()
    for index, place_m in enumerate(places_m):
        pace = pace.after(Measurement(index * S // 2, place_m, 4.0))
    return pace


def test_positions_that_run_belie_a_standstill() -> None:
    assert paced([20.0 * index for index in range(13)]).runs
    assert not paced([2.0 * index for index in range(60)]).runs
    left, standing, told = moving(measured(9.0, 0.0), Standing(), paced([20.0 * index for index in range(13)]))
    assert left.speeds == ()
    assert standing.silent
    assert told


def shown_beside(share: float, seconds: float = 12.0, back_s: float = 99.0) -> Pace:
    """At 30 m/s, ten speeds a second, so much of it until they are right again."""
    pace = Pace()
    for tick in range(round(10 * seconds)):
        speed_mps = 30.0 * (share if tick < 10 * back_s else 1.0)
        pace = pace.after(Measurement(tick * S // 10, 3.0 * tick, 4.0), (speed_mps,))
    return pace


def test_positions_that_run_belie_a_speed_that_is_far_less() -> None:
    assert shown_beside(0.5).belies
    assert not shown_beside(0.5, seconds=5.0).belies  # three spans of 2 s
    assert not shown_beside(0.75).belies  # within a fifth and 3 m/s
    assert not shown_beside(1.5).belies  # of what a sliding wheel shows the speed is more
    assert not shown_beside(0.5, back_s=8.0).belies
    nearly = shown_beside(0.5)
    for tick in range(120, 200):  # what would be within a fifth and 3 m/s does not clear it
        nearly = nearly.after(Measurement(tick * S // 10, 3.0 * tick, 4.0), (23.0,))
    assert nearly.belies
    measurement = measured(9.0, 15.0, 15.1)
    left, told = believed(measurement, shown_beside(0.5))
    assert left.speeds == ()
    assert left.speed_mps is None
    assert [event.outcome for event in told] == [Outcome.STUCK]
    assert believed(measurement, shown_beside(0.75)) == (measurement, ())


def test_one_position_far_off_does_not() -> None:
    places = np.zeros(41)
    for index in range(5, 36):
        off = places.copy()
        off[index] = 500.0
        assert not paced([*off]).runs
