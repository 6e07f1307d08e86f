# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The slip plant: its curve, its balances, its drive and its sensors, against closed forms and a second integrator."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from scipy.integrate import solve_ivp, trapezoid

from adhesion_node.core.creep.curve import adhesion, parameters
from sim_node.slip import plant as slip
from sim_node.slip.plant import SlipNoise, drive, run, simulate
from sim_node.slip.scenario import DRY, SCENARIOS, WET, Locomotive, SlipScenario, Surface, find

PERIOD_NS = 10_000_000


@pytest.fixture(scope="module")
def dry() -> list[slip.SlipTruth]:
    return list(simulate(SCENARIOS["creep_dry"], PERIOD_NS))


@pytest.mark.parametrize("surface", [DRY, WET])
def test_the_curve_is_kienckes(surface: Surface) -> None:
    creeps = np.linspace(0.0, 0.5, 100)
    theta = parameters(surface.slope, surface.mu_max, surface.lambda_m)
    assert surface.mu(creeps) == pytest.approx(adhesion(creeps, surface.slope, theta), rel=1e-12)
    assert surface.mu(-creeps) == pytest.approx(-surface.mu(creeps))


def test_the_creep_runs_from_0_to_the_peak_and_back(dry: list[slip.SlipTruth]) -> None:
    creeps = np.array([truth.creep.max() for truth in dry])
    assert creeps[0] == 0.0
    assert 0.099 < creeps.max() < 0.11
    rising = creeps[: np.flatnonzero(creeps > 0.099)[0]]
    assert np.diff(rising).min() > -1e-4
    assert len(rising) > 1500


def test_force_and_creep_lie_on_the_curve(dry: list[slip.SlipTruth]) -> None:
    for truth in dry[::100]:
        assert truth.force_n == pytest.approx(float(DRY.mu(truth.creep).mean()) * 6 * 25e3 * 9.8)


def test_the_trains_momentum_is_the_forces_impulse(dry: list[slip.SlipTruth]) -> None:
    """M (v1 - v0) = integral of sum F - R, by the trapezoidal rule over the samples."""
    loco = Locomotive()
    impulse = trapezoid([truth.force_n - loco.resistance_n for truth in dry], dx=0.01)
    assert loco.train_mass_kg * (dry[-1].speed_mps - dry[0].speed_mps) == pytest.approx(impulse, rel=1e-3)


def test_an_axle_settles_where_an_adaptive_integrator_puts_it() -> None:
    """One rise of the torque, against LSODA on the same equations written anew."""
    loco, surface, end = Locomotive(), DRY, 5.0

    def slope(t: float, y: np.ndarray[tuple[int], np.dtype[np.float64]]) -> list[float]:
        creep = (loco.wheel_radius_m * y[0] - y[1]) / y[1]
        theta = parameters(surface.slope, surface.mu_max, surface.lambda_m)
        force = float(adhesion(np.array(creep), surface.slope, theta)) * loco.axle_load_kg * 9.8
        torque = loco.full_torque_nm * t / slip.RISE_S
        turning = (torque - loco.wheel_radius_m * force) / loco.axle_inertia_kgm2
        return [turning, (loco.axles * force - loco.resistance_n) / loco.train_mass_kg]

    begin = [8.0 / loco.wheel_radius_m, 8.0]
    exact = solve_ivp(slope, (0.0, end), begin, method="LSODA", rtol=1e-9, atol=1e-12).y[:, -1]
    ours = next(islice(simulate(SCENARIOS["creep_dry"], PERIOD_NS), 500, None))
    assert ours.t_ns == 5 * 10**9
    assert ours.wheel_radps[0] == pytest.approx(exact[0], rel=1e-5)
    assert ours.speed_mps == pytest.approx(exact[1], rel=1e-5)


def test_the_drive_lets_go_at_the_limit_and_pulls_again_below() -> None:
    loco = Locomotive()
    torque, pulling = drive(loco, 10e3, True, 0.05, 0.1)
    assert pulling
    assert torque == pytest.approx(10e3 + 60e3 / 20 * 0.1)
    torque, pulling = drive(loco, 40e3, True, 0.1, 0.1)
    assert not pulling
    assert torque == pytest.approx(40e3 - 60e3 / 0.5 * 0.1)
    assert drive(loco, torque, pulling, 0.05, 0.1)[1] is False
    assert drive(loco, torque, pulling, 0.003, 0.1)[1] is True
    assert drive(loco, 60e3, True, 0.05, 1.0)[0] == 60e3
    assert drive(loco, 1.0, False, 0.05, 1.0)[0] == 0.0


def test_the_surface_changes_axle_by_axle() -> None:
    loco = Locomotive()
    scenario = SlipScenario("short", ((0.0, DRY), (20.0, WET)), 6.0)
    truths = list(simulate(scenario, PERIOD_NS))
    peaks = sorted({round(truth.mu_max, 6) for truth in truths}, reverse=True)
    assert peaks == pytest.approx([(0.35 * dry_axles + 0.20 * (6 - dry_axles)) / 6 for dry_axles in range(6, -1, -1)])
    first = next(truth for truth in truths if truth.mu_max < 0.349)
    last = next(truth for truth in truths if truth.mu_max < 0.201)
    assert last.position_m - first.position_m == pytest.approx(5 * loco.axle_spacing_m, abs=0.2)


def test_the_noise_is_that_of_the_settings_and_leaves_the_truth_alone() -> None:
    noise = SlipNoise(0.02, 0.03, 500.0)
    pairs = list(islice(run(SCENARIOS["creep_dry"], 0.01, 3, noise), 1000))
    wheels = np.array([reading.wheel_radps - truth.wheel_radps for truth, reading in pairs])
    assert wheels.std() == pytest.approx(0.02, rel=0.05)
    assert np.std([reading.speed_mps - truth.speed_mps for truth, reading in pairs]) == pytest.approx(0.03, rel=0.08)
    assert np.std([reading.force_n - truth.force_n for truth, reading in pairs]) == pytest.approx(500.0, rel=0.08)
    quiet = list(islice(run(SCENARIOS["creep_dry"], 0.01, 3, SlipNoise(0.0, 0.0, 0.0)), 1000))
    assert [truth.speed_mps for truth, _ in quiet] == [truth.speed_mps for truth, _ in pairs]
    assert [reading.speed_mps for _, reading in quiet] == [truth.speed_mps for truth, _ in quiet]


def test_same_seed_same_readings_another_seed_others() -> None:
    one, again, other = ([r for _, r in islice(run(SCENARIOS["creep_dry"], 0.01, s), 50)] for s in (1, 1, 2))
    assert one == again
    assert one != other


def test_what_makes_no_sense_is_refused() -> None:
    with pytest.raises(ValueError, match=r"surface positions = \(5.0, 5.0\): give at least one, in increasing order"):
        SlipScenario("twice", ((5.0, DRY), (5.0, WET)), 1.0)
    with pytest.raises(ValueError, match=r"sensor force_std_n = -1.0: give a value from 0 to 1e\+06"):
        SlipNoise(force_std_n=-1.0)
    with pytest.raises(ValueError, match=r"simulation period_s = 0.0: give a finite number"):
        run(SCENARIOS["creep_dry"], 0.0, 1)
    with pytest.raises(ValueError, match=r"scenario = 'mud': give one of creep_dry, creep_switch"):
        find("mud")
