# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Positions in coarse steps, as an odometer's of whole metres: no receiver that wanders, and no wheel that slides."""

from __future__ import annotations

from operator import attrgetter

import numpy as np
import pytest
from banks import FULL_PA, S

from adhesion_node.core import Config, Outcome, PositionSample, PressureSample
from adhesion_node.core.bank.sensors.coarse import SURE, Coarse
from adhesion_node.run.pipeline import Pipeline


def seen(positions: list[float]) -> Coarse:
    coarse = Coarse()
    for position in positions:
        coarse = coarse.after(position)
    return coarse


@pytest.mark.parametrize("step_m", [0.25, 0.3048, 1.0, 2.0, 3.048, 7.0, 10.0, 100.58])
@pytest.mark.parametrize("origin_m", [0.0, 12345.678])
def test_the_coarsest_step_that_all_fit_is_found(step_m: float, origin_m: float) -> None:
    positions = origin_m + step_m * np.cumsum(np.random.default_rng(2).integers(1, 8, 100))
    assert seen(positions.tolist()).std_m == pytest.approx(0.5 * step_m)
    assert seen(positions[:SURE].tolist()).std_m == 0.0
    assert seen([*positions.tolist(), positions[-1] + 0.37 * step_m]).std_m < 0.2 * step_m


@pytest.mark.parametrize("step_m", [0.001, 0.01, 0.1])
def test_fine_positions_are_not_coarse(step_m: float) -> None:
    rng = np.random.default_rng(3)
    positions = step_m * np.round((5.0 * np.arange(300) + 0.1 * rng.standard_normal(300)) / step_m)
    assert seen(positions.tolist()).std_m == 0.0


@pytest.mark.parametrize(("way_m", "std_m"), [(4.73, 0.0), (5.0, 2.5), (4.5, 0.25)])
def test_a_steady_train_moves_by_one_length_which_is_no_step_of_its_positions(way_m: float, std_m: float) -> None:
    """But where it is a usual one."""
    assert seen([way_m * index for index in range(2 * SURE)]).std_m == std_m


@pytest.mark.parametrize("speed", [20.0, 50.0, 50.3])
@pytest.mark.parametrize("step_m", [1.0, 3.048, 5.0])
@pytest.mark.parametrize("whole", [np.round, np.floor])
def test_a_train_is_followed_by_an_odometer_of_whole_metres(step_m: float, speed: float, whole: np.ufunc) -> None:
    """60 s at a steady speed and a dry stop; it declares half a metre."""
    pipeline, place, rows = Pipeline(Config(method="bank"), 0), 0.0, []
    for index in range(1400):
        t_ns, braked = S + index * S // 10, index > 600
        slower = max(speed - 0.06 * braked, 0.0)
        place, speed = place + 0.05 * (speed + slower), slower
        for sample in (
            PressureSample(t_ns, 0.85 * FULL_PA * braked),
            PositionSample(t_ns, float(step_m * whole(place / step_m)), 0.25),
        ):
            estimates = map(attrgetter("estimate"), pipeline.push(sample))
            rows += [(speed, each.speed_mps - speed, each.speed_std_mps) for each in estimates]
    true, error, std = np.array(rows[20:]).T
    running = true > 3.0
    assert pipeline.state.counts.get(Outcome.SLIDING, 0) == 0
    assert np.sqrt(np.mean(error[running] ** 2)) < 0.15 * step_m + 0.2
    assert np.mean(np.abs(error[running]) < 3.0 * std[running]) > 0.97
