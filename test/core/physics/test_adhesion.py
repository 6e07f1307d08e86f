# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Adhesion laws against the table of model.md."""

from __future__ import annotations

import math

import numpy as np
import pytest

from adhesion_node.core.physics.adhesion import DRY, LAWS, SNOW, WET, SpeedLaw
from adhesion_node.core.physics.train import CRH3


@pytest.mark.parametrize(
    ("law", "kmh", "mu"),
    [
        (DRY, 300.0, 0.1432),  # 0.06 + 46.6/560
        (DRY, 250.0, 0.1514),
        (WET, 300.0, 0.0726),  # 0.04 + 13.7/420
        (WET, 250.0, 0.0770),
        (WET, 100.0, 0.1023),
        (WET, 50.0, 0.1206),
        (WET, 0.0, 0.1542),
    ],
)
def test_laws_at_the_checked_speeds(law: SpeedLaw, kmh: float, mu: float) -> None:
    assert float(law(np.array(kmh / 3.6))) == pytest.approx(mu, abs=5e-5)


def test_wet_rail_hides_its_adhesion_below_128_kmh() -> None:
    # model.md: below 128 km/h F >= B, 0.04 + 13.7/(120 + v) = 0.0952
    limit = CRH3.specific_brake(410e3)
    assert float(WET(np.array(127.5 / 3.6))) > limit > float(WET(np.array(128.5 / 3.6)))


def test_scale_is_a_factor_and_shape_is_kept() -> None:
    speeds = np.array([[0.0, 30.0], [60.0, 90.0]])
    leaves = SpeedLaw(WET.floor, WET.gain_kmh, WET.offset_kmh, 0.45)
    assert leaves(speeds) == pytest.approx(0.45 * WET(speeds))
    assert SpeedLaw(0.07)(speeds).tolist() == [[0.07, 0.07], [0.07, 0.07]]


def test_laws_fall_with_speed_and_are_ordered() -> None:
    speeds = np.linspace(0.0, 100.0, 101)
    for law in LAWS.values():
        assert np.all(np.diff(law(speeds)) < 0)
    assert np.all((DRY(speeds) > WET(speeds)) & (WET(speeds) > SNOW(speeds)))
    assert float(WET(np.array(-5.0))) == float(WET(np.array(0.0)))  # noise around standstill


@pytest.mark.parametrize("law", [*LAWS.values(), SpeedLaw(0.04, 13.7, 120.0, 0.45), SpeedLaw(0.07)])
def test_slope_by_finite_differences(law: SpeedLaw) -> None:
    speeds, h = np.linspace(0.5, 100.0, 50), 1e-4
    assert law.slope(speeds) == pytest.approx((law(speeds + h) - law(speeds - h)) / (2.0 * h), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize(
    ("coefficients", "message"),
    [
        ((-0.1,), r"adhesion law floor = -0\.1: give a finite number of at least 0\.0"),
        ((0.04, math.inf), "adhesion law gain_kmh = inf"),
        ((0.04, 13.7, 0.0), r"adhesion law offset_kmh = 0\.0"),
        ((0.04, 13.7, 120.0, 0.0), r"adhesion law scale = 0\.0"),
    ],
)
def test_refuses_a_law_without_adhesion(coefficients: tuple[float, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SpeedLaw(*coefficients)
