# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The second plant's runs, held against energy, published figures and themselves."""

from collections.abc import Mapping
from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import trapezoid

from sim_node.real.plant import train
from sim_node.real.plant.journey import GRAVITY, PERIOD_S, Journey
from sim_node.real.plant.scenarios import INTERCITY, KMH, SCENARIOS, Scenario
from sim_node.real.plant.simulate import STEP_S, pitch, simulate
from sim_node.real.plant.train import Nominal, Scatter
from sim_node.real.plant.validation import Figures, creep, figures

SEEDS = (100, 101, 102)
COARSE_SEED = 5
AS_THE_PAPERS_SAY = Scatter(mass_std=0.0, resistance_std=0.0, pads_std=0.0)


@cache
def runs(name: str) -> tuple[Journey, ...]:
    return simulate(SCENARIOS[name], SEEDS)


@cache
def coarse(name: str) -> Journey:
    """One run in steps of a period."""
    return simulate(SCENARIOS[name], [COARSE_SEED], step_s=PERIOD_S)[0]


def way(journey: Journey, to_kmh: float = 0.0) -> float:
    begin, end = np.searchsorted(journey.time_s, journey.full_from_s), np.argmax(journey.speed_mps <= to_kmh * KMH)
    return float(journey.position_m[end] - journey.position_m[begin])


def stopping_way(scenario: Scenario, kmh: float) -> float:
    journeys = simulate(replace(scenario, speed_mps=kmh * KMH, scatter=AS_THE_PAPERS_SAY), SEEDS)
    return float(np.mean([way(journey) for journey in journeys]))


def judged(name: str) -> Figures:
    table = [figures(journey, 4.0) for journey in runs(name)]
    return Figures(*np.mean(table, axis=0).tolist())


@pytest.mark.parametrize("name", ["tram_leaves", "metro_wet"])
def test_a_seed_gives_the_same_bits_beside_other_seeds(name: str) -> None:
    beside = simulate(SCENARIOS[name], [3, COARSE_SEED, 11], step_s=PERIOD_S)[1]
    for one, other in zip(coarse(name), beside, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_runs_from_a_cruise_to_4_s_of_standstill(name: str) -> None:
    scenario, journey = SCENARIOS[name], coarse(name)
    assert all(np.isfinite(values).all() for values in journey)
    shapes = {field: np.shape(getattr(journey, field)) for field in ("time_s", "cylinder_pa", "wheel_radps")}
    count = journey.time_s.size
    assert shapes == {
        "time_s": (count,),
        **dict.fromkeys(("cylinder_pa", "wheel_radps"), (count, journey.radius_m.size)),
    }
    cruise = journey.time_s <= scenario.demands[0][0]
    np.testing.assert_allclose(journey.speed_mps[cruise], scenario.speed_mps)
    stop = int(np.argmax(journey.speed_mps == 0.0))
    assert (count - 1 - stop) * PERIOD_S == pytest.approx(4.0)
    assert not journey.speed_mps[stop:].any()
    assert np.ptp(journey.position_m[stop:]) == 0.0
    assert journey.full_from_s < journey.time_s[stop]
    slides = journey.sliding[journey.speed_mps > 5.0].mean()
    assert (slides == 0.0) == ("dry" in name.split("_") or name == "freight_wet")
    for low, high, grade in scenario.known_grade:
        inside = (journey.position_m >= low) & (journey.position_m <= high)
        np.testing.assert_allclose(journey.grade[inside], grade)


@pytest.mark.parametrize(("kmh", "design_m"), [(100.0, 579.0), (120.0, 904.0)])
def test_a_multiple_unit_stops_within_the_design_distance(kmh: float, design_m: float) -> None:
    """One brake of 0.65 m/s^2 for both figures, which belong to two classes of trains: 6 % are left."""
    unit = replace(SCENARIOS["dry"], nominal=replace(INTERCITY, deceleration_mps2=0.65))
    assert stopping_way(unit, kmh) == pytest.approx(design_m, rel=0.06)


def test_a_freight_train_stops_within_the_design_distance() -> None:
    assert stopping_way(SCENARIOS["freight_dry"], 100.0) == pytest.approx(1730.0, rel=0.03)


def test_salisbury_tunnel_junction_2021() -> None:
    """RAIB: from 138 km/h, level, leaves; 84 to 90 km/h were left after about 1500 m + 220 m: 0.25 to 0.27 m/s^2."""
    journeys = simulate(SCENARIOS["salisbury"], range(8))
    slowed = [((138 * KMH) ** 2 - (87 * KMH) ** 2) / 2.0 / way(journey, 87.0) for journey in journeys]
    assert 0.245 < np.mean(slowed) < 0.275
    used = [journey.used[(journey.time_s > 14.0) & (journey.speed_mps > 24.0)].mean() for journey in journeys]
    assert 0.018 < np.mean(used) < 0.03


@pytest.mark.parametrize(
    ("name", "efficiency", "used"),
    [
        ("wet", (0.83, 0.92), (0.07, 0.10)),
        ("leaves", (0.83, 0.95), (0.03, 0.05)),
        ("metro_wet", (0.82, 0.92), (0.07, 0.10)),
    ],
)
def test_slide_protection_works_as_published(
    name: str, efficiency: tuple[float, float], used: tuple[float, float]
) -> None:
    """83 to 92 % of the available adhesion, creep of 4 to 20 %, 0.5 to 3 cycles/s."""
    row = judged(name)
    assert efficiency[0] < row.efficiency < efficiency[1]
    assert used[0] < row.used < used[1]
    assert 0.04 < row.creep < 0.15
    assert row.within > 0.7
    assert row.highest < 0.22
    assert 0.5 < row.cycles_hz < 3.0
    assert row.sliding > 0.9


def test_mixed_slides_in_front_and_rolls_behind() -> None:
    shares = []
    for journey in runs("mixed"):
        on = (journey.time_s > journey.full_from_s + 4.0) & (journey.speed_mps > 5.0)
        shares.append((creep(journey)[on] > 0.02).mean(axis=0))
    share = np.mean(shares, axis=0)
    assert share[:3].mean() > 0.4
    assert share[8:].mean() < 0.5 * share[:3].mean()


def test_used_never_exceeds_what_is_available_where_wheels_slide() -> None:
    for name in ("wet", "leaves"):
        for journey in runs(name):
            most = journey.sliding > 0.9
            assert (journey.used[most] <= 1.02 * journey.available[most]).all()


def test_used_grade_and_resistance_explain_the_deceleration() -> None:
    """M dv/dt = -(used M g + R + M g grade), with the run's own train drawn anew."""
    scenario = SCENARIOS["undulating"]
    (journey,) = simulate(scenario, [4])
    own = train.stack([train.draw(scenario.nominal, scenario.scatter, np.random.default_rng(4))])
    braked = (journey.time_s > journey.full_from_s + 0.1) & (journey.speed_mps > 0.5)
    running = train.resistance_n(scenario.nominal, own, journey.speed_mps)[0] / own.mass_kg[0]
    balance = -(journey.used + journey.grade) * GRAVITY - running
    np.testing.assert_allclose(journey.acceleration_mps2[braked], balance[braked], atol=3e-3)


@pytest.mark.parametrize(("name", "lost"), [("dry", (0.0, 0.015)), ("metro_leaves", (0.04, 0.2))])
def test_the_kinetic_energy_is_what_brake_resistance_and_sliding_took(name: str, lost: tuple[float, float]) -> None:
    """What the pads, the air and the grade did not take was lost in the contacts: next to nothing where wheels roll.

    Of a train that slides, about the creep's share of the work at the rails.
    """
    scenario = SCENARIOS[name]
    journey, seed = runs(name)[0], SEEDS[0]
    own = train.stack([train.draw(scenario.nominal, scenario.scatter, np.random.default_rng(seed))])
    on = journey.time_s >= journey.full_from_s
    time, speed = journey.time_s[on], journey.speed_mps[on]
    rim = (journey.wheel_radps * journey.radius_m)[on]
    moving = 0.5 * (own.mass_kg.item() * speed[0] ** 2 + own.wheel_kg.item() * float(np.sum(rim[0] ** 2)))
    pads = trapezoid((train.brake_n(own, journey.cylinder_pa[on], rim) * rim).sum(axis=1), time)
    air = trapezoid(train.resistance_n(scenario.nominal, own, speed)[0] * speed, time)
    rails = trapezoid(journey.used[on] * own.mass_kg.item() * GRAVITY * speed, time)
    assert lost[0] - 1e-3 < (moving - pads - air) / moving < lost[1]
    assert (rails + air) / (0.5 * own.mass_kg.item() * speed[0] ** 2) == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize(
    ("name", "tolerance"), [("dry", 1e-4), ("tram_dry", 3e-4), ("wet", 6e-3), ("metro_leaves", 6e-3)]
)
def test_half_the_step_gives_the_same_run(name: str, tolerance: float) -> None:
    """Where protection cycles, single cycles fall otherwise and the way is the same on the mean only."""
    half = simulate(SCENARIOS[name], SEEDS, step_s=STEP_S / 2.0)
    for one, other in zip(runs(name), half, strict=True):
        assert way(one) == pytest.approx(way(other), rel=tolerance)


def test_a_wheel_that_regains_the_trains_speed_does_not_shoot_over_it() -> None:
    """In coarse steps wheels ran up to 0.9 m/s faster than the braked train, and it did not come to a stop."""
    for journey in simulate(SCENARIOS["wet"], [1008, 1012], step_s=PERIOD_S):
        assert (journey.wheel_radps * journey.radius_m - journey.speed_mps[:, None]).max() < 0.05


def test_the_error_of_the_step_is_of_the_first_order() -> None:
    ways = [way(simulate(SCENARIOS["tram_dry"], [1], step_s=h)[0]) for h in (0.02, 0.01, 0.005)]
    assert (ways[0] - ways[1]) / (ways[1] - ways[2]) == pytest.approx(2.0, abs=0.4)


def test_the_body_pitches_by_0_3_to_1_degree_and_overshoots() -> None:
    for journey in runs("dry"):
        peak = np.rad2deg(journey.pitch_rad.max())
        assert 0.2 < peak < 1.3
        assert journey.pitch_rad[0] == 0.0
    rest = np.where(np.arange(500) < 50, 0.0, 0.01)
    assert pitch(rest)[-1] == pytest.approx(0.01, rel=1e-3)
    assert 0.012 < pitch(rest).max() < 0.015


def test_what_a_scenario_forces_is_so_and_nothing_else_changes() -> None:
    usual = [train.draw(INTERCITY, Scatter(), np.random.default_rng(seed)) for seed in range(200)]
    forced = [train.draw(INTERCITY, Scatter(mass=0.2, pads=-0.15), np.random.default_rng(seed)) for seed in range(200)]
    for one, other in zip(usual, forced, strict=True):
        assert other.mass_kg.item() == pytest.approx(1.2 * INTERCITY.mass_kg)
        for field in set(train.Train._fields) - {"mass_kg", "pad_n_per_pa"}:
            np.testing.assert_array_equal(getattr(one, field), getattr(other, field))
    masses = np.array([one.mass_kg.item() for one in usual]) / INTERCITY.mass_kg
    wear = np.array([one.radius_m for one in usual]) / INTERCITY.wheel_radius_m
    pads = np.array([one.pad_n_per_pa / one.pad_n_per_pa.mean() for one in usual])
    assert 0.9 <= masses.min() < 0.95
    assert 1.05 < masses.max() <= 1.2
    assert 0.96 < wear.min() < wear.max() < 1.01
    assert np.abs(pads - 1.0).max() < 0.08


def test_the_full_brake_of_the_papers_gives_their_deceleration() -> None:
    """On a dry level track, without resistance, once built up."""
    nominal = replace(INTERCITY, resistance=(0.0, 0.0, 0.0))
    scenario = replace(SCENARIOS["dry"], nominal=nominal, scatter=AS_THE_PAPERS_SAY)
    (journey,) = simulate(scenario, [0])
    on = (journey.time_s > journey.full_from_s + 4.0) & (journey.speed_mps > 1.0)
    assert journey.acceleration_mps2[on].mean() == pytest.approx(-nominal.deceleration_mps2, rel=0.03)


def test_the_command_runs_along_a_freight_train() -> None:
    journey = coarse("freight_dry")
    first = np.argmax(journey.cylinder_pa > 1e3, axis=0) * PERIOD_S
    assert first[-1] - first[0] == pytest.approx(700.0 * 19 / 20 / 265.0, abs=0.1)


def test_errors_name_the_remedy() -> None:
    with pytest.raises(ValueError, match="no stop within 900 m"):
        simulate(replace(SCENARIOS["leaves"], way_m=900.0), [0])


def test_scenarios_are_data() -> None:
    assert isinstance(SCENARIOS, Mapping)
    assert all(name == scenario.name for name, scenario in SCENARIOS.items())
    assert {field.name for field in fields(Nominal)} >= {"mass_kg", "length_m", "resistance", "full_pa", "build_up_s"}
