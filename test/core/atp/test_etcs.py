# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Supervision limits against closed forms, and against a simulated train that brakes when the limit is passed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from adhesion_node.core.atp import ceiling as etcs_ceiling
from adhesion_node.core.atp import limits as etcs
from adhesion_node.core.atp.config import SupervisionConfig
from adhesion_node.core.physics import braking
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.core.physics.train import CRH3, KMH, Array

PLAIN = SupervisionConfig(
    target_speed_kmh=0.0,
    emergency_build_up_s=2.0,
    service_build_up_s=3.0,
    traction_cut_off_s=0.0,
    acceleration_mps2=0.0,
    speed_margin_mps=0.0,
    position_margin_m=0.0,
    service_deceleration_mps2=5.0,
)
"""Only the times: every limit has a closed form."""


def constant(first_mps: float, deceleration_mps2: float, points: int = 64) -> BrakingCurve:
    speed = np.linspace(first_mps, 0.0, points)
    return BrakingCurve(
        distance_m=(first_mps**2 - speed**2) / (2 * deceleration_mps2),
        speed_mps=speed,
        deceleration_mps2=np.full_like(speed, deceleration_mps2),
        time_s=(first_mps - speed) / deceleration_mps2,
    )


def random_configs(count: int) -> Iterator[SupervisionConfig]:
    generator = np.random.default_rng(5)
    for _ in range(count):
        warning_s = generator.uniform(0, 4)
        yield SupervisionConfig(
            target_speed_kmh=float(generator.choice([0.0, generator.uniform(1, 200)])),
            line_speed_kmh=generator.uniform(200, 400),
            emergency_build_up_s=generator.uniform(0, 6),
            service_build_up_s=generator.uniform(0, 8),
            service_deceleration_mps2=generator.uniform(0.2, 1.2),
            traction_cut_off_s=generator.uniform(0, 15),
            warning_time_s=warning_s,
            driver_time_s=warning_s + generator.uniform(0, 4),
            acceleration_mps2=generator.uniform(0, 1),
            speed_margin_mps=generator.uniform(0, 3),
            position_margin_m=generator.uniform(0, 50),
        )


CONFIGS = tuple(random_configs(40))
CURVE = braking.curve(CRH3, 300 * KMH, 0.07)


def test_with_a_constant_deceleration_the_limits_have_a_closed_form() -> None:
    speed = np.array([0.0, 10.0, 40.0])
    limits = etcs.distances(PLAIN, constant(50.0, 0.8), speed)
    emergency = speed**2 / 1.6 + 2.0 * speed
    np.testing.assert_allclose(limits.ebi, emergency, atol=1e-9)
    np.testing.assert_allclose(limits.sbi, emergency + 3.0 * speed, atol=1e-9)
    np.testing.assert_allclose(limits.warning, emergency + 5.0 * speed, atol=1e-9)
    np.testing.assert_allclose(limits.permitted, emergency + 7.0 * speed, atol=1e-9)
    # T_indication = max(0.8 * 3, 5) + 4 s
    np.testing.assert_allclose(limits.indication, emergency + 16.0 * speed, atol=1e-9)


def test_a_target_speed_is_met_with_the_ceiling_excess_at_the_target() -> None:
    config = replace(PLAIN, target_speed_kmh=72.0)  # 20 m/s; 7.5 km/h above it is 22.0833 m/s
    limits = etcs.distances(config, constant(50.0, 0.8), np.array([40.0]))
    assert limits.ebi[0] == pytest.approx((40.0**2 - (79.5 * KMH) ** 2) / 1.6 + 80.0)


def test_the_traction_that_outlasts_the_warning_and_the_acceleration_count() -> None:
    config = replace(
        PLAIN, traction_cut_off_s=6.0, emergency_build_up_s=3.0, acceleration_mps2=1.0, speed_margin_mps=0.5
    )
    # T_traction = 6 - (2 + 3) = 1 s at 1 m/s^2, then T_berem = 2 s at 0.4 m/s^2.
    assert (config.traction_s, config.coasting_s) == (1.0, 2.0)
    limits = etcs.distances(config, constant(50.0, 0.8), np.array([30.0]))
    assert limits.ebi[0] == pytest.approx((30.5 + 0.5) * 1.0 + (31.5 + 0.4) * 2.0 + 32.3**2 / 1.6)


def test_before_a_stop_a_weak_service_brake_intervenes_earlier() -> None:
    config = replace(PLAIN, service_deceleration_mps2=0.4, position_margin_m=7.0)
    limits = etcs.distances(config, constant(50.0, 0.8), np.array([40.0]))
    assert limits.sbi[0] == pytest.approx(1600 / 0.8 + 120.0 - 7.0)
    at_speed = etcs.distances(replace(config, target_speed_kmh=1.0), constant(50.0, 0.8), np.array([40.0]))
    assert at_speed.sbi[0] == pytest.approx(at_speed.ebi[0] + 120.0)


def run(speed_mps: float, config: SupervisionConfig, slowing: Callable[[float], float], until_mps: float) -> float:
    """Return how far a train runs after the emergency intervention, by small steps of time."""
    position, speed, time, step = 0.0, speed_mps + config.speed_margin_mps, 0.0, 1e-3
    traction_s = max(config.traction_cut_off_s - config.warning_time_s - config.service_build_up_s, 0.0)
    built_up_s = max(traction_s, config.emergency_build_up_s)
    while speed > until_mps or time < built_up_s:
        if time < traction_s:
            acceleration = config.acceleration_mps2
        elif time < built_up_s:
            acceleration = min(config.acceleration_mps2, 0.4)
        else:
            acceleration = -slowing(speed)
        position += speed * step + acceleration * step**2 / 2
        speed += acceleration * step
        time += step
    return position


def slowing(speed_mps: float) -> float:
    """Deceleration at mu = 0.07 by the paper's formulae: (2), (6) with v in km/h."""
    v = speed_mps * 3.6
    return 9.8 * (0.07 + 1e-3 * (0.79 + 0.0064 * v + 0.000115 * v**2))


@pytest.mark.parametrize("config", CONFIGS[:12])
def test_a_train_that_passes_the_limit_and_brakes_after_the_build_up_just_meets_the_target(
    config: SupervisionConfig,
) -> None:
    speed = max(50.0, config.target_speed_mps + 10.0)
    (needed,) = etcs.distances(config, CURVE, np.array([speed])).ebi
    foot = config.target_speed_mps + etcs_ceiling.EBI.above(config.target_speed_mps)
    ran = run(speed, config, slowing, foot)
    assert needed == pytest.approx(ran, abs=0.6)  # the steps, and the points of the curve


@pytest.mark.parametrize("config", CONFIGS)
def test_the_limits_are_in_order_at_every_distance_and_every_speed(config: SupervisionConfig) -> None:
    needed = etcs.distances(config, CURVE, np.linspace(0.0, 110.0, 400))
    allowed = etcs.speeds(config, CURVE, np.linspace(-500.0, 12_000.0, 2000))
    for closer, further in pairwise(needed):
        assert np.all(closer <= further)
    for higher, lower in pairwise(allowed):
        assert np.all(higher >= lower)
    for limit in (*needed, *allowed):
        assert np.all(np.diff(limit) >= -1e-9)
        assert np.all(np.isfinite(limit))


@pytest.mark.parametrize("config", CONFIGS)
def test_the_speed_of_a_limit_is_the_one_that_needs_the_distance(config: SupervisionConfig) -> None:
    speed = np.linspace(config.target_speed_mps + 5.0, config.line_speed_mps, 50)
    needed = etcs.distances(config, CURVE, speed)
    for place, name in zip(needed, etcs.Limits._fields, strict=True):
        found: Array = getattr(etcs.speeds(config, CURVE, place), name)
        np.testing.assert_allclose(found, speed, atol=5e-3)


def test_beyond_the_target_and_far_before_it_the_ceiling_limits_hold() -> None:
    config = SupervisionConfig(target_speed_kmh=100.0, line_speed_kmh=300.0)
    allowed = etcs.speeds(config, CURVE, np.array([-1.0, 1e6]))
    expected = {"ebi": (107.5, 315), "sbi": (105.5, 310), "warning": (104, 305), "permitted": (100, 300)}
    for name, kmh in expected.items():
        np.testing.assert_allclose(getattr(allowed, name) / KMH, kmh)


def test_before_a_stop_nothing_is_allowed_beyond_the_target() -> None:
    config = replace(PLAIN, line_speed_kmh=300.0)
    assert [float(limit[0]) for limit in etcs.speeds(config, CURVE, np.array([-0.1]))] == [0.0] * 5


@pytest.mark.parametrize("at", [31, 63])
def test_a_speed_above_the_curve_is_braked_at_its_weakest_deceleration(at: int) -> None:
    """Wherever on the curve it is weakest: 42 to 40 m/s at 0.5 m/s^2, less a share of 1/(40 + 10) for each m/s."""
    slowing = np.full(64, 0.8)
    slowing[at] = 0.5
    weak = replace(constant(40.0, 0.8), deceleration_mps2=slowing)
    (distance,) = etcs.distance_between(weak, np.array([42.0]), 10.0)
    # (1764 - 1600)/0.96, then the curve's (1600 - 100)/1.6 = 937.5 m
    assert distance == pytest.approx(170.83 + 937.5, abs=0.2)


def test_above_a_curve_that_falls_off_there_it_is_braked_by_its_weakest_less_what_it_falls_by() -> None:
    weak_at_the_top = replace(constant(40.0, 0.8), deceleration_mps2=np.linspace(0.5, 1.1, 64))
    # 0.6/40 less per m/s: 42 to 40 m/s at 0.47 m/s^2 in 174.5 m, then the curve's (1600 - 100)/1.6 = 937.5 m.
    (distance,) = etcs.distance_between(weak_at_the_top, np.array([42.0]), 10.0)
    assert distance == pytest.approx(174.47 + 937.5, abs=0.2)


def test_the_braking_distance_is_that_of_the_curve_begun_at_the_speed() -> None:
    part = braking.curve(CRH3, 60.0, 0.07, target_mps=20.0)
    (distance,) = etcs.distance_between(CURVE, np.array([60.0]), 20.0)
    assert distance == pytest.approx(part.distance_m[-1], rel=1e-4)


def test_a_curve_without_length_is_continued_upwards() -> None:
    flat = replace(constant(10.0, 0.8), speed_mps=np.full(64, 10.0), distance_m=np.zeros(64), time_s=np.zeros(64))
    # 11 to 10 m/s at 0.8 (1 - 1/20) m/s^2: 21/1.52 = 13.816 m.
    assert etcs.distance_between(flat, np.array([11.0]), 10.0)[0] == pytest.approx(13.816, abs=1e-3)


def test_the_service_curve_slows_no_better_than_the_emergency_brake() -> None:
    emergency = constant(50.0, 0.8)
    assert etcs.service_curve(emergency, 2.0).distance_m[-1] == pytest.approx(emergency.distance_m[-1])
    service = etcs.service_curve(emergency, 0.4)
    assert service.time_s == pytest.approx((50.0 - service.speed_mps) / 0.4)
    assert service.distance_m == pytest.approx((50.0**2 - service.speed_mps**2) / 0.8)  # of 0 where it begins


@pytest.mark.parametrize(
    ("kind", "speed_kmh", "above_kmh"),
    [
        (etcs_ceiling.WARNING, 100, 4.0),
        (etcs_ceiling.WARNING, 125, 4.5),
        (etcs_ceiling.WARNING, 300, 5.0),
        (etcs_ceiling.SBI, 80, 5.5),
        (etcs_ceiling.SBI, 160, 7.75),
        (etcs_ceiling.SBI, 300, 10.0),
        (etcs_ceiling.EBI, 0, 0.0),
    ],
)
def test_the_ceiling_excess_is_that_of_the_specification(
    kind: etcs_ceiling.Excess, speed_kmh: float, above_kmh: float
) -> None:
    assert kind.above(speed_kmh * KMH) / KMH == pytest.approx(above_kmh)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"target_position_m": float("nan")}, r"target_position_m = nan: give a value from -1e\+07 to 1e\+07 m"),
        ({"valid_for_s": -1.0}, r"valid_for_s = -1\.0: give a value from 0\.01 to 3600 s"),
        ({"target_speed_kmh": float("inf")}, r"target_speed_kmh = inf: give a value from 0 to 500 km/h"),
        ({"driver_time_s": 1.0}, r"driver_time_s = 1\.0: give at least warning_time_s = 2\.0"),
        ({"line_speed_kmh": 90.0}, r"line_speed_kmh = 90\.0: give at least target_speed_kmh = 100\.0"),
    ],
)
def test_settings_out_of_range_are_refused(values: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SupervisionConfig(**values)


@pytest.mark.parametrize("faster_mps", [0.0, 1.0, 5.0])
def test_above_its_first_speed_a_curve_is_braked_no_better_than_it_fades(faster_mps: float) -> None:
    """With a = 1/(1 + v/60) the way from v to a standstill is v^2/2 + v^3/180."""
    speed = np.linspace(60.0, 0.0, 64)
    way, slowing = speed**2 / 2.0 + speed**3 / 180.0, 1.0 / (1.0 + speed / 60.0)
    fading = BrakingCurve(way[0] - way, speed, slowing, np.linspace(0.0, 90.0, 64))
    wanted = 60.0 + faster_mps
    true_m = wanted**2 / 2.0 + wanted**3 / 180.0
    found_m = float(etcs.distance_between(fading, np.array([wanted]), 0.0)[0])
    assert true_m <= found_m + 1e-9 <= 1.01 * true_m


@pytest.mark.parametrize("knee_mps", [5.0, 20.0, 60.0])
def test_above_a_curve_that_the_brake_limits_the_rail_may_limit(knee_mps: float) -> None:
    """With a = min(1, (60 + knee)/(60 + v)) a curve that begins at the knee tells nothing of what is above."""
    faster = knee_mps + 5.0
    slower = 60.0 + knee_mps
    rail_m = (faster**2 - knee_mps**2) * 30.0 / slower + (faster**3 - knee_mps**3) / (3.0 * slower)
    found_m = float(etcs.distance_between(constant(knee_mps, 1.0), np.array([faster]), 0.0)[0])
    assert rail_m + knee_mps**2 / 2.0 <= found_m


@pytest.mark.parametrize("points", [2, 3, 5, 16, 64, 500])
@pytest.mark.parametrize("fading_mps", [15.0, 60.0, 1e9, -200.0])
def test_a_curve_of_few_points_needs_no_less_way_than_the_law_that_it_is_of(points: int, fading_mps: float) -> None:
    """With a = 1/(1 + v/v0), which falls or rises, from v to u on (v^2 - u^2)/2 + (v^3 - u^3)/(3 v0)."""

    def way_m(speed: np.ndarray) -> np.ndarray:
        return speed**2 / 2.0 + speed**3 / (3.0 * fading_mps)

    config = replace(PLAIN, emergency_build_up_s=0.0, traction_cut_off_s=0.0, target_speed_kmh=100.0)
    foot = np.array([107.5 * KMH])
    speed = np.linspace(80.0, 0.0, points)
    curve = BrakingCurve(way_m(speed[:1]) - way_m(speed), speed, 1.0 / (1.0 + speed / fading_mps), 80.0 - speed)
    wanted = np.linspace(30.0, 80.0, 300)
    true_m, found_m = way_m(wanted) - way_m(foot), etcs.distances(config, curve, wanted).ebi
    assert (found_m >= true_m - 1e-6).all()
    if points >= 64:
        assert (found_m <= true_m + 5.0).all()


def test_a_curve_that_falls_off_steeply_keeps_a_quarter_of_its_weakest_deceleration() -> None:
    steep = constant(60.0, 0.8)
    steep.deceleration_mps2[0] = 0.4
    found_m = etcs.distance_between(steep, np.array([60.0, 65.0]), 0.0)
    assert float(found_m[1] - found_m[0]) == pytest.approx((65.0**2 - 60.0**2) / (2.0 * 0.1))
