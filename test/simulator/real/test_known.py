# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What an estimator is told of a real train: the same forces as in the train's papers."""

import numpy as np
import pytest

from adhesion_node.core.physics.train import GRAVITY
from adhesion_node.wire.settings.setup import setup_of
from sim_node.real import known
from sim_node.real.plant.scenarios import SCENARIOS
from sim_node.real.sensors.fitted import FITTED


@pytest.mark.parametrize("name", SCENARIOS)
def test_brake_mass_and_resistance_are_those_of_the_papers(name: str) -> None:
    nominal, train = SCENARIOS[name].nominal, known.train(SCENARIOS[name])
    assert train.brake_force(nominal.full_pa) == pytest.approx(nominal.brake_n)
    heavier = train.mass_kg * (1.0 + train.rotating_mass_fraction)
    assert train.brake_force(nominal.full_pa) / heavier == pytest.approx(nominal.deceleration_mps2)
    c0, c1, c2 = nominal.resistance
    assert train.specific_resistance(30.0) * train.mass_kg * GRAVITY == pytest.approx(c0 + 30.0 * c1 + 900.0 * c2)


@pytest.mark.parametrize("name", ["leaves", "downhill_leaves", "tram_dry"])
def test_parameters_make_the_same_train_and_track(name: str) -> None:
    setup = setup_of(known.parameters(SCENARIOS[name], FITTED["full"]))
    assert setup.config.train == known.train(SCENARIOS[name])
    assert setup.config.track == known.track(SCENARIOS[name])
    assert setup.config.speed_source == "doppler"
    assert setup.config.assumed_pressure_pa == SCENARIOS[name].nominal.full_pa


def test_a_known_grade_has_its_slope() -> None:
    slope = known.track(SCENARIOS["downhill_leaves"]).specific_resistance(np.array([0.0, 5000.0]))
    assert slope == pytest.approx([-0.008, -0.008])
