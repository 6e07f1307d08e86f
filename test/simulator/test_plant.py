# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The true train against closed forms, the braking curve, the published figures and the law of its noise."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from adhesion_node.core.physics import braking
from adhesion_node.core.physics.adhesion import WET, SpeedLaw
from adhesion_node.core.physics.track import LEVEL, Grade, Track
from adhesion_node.core.physics.train import CRH3, GRAVITY, KMH, Train
from sim_node.train import plant
from sim_node.train.plant import NO_NOISE, PlantNoise, Truth, advance, simulate
from sim_node.train.scenario import NO_BRAKE, SCENARIOS, Brake, Rail, Scenario, find

FREE = Train(resistance_c0=0.0, resistance_c1=0.0, resistance_c2=0.0)
"""CRH3 without running resistance."""

FULL_BRAKE = Brake(0.0)


def _scenario(
    speed_mps: float,
    law: SpeedLaw,
    train: Train = CRH3,
    brake: Brake = FULL_BRAKE,
    end_speed_mps: float | None = 0.0,
) -> Scenario:
    return Scenario("test", speed_mps, Rail(((0.0, law),)), 400.0, brake, end_speed_mps, LEVEL, train)


def _quiet(scenario: Scenario, period_s: float = 0.1) -> list[Truth]:
    return list(simulate(scenario, period_s, np.random.default_rng(0), NO_NOISE))


def _reach(truths: Iterable[Truth], speed_mps: float) -> tuple[float, float]:
    """Position and time, s, where the run comes down to `speed_mps`, by interpolation between its samples."""
    braking_run = [t for t in truths if t.pressure_pa > 0]
    moving = sum(t.speed_mps > 0 for t in braking_run)
    slowing = braking_run[: moving + 1]
    speeds = [-t.speed_mps for t in slowing]
    position = np.interp(-speed_mps, speeds, [t.position_m for t in slowing])
    time = np.interp(-speed_mps, speeds, [t.t_ns / 1e9 for t in slowing])
    return float(position), float(time)


@pytest.mark.parametrize("period_s", [0.02, 0.1, 1.0])
def test_constant_adhesion_without_resistance_stops_in_v_squared_over_2a(period_s: float) -> None:
    speed, mu = 200 * KMH, 0.05
    truths = _quiet(_scenario(speed, SpeedLaw(mu), FREE), period_s)
    last = truths[-1]
    assert last.position_m == pytest.approx(speed**2 / (2 * mu * 9.8), rel=1e-9)
    assert last.speed_mps == 0.0
    stopped = next(t.t_ns / 1e9 for t in truths if t.speed_mps == 0.0)
    assert 0.0 <= stopped - speed / (mu * 9.8) <= period_s
    for truth in truths:
        time = min(truth.t_ns / 1e9, speed / (mu * 9.8))
        assert truth.position_m == pytest.approx(speed * time - mu * 9.8 * time**2 / 2, abs=1e-6)


def test_brake_limited_stop_takes_the_printed_0_9332() -> None:
    speed = 100 * KMH
    last = _quiet(_scenario(speed, SpeedLaw(0.3), FREE))[-1]
    assert last.position_m == pytest.approx(speed**2 / (2 * 0.9332), rel=1e-4)


def test_rotating_masses_lengthen_the_stop_only_where_the_brake_limits() -> None:
    speed, rho = 100 * KMH, 0.08
    heavy = replace(FREE, rotating_mass_fraction=rho)
    by_brake = [_quiet(_scenario(speed, SpeedLaw(0.3), train))[-1].position_m for train in (FREE, heavy)]
    by_rail = [_quiet(_scenario(speed, SpeedLaw(0.05), train))[-1].position_m for train in (FREE, heavy)]
    assert by_brake[1] / by_brake[0] == pytest.approx(1 + rho, rel=1e-9)
    assert by_rail[1] == pytest.approx(by_rail[0], rel=1e-12)


def test_a_linear_build_up_follows_its_cubic() -> None:
    """a(t) = b t/T gives v = v0 - b t^2/(2T) and s = v0 t - b t^3/(6T)."""
    speed, build_up = 50.0, 4.0
    full = FREE.brake_force(410e3) / FREE.mass_kg
    truths = _quiet(_scenario(speed, SpeedLaw(0.5), FREE, Brake(0.0, 410e3, build_up)))
    for truth in truths[:41]:
        t = truth.t_ns / 1e9
        assert truth.pressure_pa == pytest.approx(410e3 * t / build_up)
        assert truth.speed_mps == pytest.approx(speed - full * t**2 / (2 * build_up), abs=1e-9)
        assert truth.position_m == pytest.approx(speed * t - full * t**3 / (6 * build_up), abs=1e-4)


def test_integration_is_of_second_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """Halving the substep divides the error by four: wet law and full resistance, against a very fine run."""
    scenario = _scenario(300 * KMH, WET)

    def speed_after_30_s(substep_s: float) -> float:
        monkeypatch.setattr(plant, "SUBSTEP_S", substep_s)
        return advance(scenario, 0.0, 30.0, 0.0, scenario.speed_mps)[1]

    exact = speed_after_30_s(0.005)
    errors = [abs(speed_after_30_s(step) - exact) for step in (2.0, 1.0, 0.5)]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(("start_kmh", "end_kmh"), [(300, 100), (250, 50), (160, 0)])
@pytest.mark.parametrize("law", [SpeedLaw(0.1542), SpeedLaw(0.0726), WET], ids=["0.1542", "0.0726", "wet"])
def test_distance_and_time_agree_with_the_braking_curve(start_kmh: float, end_kmh: float, law: SpeedLaw) -> None:
    """The curve integrates over speed, the plant over time."""
    curve = braking.curve(CRH3, start_kmh * KMH, law, end_kmh * KMH)
    truths = _quiet(_scenario(start_kmh * KMH, law, end_speed_mps=end_kmh * KMH), period_s=0.02)
    position, time = _reach(truths, end_kmh * KMH)
    assert position == pytest.approx(curve.distance_m[-1], rel=1e-3)
    assert time == pytest.approx(curve.time_s[-1], rel=1e-3)


@pytest.mark.parametrize(
    ("start_kmh", "end_kmh", "law", "distance_m", "time_s"),
    [
        (300, 100, SpeedLaw(0.1542), 3060.7, 56.1),
        (300, 100, SpeedLaw(0.0726), 3946.7, 71.7),
        (300, 100, WET, 3481.1, 62.8),
        (250, 50, SpeedLaw(0.1542), 2404.3, 59.3),
        (250, 50, SpeedLaw(0.0726), 2958.9, 72.7),
        (250, 50, WET, 2614.4, 62.7),
    ],
)
def test_distance_and_time_agree_with_the_published_ones(
    start_kmh: float, end_kmh: float, law: SpeedLaw, distance_m: float, time_s: float
) -> None:
    truths = _quiet(_scenario(start_kmh * KMH, law, end_speed_mps=end_kmh * KMH))
    assert _reach(truths, end_kmh * KMH) == pytest.approx((distance_m, time_s), rel=0.045)


@pytest.mark.parametrize(
    ("name", "law", "end_kmh", "grade"), [("tunnel_entry", WET, 100, 0.000468), ("tunnel_exit", WET, 50, 0.0)]
)
def test_scenarios_of_the_paper_brake_as_their_curve(name: str, law: SpeedLaw, end_kmh: float, grade: float) -> None:
    scenario = find(name)
    truths = _quiet(scenario)
    curve = braking.curve(CRH3, scenario.speed_mps, law, end_kmh * KMH, grade)
    position, _ = _reach(truths, end_kmh * KMH)
    assert position - scenario.speed_mps * 20.0 == pytest.approx(curve.distance_m[-1], rel=2e-3)
    assert truths[-1].speed_mps < end_kmh * KMH
    after = truths[-1].t_ns / 1e9 - next(t.t_ns / 1e9 for t in truths if t.speed_mps <= end_kmh * KMH)
    assert after == pytest.approx(2.0)
    if name == "tunnel_entry":
        assert truths[-1].position_m < scenario.track.sections[0].end_m, "the tunnel covers the braking"


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize(
    ("name", "before", "after", "end_kmh", "at_end"),
    [("tunnel_entry", 0.1432, 0.0726, 100, 0.1023), ("tunnel_exit", 0.1514, 0.0770, 50, 0.1206)],
)
def test_adhesion_switches_with_the_brake_whatever_the_noise(
    name: str, before: float, after: float, end_kmh: float, at_end: float, seed: int
) -> None:
    truths = list(simulate(find(name), 0.1, np.random.default_rng(seed)))
    switch = next(k for k, t in enumerate(truths) if t.pressure_pa > 0)
    assert truths[switch].t_ns == 20_000_000_000
    assert [t.mu for t in truths[switch - 1 : switch + 1]] == pytest.approx([before, after], abs=1.5e-4)
    assert [t.regime for t in truths[switch - 1 : switch + 1]] == ["COASTING", "ADHESION_LIMITED"]
    end = next(t for t in truths if t.speed_mps <= end_kmh * KMH)
    assert end.mu == pytest.approx(at_end, abs=2e-4)


def test_regimes_follow_what_the_brake_asks_of_the_rail() -> None:
    """On wet rail the full brake is adhesion-limited down to 128 km/h."""
    for truth in _quiet(find("tunnel_entry")):
        if truth.t_ns < 20_000_000_000:
            assert (truth.regime, truth.applied) == ("COASTING", 0.0)
        elif truth.speed_mps > 128.1 * KMH:
            assert (truth.regime, truth.applied) == ("ADHESION_LIMITED", truth.mu)
        elif truth.speed_mps < 127.9 * KMH:
            assert truth.regime == "BRAKE_LIMITED"
            assert truth.applied == pytest.approx(0.0952, abs=5e-5)
    assert {t.regime for t in _quiet(find("dry_braking"))} == {"COASTING", "BRAKE_LIMITED"}
    assert {t.regime for t in _quiet(find("cruise"))} == {"COASTING"}


def test_the_patch_ends_while_adhesion_still_limits() -> None:
    truths = [t for t in _quiet(find("low_adhesion_patch")) if t.pressure_pa > 0]
    wet = np.array([0.04 + 13.7 / (120 + t.speed_mps * 3.6) for t in truths])
    ratio = np.array([t.mu for t in truths]) / wet
    inside = np.flatnonzero(ratio < 0.9)
    assert ratio[inside] == pytest.approx(0.45)
    assert np.delete(ratio, inside) == pytest.approx(1.0)
    assert truths[inside[-1]].position_m - truths[inside[0]].position_m == pytest.approx(1000.0, abs=14.0)
    assert truths[inside[-1] + 1].regime == "ADHESION_LIMITED"


def test_traction_holds_the_speed_and_a_grade_changes_nothing() -> None:
    hilly = replace(find("cruise"), track=Track((Grade(500.0, 1500.0, 20.0),)))
    for truth in _quiet(hilly):
        assert truth.speed_mps == hilly.speed_mps
        assert truth.position_m == pytest.approx(hilly.speed_mps * truth.t_ns / 1e9)


def test_a_grade_brakes_by_its_weight() -> None:
    speed, mu, grade = 30.0, 0.05, 0.01
    uphill = replace(_scenario(speed, SpeedLaw(mu), FREE), track=Track((Grade(-300.0, 2000.0, 23.0),)))
    assert _quiet(uphill)[-1].position_m == pytest.approx(speed**2 / (2 * GRAVITY * (mu + grade)), rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_the_train_stops_for_good_and_never_runs_backwards(seed: int) -> None:
    slow = replace(_scenario(3.0, SpeedLaw(0.02)), end_speed_mps=None, end_s=60.0)
    truths = list(simulate(slow, 0.1, np.random.default_rng(seed), PlantNoise(0.1, 0.05)))
    positions, speeds = (np.array(column) for column in list(zip(*truths, strict=True))[1:3])
    assert np.all(np.diff(positions) >= 0.0)
    assert np.all(speeds >= 0.0)
    stop = int(np.flatnonzero(speeds == 0.0)[0])
    assert np.all(speeds[stop:] == 0.0)
    assert np.all(positions[stop:] == positions[stop])
    assert {(t.regime, t.applied) for t in truths[stop:]} == {("BRAKE_LIMITED", 0.0)}


@pytest.mark.parametrize("period_s", [0.02, 0.1, 0.5])
def test_noise_has_the_nominal_law_at_every_rate(period_s: float) -> None:
    """While cruising the speed is a random walk, and the position its exact sum plus the position's own noise."""
    run = Scenario("test", 300 * KMH, find("cruise").rail, 4000 * period_s, NO_BRAKE)
    truths = list(simulate(run, period_s, np.random.default_rng(5)))
    positions, speeds = (np.array(column) for column in list(zip(*truths, strict=True))[1:3])
    on_speed = np.diff(speeds)
    on_position = np.diff(positions) - speeds[:-1] * period_s
    growth = math.sqrt(period_s / 0.1)
    tolerance = 4 / math.sqrt(2 * 4000)
    assert on_speed.std() == pytest.approx(0.02 / 3.6 * growth, rel=tolerance)
    assert on_position.std() == pytest.approx(0.02 * growth, rel=tolerance)
    assert abs(np.corrcoef(on_speed, on_position)[0, 1]) < 4 / math.sqrt(4000)
    assert abs(np.corrcoef(on_speed[1:], on_speed[:-1])[0, 1]) < 4 / math.sqrt(4000)


def test_stamps_are_exact_multiples_of_the_period() -> None:
    stamps = [t.t_ns for t in _quiet(find("cruise"))]
    assert stamps == [k * 100_000_000 for k in range(601)]


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_run_is_determined_by_its_generator(name: str) -> None:
    first, again, other = (list(simulate(find(name), 0.5, np.random.default_rng(seed))) for seed in (1, 1, 2))
    assert first == again
    assert first != other


@pytest.mark.parametrize("period_s", [0.0, -0.1, math.nan, math.inf, 1e-10])
def test_a_period_out_of_range_is_refused_at_the_call(period_s: float) -> None:
    with pytest.raises(ValueError, match="simulation period_s = "):
        simulate(find("cruise"), period_s, np.random.default_rng(0))


@pytest.mark.parametrize("noise", [{"position_m": -1.0}, {"speed_mps": math.nan}])
def test_noise_out_of_range_is_refused_by_name(noise: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=f"process noise {next(iter(noise))} = "):
        PlantNoise(**noise)
