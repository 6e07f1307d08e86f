# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Forces of the train, (1)-(6): every number is worked out by hand from Table 1 or stands in model.md."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from adhesion_node.core.physics.adhesion import WET
from adhesion_node.core.physics.train import CRH3, GRAVITY, KMH, Train

V300 = np.array(300 / 3.6)


def test_table_1_of_the_paper() -> None:
    assert (CRH3.mass_kg, CRH3.cylinder_diameter_m, CRH3.full_pressure_pa) == (536_000, 0.203, 410_000)
    assert (CRH3.rigging_efficiency, CRH3.rigging_ratio, CRH3.pad_friction) == (0.85, 2.55, 0.28)
    assert (CRH3.disc_radius_m, CRH3.wheel_radius_m, CRH3.pads) == (0.2976, 0.46, 96)
    assert (CRH3.resistance_c0, CRH3.resistance_c1, CRH3.resistance_c2) == (0.79, 0.0064, 0.000115)
    assert CRH3.rotating_mass_fraction == 0.0
    assert (GRAVITY, KMH) == (9.8, 1 / 3.6)


def test_equation_1_adhesion_force() -> None:
    # 0.0726 x 536 000 kg x 9.8 m/s2 = 381 353.28 N
    assert CRH3.adhesion_force(0.0726) == pytest.approx(381_353.28, rel=1e-9)


def test_equation_4_brake_force() -> None:
    # piston: pi/4 x 0.203^2 = 0.03236547 m2; x 410 000 Pa = 13 269.84 N; x 0.2976/0.46 = 8 585.01 N;
    # x 0.85 x 2.55 x 0.28 = 0.6069 -> 5 210.24 N per pad; x 96 = 500 183 N
    assert CRH3.brake_force(410e3) == pytest.approx(500_183, rel=2e-5)
    assert CRH3.brake_force(410e3) / CRH3.mass_kg == pytest.approx(0.9332, abs=5e-5)  # model.md
    assert CRH3.brake_force(205e3) == pytest.approx(CRH3.brake_force(410e3) / 2)
    assert CRH3.brake_force(0.0) == 0.0


def test_brake_per_weight() -> None:
    assert CRH3.specific_brake(410e3) == pytest.approx(0.0952, abs=5e-5)  # model.md: B/(M g)


@pytest.mark.parametrize(
    ("kmh", "per_mille"),
    # 0.79 + 0.0064 v + 0.000115 v^2: 300: 0.79 + 1.92 + 10.35; 100: 0.79 + 0.64 + 1.15; 0: 0.79
    [(300.0, 13.06), (100.0, 2.58), (0.0, 0.79)],
)
def test_equation_6_running_resistance(kmh: float, per_mille: float) -> None:
    speed = np.array(kmh / 3.6)
    assert float(CRH3.specific_resistance(speed)) == pytest.approx(per_mille * 1e-3, rel=1e-12)


def test_cases_2_and_3_the_smaller_force_acts() -> None:
    r = CRH3.specific_resistance(V300)
    # adhesion: 9.8 x (0.0726 + 0.01306) = 0.839468; brake: 9.8 x (0.09 + 0.01306) = 1.009988
    assert float(CRH3.deceleration(0.0726, 0.09, r)) == pytest.approx(0.839468, rel=1e-9)
    assert float(CRH3.deceleration(0.1432, 0.09, r)) == pytest.approx(1.009988, rel=1e-9)
    assert CRH3.used_adhesion(np.array([0.05, 0.09, 0.2]), 0.09, r).tolist() == [0.05, 0.09, 0.09]


def test_one_speed_gives_as_a_number_what_it_gives_as_an_array() -> None:
    train, speeds = replace(CRH3, rotating_mass_fraction=0.08), [-1.0, 0.0, 30.3, 81.7]
    for mu in (0.05, 0.2):
        resistance = train.specific_resistance(np.array(speeds))
        numbers = [train.deceleration(mu, 0.09, train.specific_resistance(v)) for v in speeds]
        assert numbers == train.deceleration(mu, 0.09, resistance).tolist()
        assert all(type(each) is float for each in numbers)
    assert [WET(v) for v in speeds] == WET(np.array(speeds)).tolist()


def test_slope_of_the_resistance_by_finite_differences() -> None:
    speeds, h = np.linspace(0.0, 100.0, 50), 1e-2
    rise = (CRH3.specific_resistance(speeds + h) - CRH3.specific_resistance(speeds - h)) / (2.0 * h)
    assert CRH3.resistance_slope(speeds) == pytest.approx(rise, rel=1e-9)


def test_rotating_masses_slow_the_brake_limited_train_alone() -> None:
    train, b, r = replace(CRH3, rotating_mass_fraction=0.1), 0.0952, np.array(0.01306)
    # brake-limited: M (1 + rho) a = B + R: a = 9.8 x (0.0952 + 0.01306)/1.1 = 0.964498
    assert float(train.deceleration(0.5, b, r)) == pytest.approx(0.9644981818, rel=1e-9)
    # adhesion-limited: M a = F + R: a = 9.8 x (0.05 + 0.01306) = 0.617988
    assert float(train.deceleration(0.05, b, r)) == pytest.approx(0.617988, rel=1e-9)


def test_rotating_masses_leave_no_step_at_the_kink() -> None:
    train, b, r = replace(CRH3, rotating_mass_fraction=0.1), 0.0952, np.array(0.01306)
    kink = (0.0952 - 0.1 * 0.01306) / 1.1  # where (F + R)/M = (B + R)/(M (1 + rho))
    assert float(train.used_adhesion(math.inf, b, r)) == pytest.approx(kink, rel=1e-12)
    below, above = (float(train.deceleration(kink + e, b, r)) for e in (-1e-9, 1e-9))
    assert 0.0 < above - below < 1e-8
    assert float(train.deceleration(kink + 0.01, b, r)) == above


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass_kg": -1.0}, r"train\.mass_kg = -1\.0: give a value from"),
        ({"mass_kg": math.nan}, r"train\.mass_kg = nan: give a value from"),
        ({"pads": 9.5}, r"train\.pads = 9\.5: give a value of type int"),
        ({"rotating_mass_fraction": 2.0}, r"train\.rotating_mass_fraction = 2\.0: give a value from 0 to 1"),
        ({"wheel_radius_m": "big"}, r"train\.wheel_radius_m = 'big': give a value of type float"),
    ],
)
def test_refuses_a_constant_out_of_range(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(CRH3, **changes)


def test_takes_whole_numbers_for_real_constants() -> None:
    assert Train(mass_kg=500_000).brake_force(410_000) == CRH3.brake_force(410e3)
