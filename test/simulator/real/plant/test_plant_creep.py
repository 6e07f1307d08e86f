# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The creep curve: Polach's equations by hand, its slope by differences, its peak by a search."""

import numpy as np
import pytest

from sim_node.real.plant import creep
from sim_node.real.plant.creep import Contact, adhesion, contact, peak
from sim_node.real.plant.journey import Array


def test_a_point_of_the_curve_by_hand() -> None:
    """mu0 = 0.1, 20 m/s, 1 m/s of sliding: e = 47.12, 0.3 e = 14.137, 0.1 e = 4.712."""
    rail = Contact(*(np.array([value]) for value in (0.1, 0.3, 0.1, 0.5, 0.15)))
    friction = 0.1 * (0.5 * np.exp(-0.15) + 0.5)
    expected = friction * 2 / np.pi * (14.1372 / (1 + 14.1372**2) + np.arctan(4.71239))
    assert adhesion(np.array([1.0]), np.array([20.0]), rail)[0][0] == pytest.approx(expected, rel=1e-4)


def test_the_conditions_are_those_of_the_literature() -> None:
    """Polach 2005: dry k_A = 1, k_S = 0.4, A = 0.4, B = 0.6; wet k_A = 0.3, k_S = 0.1, A = 0.4 to 0.5."""
    for mu0, shape in ((0.3, (1.0, 0.4, 0.4, 0.6)), (0.1, (0.3, 0.1, 0.5, 0.15)), (0.03, (0.3, 0.1, 0.85, 0.1))):
        assert tuple(float(value) for value in contact(np.array(mu0))[1:]) == pytest.approx(shape)


def test_a_dry_wheel_rolls_with_kalkers_stiffness() -> None:
    """k_A + k_S = 1.4 of 2."""
    rail = contact(np.array(0.3))
    slope = adhesion(np.array(0.0), np.array(20.0), rail)[1] * 20.0
    assert float(slope) == pytest.approx(creep.KALKER_SLOPE * 0.7)


@pytest.mark.parametrize("mu0", [0.02, 0.06, 0.1, 0.2, 0.4])
def test_the_slope_is_the_forces_derivative(mu0: float) -> None:
    sliding, speed = np.linspace(-5.0, 15.0, 401) + 0.0123, np.array(17.0)
    rail = contact(np.array(mu0))
    force: Array = adhesion(sliding + 1e-6, speed, rail)[0] - adhesion(sliding - 1e-6, speed, rail)[0]
    np.testing.assert_allclose(adhesion(sliding, speed, rail)[1], force / 2e-6, rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize("mu0", [0.02, 0.043, 0.1, 0.2, 0.33])
@pytest.mark.parametrize("speed", [3.0, 17.0, 50.0, 83.0])
def test_the_peak_is_the_curves_greatest_value(mu0: float, speed: float) -> None:
    rail = contact(np.array(mu0))

    shares = np.geomspace(1e-4, 1.0, 100_000)
    curve = adhesion(shares * speed, np.array(speed), rail)[0]
    height, place = peak(np.array(speed), rail)
    assert float(height) == pytest.approx(curve.max(), rel=5e-4)
    assert float(place) == pytest.approx(shares[curve.argmax()], rel=0.02)
