# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The sensors: their noise laws, and that no setting of theirs changes the true run."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from sim_node.train.plant import Truth
from sim_node.train.run import run
from sim_node.train.scenario import find
from sim_node.train.sensors import Reading, SensorSettings, measure

TRUTH = Truth(5, 1000.0, 50.0, 0.1, 0.09, 410e3, "ADHESION_LIMITED")
SAMPLES = 20_000


def _readings(settings: SensorSettings, seed: int = 1) -> list[Reading]:
    rng = np.random.default_rng(seed)
    return [measure(TRUTH, settings, rng) for _ in range(SAMPLES)]


def _errors(settings: SensorSettings) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([r.position_m - 1000.0 for r in _readings(settings) if r.position_m is not None])


def test_position_noise_is_gaussian_of_its_std() -> None:
    errors = _errors(SensorSettings(position_std_m=0.5))
    assert errors.size == SAMPLES
    assert abs(errors.mean()) < 4 * 0.5 / math.sqrt(SAMPLES)
    assert errors.std() == pytest.approx(0.5, rel=4 / math.sqrt(2 * SAMPLES))
    assert np.mean(np.abs(errors) < 0.5) == pytest.approx(0.6827, abs=0.014)


def test_student_noise_has_the_quantiles_of_its_law() -> None:
    """Student's t with 2 degrees of freedom has F(x) = 1/2 + x / (2 sqrt(2 + x^2)), hence |x| < 1 in 0.5774."""
    scaled = np.abs(_errors(SensorSettings(position_std_m=0.5, student_dof=2.0))) / 0.5
    for bound in (1.0, 3.0, 10.0):
        share = bound / math.sqrt(2 + bound**2)
        assert np.mean(scaled < bound) == pytest.approx(share, abs=4 * math.sqrt(share * (1 - share) / SAMPLES))


def test_outliers_come_at_their_fraction_and_size_on_both_sides() -> None:
    errors = _errors(SensorSettings(outlier_fraction=0.05, outlier_size_m=20.0))
    outliers = errors[np.abs(errors) > 10.0]
    assert outliers.size / SAMPLES == pytest.approx(0.05, abs=4 * math.sqrt(0.05 * 0.95 / SAMPLES))
    assert np.abs(outliers).mean() == pytest.approx(20.0, abs=0.1)
    assert np.mean(outliers > 0) == pytest.approx(0.5, abs=0.07)


def test_dropouts_lose_positions_at_their_fraction_and_nothing_else() -> None:
    readings = _readings(SensorSettings(dropout_fraction=0.3, speed_std_mps=0.1))
    missing = sum(r.position_m is None for r in readings)
    assert missing / SAMPLES == pytest.approx(0.3, abs=4 * math.sqrt(0.3 * 0.7 / SAMPLES))
    assert all(r.speed_mps is not None for r in readings)


def test_pressure_is_absolute_and_exact_without_noise() -> None:
    reading = _readings(SensorSettings())[0]
    assert reading.pressure_pa == 410e3 + 101325.0
    assert reading.t_ns == 5


def test_pressure_noise_has_its_std() -> None:
    pressures = np.array([r.pressure_pa for r in _readings(SensorSettings(pressure_std_pa=2e3))])
    assert pressures.mean() == pytest.approx(511325.0, abs=4 * 2e3 / math.sqrt(SAMPLES))
    assert pressures.std() == pytest.approx(2e3, rel=4 / math.sqrt(2 * SAMPLES))


def test_there_is_no_odometer_unless_asked_for() -> None:
    assert all(r.speed_mps is None for r in _readings(SensorSettings()))
    speeds = np.array([r.speed_mps for r in _readings(SensorSettings(speed_std_mps=0.2))], dtype=np.float64)
    assert speeds.mean() == pytest.approx(50.0, abs=4 * 0.2 / math.sqrt(SAMPLES))
    assert speeds.std() == pytest.approx(0.2, rel=4 / math.sqrt(2 * SAMPLES))


CHANGES = [
    {"position_std_m": 2.0},
    {"student_dof": 3.0},
    {"outlier_fraction": 0.1},
    {"outlier_fraction": 0.1, "outlier_size_m": 5.0},
    {"dropout_fraction": 0.3},
    {"pressure_std_pa": 1e3},
    {"speed_std_mps": 0.1},
    {"wheel_speed_std_radps": 0.1},
]


@pytest.mark.parametrize("change", CHANGES, ids=str)
def test_no_sensor_setting_changes_the_true_run(change: dict[str, float]) -> None:
    nominal = list(run(find("tunnel_entry"), 0.5, seed=3))
    changed = list(run(find("tunnel_entry"), 0.5, seed=3, settings=SensorSettings(**change)))
    assert [truth for truth, _ in changed] == [truth for truth, _ in nominal]
    if change != CHANGES[3]:
        assert [reading for _, reading in changed] != [reading for _, reading in nominal]


def test_plant_and_sensors_do_not_draw_the_same_numbers() -> None:
    """The first number of each stream, in standard deviations, is another for every seed."""
    cruise = find("cruise")
    for seed in range(5):
        (first, reading), (second, _) = islice(run(cruise, 0.1, seed), 2)
        assert reading.position_m is not None
        of_plant = (second.position_m - first.position_m - cruise.speed_mps * 0.1) / 0.02
        of_sensor = (reading.position_m - first.position_m) / 0.5
        assert of_plant != pytest.approx(of_sensor, abs=1e-6)


def test_extras_come_on_top_of_the_same_noise() -> None:
    plain = _readings(SensorSettings())
    extras = SensorSettings(outlier_fraction=0.1, dropout_fraction=0.1, pressure_std_pa=1e3, speed_std_mps=0.1)
    pairs = [(a.position_m, b.position_m) for a, b in zip(plain, _readings(extras), strict=True)]
    differences = {round(b - a, 6) for a, b in pairs if a is not None and b is not None}
    assert differences == {-20.0, 0.0, 20.0}


def test_the_same_seed_gives_the_same_run_and_another_seed_another() -> None:
    settings = SensorSettings(outlier_fraction=0.05, student_dof=4.0, speed_std_mps=0.1)
    first, again, other = (list(run(find("tunnel_exit"), 0.5, seed, settings)) for seed in (7, 7, 8))
    assert first == again
    assert first[1][0] != other[1][0]
    assert first[0][1] != other[0][1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"position_std_m": 0.0}, r"sensor position_std_m = 0\.0: give a value from 0\.001"),
        ({"position_std_m": -1.0}, r"sensor position_std_m = -1\.0"),
        ({"speed_std_mps": math.nan}, "sensor speed_std_mps = nan"),
        ({"wheel_speed_std_radps": -0.1}, r"sensor wheel_speed_std_radps = -0\.1"),
        ({"pressure_std_pa": math.inf}, "sensor pressure_std_pa = inf"),
        ({"student_dof": 0.5}, r"sensor student_dof = 0\.5: give 0 \(Gaussian\) or at least 1"),
        ({"outlier_fraction": 1.1}, r"sensor outlier_fraction = 1\.1: give a value from 0 to 1"),
        ({"dropout_fraction": 2.0}, r"sensor dropout_fraction = 2\.0: give a value from 0 to 1"),
    ],
)
def test_settings_out_of_range_are_refused_by_name(change: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(SensorSettings(), **change)
