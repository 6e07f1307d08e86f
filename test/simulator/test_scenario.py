# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The scenarios: where the rail changes, how the brake builds up, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from adhesion_node.core.physics.adhesion import DRY, WET
from adhesion_node.core.physics.track import LEVEL, Tunnel
from adhesion_node.core.physics.train import CRH3, GRAVITY, KMH
from sim_node.train.plant import NO_NOISE, advance, simulate
from sim_node.train.scenario import CRUISE_S, SCENARIOS, Brake, Rail, Scenario, braking_place, find

OPEN_LINE = (*("constant_adhesion", "snow", "scaled_wet", "weak_brake", "grade_unknown", "overweight", "long_braking"),)
BEFORE = ("tunnel_entry", "tunnel_exit", "cruise", "dry_braking", "low_adhesion_patch")
NAMES = (*BEFORE, *OPEN_LINE[:-1], "approach", OPEN_LINE[-1])


def test_every_scenario_is_found_by_its_name() -> None:
    assert tuple(SCENARIOS) == NAMES
    assert all(find(name).name == name for name in NAMES)


def test_an_unknown_scenario_is_named_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match=r"scenario = 'tunel': give one of tunnel_entry, .*low_adhesion_patch, .*"):
        find("tunel")


@pytest.mark.parametrize(
    ("name", "speed_kmh", "before", "after"),
    [("tunnel_entry", 300, 0.1432, 0.0726), ("tunnel_exit", 250, 0.1514, 0.0770)],
)
def test_adhesion_drops_where_the_braking_starts(name: str, speed_kmh: float, before: float, after: float) -> None:
    scenario = find(name)
    speed = speed_kmh * KMH
    place = scenario.speed_mps * scenario.brake.start_s
    sample = 0.1 * speed
    assert scenario.speed_mps == pytest.approx(speed)
    assert scenario.rail.mu(place - sample, speed) == pytest.approx(before, abs=5e-5)
    assert scenario.rail.mu(place, speed) == pytest.approx(after, abs=5e-5)


def test_adhesion_recovers_as_the_train_slows() -> None:
    """The published end of Fig. 12: 0.1206 at 50 km/h."""
    scenario = find("tunnel_exit")
    assert scenario.end_speed_mps == pytest.approx(50 * KMH)
    assert scenario.rail.mu(4000.0, 50 * KMH) == pytest.approx(0.1206, abs=5e-5)


def test_tunnel_of_the_entry_barely_brakes() -> None:
    """The estimator takes the line as level: what it does not know must stay below 1 % of the braking."""
    scenario = find("tunnel_entry")
    (tunnel,) = scenario.track.sections
    assert isinstance(tunnel, Tunnel)
    resistance = 0.00013e-3 * (tunnel.end_m - tunnel.start_m)
    assert resistance == pytest.approx(0.000468)
    assert scenario.track.specific_resistance(np.array(tunnel.start_m + 1.0)) == pytest.approx(resistance)
    assert resistance * GRAVITY < 0.01 * 0.0726 * GRAVITY
    assert tunnel.start_m == braking_place(scenario.speed_mps)


def test_patch_is_a_kilometre_of_0_45_wet() -> None:
    scenario = find("low_adhesion_patch")
    start = braking_place(scenario.speed_mps) + 500.0
    speed = 200 * KMH
    wet = 0.04 + 13.7 / 320
    seen = [scenario.rail.mu(start + at, speed) / wet for at in (-1.0, 0.0, 999.0, 1000.0)]
    assert seen == pytest.approx([1.0, 0.45, 0.45, 1.0])


@pytest.mark.parametrize("name", OPEN_LINE)
def test_open_line_scenarios_brake_from_300_to_100_km_h(name: str) -> None:
    truths = list(simulate(find(name), 0.1, np.random.default_rng(0), NO_NOISE))
    assert truths[0].speed_mps == pytest.approx(300 * KMH)
    assert truths[-1].speed_mps < 100 * KMH
    assert {truth.regime for truth in truths if truth.t_ns < CRUISE_S * 1e9} == {"COASTING"}


@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("constant_adhesion", lambda kmh: 0.07),
        ("snow", lambda kmh: 0.03 + 8 / (130 + kmh)),
        ("scaled_wet", lambda kmh: 0.8 * (0.04 + 13.7 / (120 + kmh))),
    ],
)
def test_rail_of_the_open_line(name: str, law: Callable[[float], float]) -> None:
    speeds = (300.0, 200.0, 100.0)
    assert [find(name).rail.mu(5e3, kmh * KMH) for kmh in speeds] == pytest.approx([law(kmh) for kmh in speeds])


def _slowing(scenario: Scenario, speed_mps: float) -> float:
    """Deceleration of the braking train, by the plant's own steps."""
    time_s, step_s = CRUISE_S + 5.0, 0.01
    return (speed_mps - advance(scenario, time_s, step_s, 3000.0, speed_mps)[1]) / step_s


def test_weak_brake_limits_although_its_pressure_would_not() -> None:
    scenario = find("weak_brake")
    promised = CRH3.specific_brake(scenario.brake.pressure_pa)
    assert promised > scenario.rail.mu(0.0, 300 * KMH)
    used = _slowing(scenario, 300 * KMH) / GRAVITY - 68602 / (CRH3.mass_kg * GRAVITY)
    assert used == pytest.approx(0.6 * promised, rel=1e-3)


def test_unknown_grade_takes_5_per_mille_off_the_braking() -> None:
    level = replace(find("grade_unknown"), track=LEVEL)
    assert _slowing(level, 80.0) - _slowing(find("grade_unknown"), 80.0) == pytest.approx(0.005 * GRAVITY, rel=1e-3)


def test_overweight_train_has_the_same_brakes() -> None:
    scenario = find("overweight")
    assert scenario.train.mass_kg == pytest.approx(1.1 * 536e3)
    assert scenario.train.brake_force(410e3) == CRH3.brake_force(410e3)


def test_long_braking_is_limited_by_the_adhesion_for_three_minutes() -> None:
    truths = simulate(find("long_braking"), 0.1, np.random.default_rng(0), NO_NOISE)
    assert sum(truth.regime == "ADHESION_LIMITED" for truth in truths) > 1800


def test_dry_rail_always_carries_the_full_brake() -> None:
    scenario = find("dry_braking")
    needed = scenario.train.brake_force(scenario.brake.pressure_pa) / (scenario.train.mass_kg * GRAVITY)
    assert needed == pytest.approx(0.0952, abs=5e-5)
    assert all(scenario.rail.mu(0.0, v * KMH) > needed for v in range(0, 301, 10))


def test_scenarios_of_the_paper_have_full_pressure_at_once() -> None:
    for name in ("tunnel_entry", "tunnel_exit"):
        brake = find(name).brake
        assert brake.gauge_pressure(math.nextafter(CRUISE_S, 0.0)) == 0.0
        assert brake.gauge_pressure(CRUISE_S) == 410e3


def test_no_brake_has_no_pressure() -> None:
    assert find("cruise").brake.gauge_pressure(1e9) == 0.0


def test_the_first_law_holds_before_its_position() -> None:
    rail = Rail(((10.0, DRY), (20.0, WET)))
    assert [rail.mu(at, 0.0) for at in (-5.0, 19.9, 20.0)] == pytest.approx(
        [0.06 + 46.6 / 260] * 2 + [0.04 + 13.7 / 120]
    )


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Rail(()), r"rail positions = \(\)"),
        (lambda: Rail(((5.0, DRY), (5.0, WET))), r"rail positions = \(5\.0, 5\.0\): .* increasing"),
        (lambda: Rail(((0.0, DRY), (math.nan, WET))), "rail positions"),
        (lambda: Brake(-1.0), r"brake start_s = -1\.0"),
        (lambda: Brake(math.nan), "brake start_s = nan"),
        (lambda: Brake(0.0, pressure_pa=math.inf), "brake pressure_pa = inf"),
        (lambda: Brake(0.0, build_up_s=-0.1), r"brake build_up_s = -0\.1"),
        (lambda: Scenario("x", 0.0, Rail(((0.0, DRY),)), 1.0), r"scenario x: speed_mps = 0\.0"),
        (lambda: Scenario("x", 1.0, Rail(((0.0, DRY),)), math.inf), "scenario x: end_s = inf"),
        (lambda: Scenario("x", 1.0, Rail(((0.0, DRY),)), 1.0, end_speed_mps=1.0), r"end_speed_mps = 1\.0"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make: object, message: str) -> None:
    assert callable(make)
    with pytest.raises(ValueError, match=message):
        make()
