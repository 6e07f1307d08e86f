# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Windows of the estimator: when they open and end, and what is known before and behind them."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from oracles import drive, ride
from quick_window import FULL, QUICK, STOP, counts
from windowed import windowed

from adhesion_node.core import Config, Regime, finish, init, step


@pytest.mark.parametrize("sigma_m", [0.2, 0.5, 2.0])
def test_a_window_opens_as_soon_as_the_speed_is_settled(sigma_m: float) -> None:
    """Of a train met under the brake: its variance over that of the long run, sqrt(2) q^(3/4) (r dt)^(1/4), q = 1."""
    long_run = math.sqrt(2.0) * (sigma_m**2 * 0.1) ** 0.25
    state, ratios = init(windowed(), 1), []
    for measurement in ride([(4.0, FULL)], sigma_m=sigma_m):
        state, _ = step(windowed(), state, measurement)
        assert state.belief is not None
        ratios.append(state.belief.covariance[1, 1] / long_run)
        if state.window is not None:
            break
    assert ratios[-1] <= 1.5 < ratios[-2]


@pytest.mark.parametrize("samples", [127, 128, 130])
def test_finish_evaluates_the_last_short_window(samples: int) -> None:
    measurements = ride(STOP)[:samples]
    _, estimates = drive(QUICK, measurements)
    assert [e.t_ns for e in estimates[:-1]] == [m.t_ns for m in measurements[4::5]][: len(estimates) - 1]
    assert estimates[-1].t_ns == measurements[-1].t_ns
    assert estimates[-1].window > 0
    assert len({e.t_ns for e in estimates}) == len(estimates)  # nothing twice, also without a rest
    assert finish(QUICK, init(QUICK, 0))[1] == ()


@pytest.mark.parametrize("cruise_s", [5.0, 5.3])
def test_windows_hold_s_measurements_wherever_the_brake_came(cruise_s: float) -> None:
    _, estimates = drive(QUICK, ride([(cruise_s, 0.0), (10.0, FULL)]))
    sizes = [e.window for e in estimates if e.window]
    growing = [size for size in sizes[:-1] if size < 20]
    assert all(after - before == 5 for before, after in pairwise(growing))
    assert all(20 <= size < 25 for size in sizes[len(growing) : -1])  # the first full one may take what came with L
    assert set(sizes[len(growing) + 1 : -1]) == {20}
    assert len(sizes) >= 18


def test_releasing_the_brake_ends_the_window_and_the_knowledge_fades() -> None:
    measurements = ride([(5.0, 0.0), (10.0, FULL), (20.0, 0.0)])
    released = measurements[150].t_ns
    _, estimates = drive(windowed(), measurements)
    braking = [e for e in estimates if e.window]
    assert braking[-1].t_ns == released  # its step was braked still
    free = [e for e in estimates if e.t_ns > released]
    assert len(free) >= 19
    assert {e.regime for e in free} == {Regime.COASTING}
    low = 0.03 + 8.0 / (130.0 + 3.6 * free[-1].speed_mps)  # the configured low law
    assert abs(free[-1].mu - low) < abs(free[0].mu - low)
    assert all(after.mu_std > before.mu_std for before, after in pairwise(free))
    assert free[0].speed_mps == pytest.approx(80.0 - 10 * 9.8 * (0.0726 + 0.0113), abs=3 * free[0].speed_std_mps)
    assert free[-1].speed_mps == pytest.approx(80.0 - 10 * 9.8 * (0.0726 + 0.0113), abs=0.7)


def test_what_the_window_knew_of_the_speed_is_not_lost_on_release() -> None:
    state, last = init(QUICK, 1), None
    for measurement in ride([*STOP, (0.1, 0.0)]):
        state, estimate = step(QUICK, state, measurement)
        last = estimate or last
    assert last is not None
    assert state.belief is not None
    assert state.window is None
    assert (state.belief.mean[0], state.belief.mean[1]) == (last.position_m, last.speed_mps)
    assert state.belief.speed_std == last.speed_std_mps < 0.6  # the tracker's own is 0.7 under the brake


@pytest.mark.parametrize("start_mu", [0.0, 0.05, 0.12])
def test_one_second_of_braking_claims_nothing_whatever_the_start(start_mu: float) -> None:
    """Ten measurements know little: ignorance stays, and its low law pulls, 0.03 + 8/(130 + 288) = 0.0491 at 80 m/s."""
    _, estimates = drive(windowed(start_mu=start_mu), ride([(5.0, 0.0), (1.0, FULL)]))
    _, others = drive(windowed(), ride([(5.0, 0.0), (1.0, FULL)]))
    assert estimates[-1].window == 10
    assert estimates[-1].regime is Regime.COASTING
    assert estimates[-1].mu == pytest.approx(others[-1].mu, abs=1e-6)
    assert 0.025 < estimates[-1].mu_std < 0.041
    assert 0.048 < estimates[-1].mu_lower < 0.052


@pytest.mark.parametrize("start_mu", [0.0, 0.05, 0.12])
def test_the_papers_method_claims_nothing_after_one_second_either(start_mu: float) -> None:
    config = Config(method="particle_em", step=10, start_mu=start_mu)
    _, estimates = drive(config, ride([(5.0, 0.0), (1.0, FULL)]))
    assert estimates[-1].regime is Regime.COASTING
    assert estimates[-1].mu == pytest.approx(0.0491, abs=0.015)
    assert estimates[-1].mu_std == pytest.approx(0.04, rel=0.2)


def test_braking_again_opens_a_new_window() -> None:
    _, estimates = drive(QUICK, ride([(5.0, 0.0), (4.0, FULL), (5.0, 0.0), (4.0, FULL)]))
    sizes = [(e.t_ns / 1e9, e.window) for e in estimates]
    assert all(window == 0 for t, window in sizes if t < 5.0 or 9.3 < t < 14.0)
    assert max(window for t, window in sizes if 14.0 < t < 15.0) <= 10


@pytest.mark.parametrize("sigma_m", [0.5, 2.0])
def test_a_gap_under_the_brake_ends_the_window_and_a_new_one_opens(sigma_m: float) -> None:
    measurements = ride([(5.0, 0.0), (25.0, FULL)], sigma_m=sigma_m)
    gapped = [m for m in measurements if not 12e9 <= m.t_ns < 15e9]
    state, estimates = drive(windowed(), gapped)
    assert counts(state) == {"ACCEPTED": 270}
    after = [e for e in estimates if e.t_ns >= 15e9]
    assert after[0].window <= 10
    assert after[-2].window == 50
    # 25 s of 9.8 (0.0726 + 0.0099), the resistance at the mean speed
    assert abs(after[-1].speed_mps - (80.0 - 25 * 0.8085)) < 3 * after[-1].speed_std_mps
    assert after[-1].speed_std_mps < 0.6


def test_a_short_gap_is_bridged() -> None:
    measurements = ride(STOP)
    state, estimates = drive(QUICK, [m for m in measurements if not 8e9 <= m.t_ns < 9.5e9])
    assert counts(state) == {"ACCEPTED": 115}
    assert min(e.window for e in estimates if e.t_ns > 7e9) >= 10
