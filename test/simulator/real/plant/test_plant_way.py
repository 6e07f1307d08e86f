# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The way: roughness, cleaning, patches and grades as they are drawn."""

import numpy as np
import pytest

from sim_node.real.plant import way
from sim_node.real.plant.train import Nominal
from sim_node.real.plant.way import LEVEL, Ground, Rail, along, patches, steady, undulating

A_TRAIN = Nominal("a train", 16, 400e3, 200.0, (0.0, 0.0, 0.0), 1.0)


def test_roughness_is_5_percent_over_100_m_and_other_on_another_day() -> None:
    rail = Rail(steady(0.1), level_std=0.0)
    logs = [
        np.log(way.draw(rail, LEVEL, 200.0, 50e3, np.random.default_rng(seed)).contact[:, 0] / 0.1)
        for seed in range(10)
    ]
    assert np.std(logs) == pytest.approx(0.05, rel=0.1)
    shifted = np.mean([np.mean(one[100:] * one[:-100]) for one in logs]) / np.mean(np.square(logs))
    assert shifted == pytest.approx(np.exp(-1.0), abs=0.06)
    assert abs(np.corrcoef(logs[0], logs[1])[0, 1]) < 0.2


def test_days_differ_by_the_level() -> None:
    rail = Rail(steady(0.04), level_std=0.13, roughness=0.0)
    levels = [way.draw(rail, LEVEL, 200.0, 100.0, np.random.default_rng(seed)).contact[0, 0] for seed in range(300)]
    assert np.std(np.log(levels)) == pytest.approx(0.13 * 0.88, rel=0.1)  # cut at two standard deviations


def test_the_last_group_meets_more_than_the_first_and_the_mean_is_the_scenarios() -> None:
    factor = Rail(steady(0.1), cleaning=1.5).cleaned(16)
    assert factor[-1] / factor[0] == pytest.approx(1.5)
    assert factor.mean() == pytest.approx(1.0)
    assert np.diff(factor).min() > 0.0


def test_every_group_meets_its_own_place() -> None:
    rail = Rail(along((500.0, 0.3), (501.0, 0.04)), level_std=0.0, roughness=0.0)
    ground = Ground([way.draw(rail, LEVEL, 200.0, 1000.0, np.random.default_rng(0))], rail, A_TRAIN)
    front = 600.0
    met = ground.contact(np.array([[front]])).mu0[0]
    np.testing.assert_allclose(met, np.where(front - A_TRAIN.offsets() > 501.0, 0.04, 0.3), rtol=1e-9)


def test_patches_have_the_lengths_asked_for() -> None:
    place = np.arange(-200.0, 12e3)
    level = patches(0.1, 0.04, (300.0, 1000.0), (200.0, 800.0))(place, np.random.default_rng(1))
    borders = np.flatnonzero(np.diff(level))
    low = np.diff(borders)[level[borders[:-1] + 1] == 0.04]
    assert set(np.unique(level)) == {0.04, 0.1}
    assert low.size > 3
    assert 199 <= low.min() <= low.max() <= 801


def test_undulations_stay_within_their_height_and_the_grade_is_the_mean_under_the_train() -> None:
    drawn = way.draw(Rail(steady(0.1)), undulating(0.008), 200.0, 12e3, np.random.default_rng(3))
    assert 0.002 < np.abs(drawn.grade).max() < 0.008
    level = way.draw(Rail(steady(0.1)), along((1000.0, 0.0), (1001.0, 0.01)), 200.0, 3e3, np.random.default_rng(0))
    ground = Ground([level], Rail(steady(0.1)), A_TRAIN)
    assert ground.grade(np.array([[1100.0]])).item() == pytest.approx(0.005, rel=0.01)
    assert ground.grade(np.array([[1300.0]])).item() == pytest.approx(0.01)
