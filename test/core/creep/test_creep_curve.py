# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Creep, adhesion, Kiencke's curve and its linear form: numbers worked by hand, derivatives, what noise adds."""

from __future__ import annotations

import numpy as np
import pytest

from adhesion_node.core.creep.curve import (
    adhesion,
    creep,
    creep_speed,
    noise_products,
    parameters,
    peak,
    peak_jacobian,
    regression,
    used_adhesion,
)

DRY = np.array([20 / 0.35 - 20, 100.0])


def test_the_equations_by_hand() -> None:
    assert creep_speed(16.8, 10.0, 0.625) == pytest.approx(0.5)  # (1): 10.5 - 10
    assert creep(16.8, 10.0, 0.625) == pytest.approx(0.05)  # (2): 0.5/10
    assert used_adhesion(73_500.0, 25_000.0) == pytest.approx(0.3)  # (3): 73.5 kN on 25 t
    assert adhesion(np.array(0.05), 20.0, np.array([80.0, 100.0])) == pytest.approx(1.0 / 5.25)  # (4)
    assert np.array(peak(20.0, np.array([30.0, 25.0]))) == pytest.approx([0.5, 0.2])  # (5): 20/(30 + 10), 1/5
    assert regression(np.array(0.05), np.array(0.2), 20.0) == pytest.approx([0.8, 0.01, 0.0005])  # (6), (7)


def test_the_linear_form_holds_on_the_curve() -> None:
    creeps = np.linspace(0.0, 0.2, 50)
    z, u1, u2 = regression(creeps, adhesion(creeps, 20.0, DRY), 20.0).T
    assert z == pytest.approx(DRY[0] * u1 + DRY[1] * u2, abs=1e-14)


@pytest.mark.parametrize(("mu_max", "lambda_m"), [(0.35, 0.1), (0.2, 0.1), (0.1, 0.05)])
def test_the_peak_is_the_largest_value_of_the_curve(mu_max: float, lambda_m: float) -> None:
    creeps = np.linspace(0.0, 0.5, 50_001)
    values = adhesion(creeps, 20.0, parameters(20.0, mu_max, lambda_m))
    assert values.max() == pytest.approx(mu_max, rel=1e-9)
    assert creeps[values.argmax()] == pytest.approx(lambda_m, abs=1e-5)


def test_a_curve_that_hardly_bends_has_a_high_and_far_peak_and_one_that_does_not_bend_none() -> None:
    assert np.array(peak(20.0, np.array([0.3, 0.01]))) == pytest.approx([40.0, 10.0])
    assert min(peak(20.0, np.zeros(2))) > 1e9


def test_the_initial_slope_is_the_known_one() -> None:
    assert adhesion(np.array(1e-9), 20.0, DRY) / 1e-9 == pytest.approx(20.0, rel=1e-6)


def test_a_peak_that_no_curve_has_is_refused() -> None:
    with pytest.raises(ValueError, match=r"mu_max = 1.2: with slope 20 and lambda_m 0.1 give at most 1"):
        parameters(20.0, 1.2, 0.1)


def test_the_derivatives_of_the_peak_are_those_of_finite_differences() -> None:
    ours = peak_jacobian(20.0, DRY)
    for column in range(2):
        step = np.zeros(2)
        step[column] = 1e-4
        upper, lower = np.array(peak(20.0, DRY + step)), np.array(peak(20.0, DRY - step))
        assert ours[:, column] == pytest.approx((upper - lower) / 2e-4, rel=1e-6, abs=1e-12)


def test_the_derivatives_of_many_peaks_are_those_of_each() -> None:
    thetas = np.array([[DRY, 2.0 * DRY, 3.0 * DRY], [4.0 * DRY, 5.0 * DRY, 6.0 * DRY]])
    each = [[peak_jacobian(20.0, theta) for theta in row] for row in thetas]
    np.testing.assert_allclose(peak_jacobian(20.0, thetas), each, rtol=1e-14)  # many may round otherwise than one


def test_what_noise_adds_to_the_products_is_what_many_draws_show() -> None:
    rng = np.random.default_rng(0)
    creep_std, mu_std, draws = 0.002, 0.01, 2_000_000
    true = np.array(0.03), np.array(0.27)
    rows = regression(
        true[0] + creep_std * rng.standard_normal(draws), true[1] + mu_std * rng.standard_normal(draws), 20.0
    )
    exact = regression(*true, 20.0)
    seen = rows.T @ rows / draws - np.outer(exact, exact)
    expected = noise_products(*true, 20.0, np.array(creep_std**2), np.array(mu_std**2))
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert seen / scale == pytest.approx(expected / scale, abs=0.02)
