# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The estimator as a whole: bit for bit, extreme settings, speeds, standstill, rough streams."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from oracles import drive, ride
from quick_window import FULL, QUICK, STOP

from adhesion_node.core import Estimate, Measurement, Outcome, finish, init, step


def _finite(estimate: Estimate) -> bool:
    numbers = [value for value in estimate if isinstance(value, float)]
    return len(numbers) == 9 and all(map(math.isfinite, numbers)) and estimate.mu_std >= 0 <= estimate.mu_lower


def test_seed_and_stream_decide_every_bit() -> None:
    measurements = ride(STOP)
    one, again, other = (drive(QUICK, measurements, seed)[1] for seed in (1, 1, 2))
    assert one == again
    assert one[5] == other[5]  # no chance while coasting
    assert one[-1].mu != other[-1].mu
    with pytest.raises(ValueError, match="seed = -1: give an integer of at least 0"):
        init(QUICK, -1)


def test_an_old_state_is_still_usable() -> None:
    measurements = ride(STOP)[:128]
    state = init(QUICK, 1)
    for measurement in measurements[:83]:
        state, _ = step(QUICK, state, measurement)
    before = repr(state)
    ends = []
    for _ in range(2):
        branch = state
        for measurement in measurements[83:]:  # ends within a window
            branch, _ = step(QUICK, branch, measurement)
        ends.append(finish(QUICK, branch)[1])
        step(QUICK, state, measurements[83]._replace(position_m=1e6))
        finish(QUICK, state)
    assert repr(state) == before
    assert ends[0] == ends[1] == tuple(drive(QUICK, measurements)[1][-1:])
    assert not isinstance(state.counts, dict)  # a view that cannot be written to


@pytest.mark.parametrize(("window", "length"), [(10, 9), (10, 1), (3, 2), (3, 1)])
def test_the_extremes_of_window_and_stepdrive(window: int, length: int) -> None:
    _, estimates = drive(replace(QUICK, window=window, step=length), ride([(3.0, 0.0), (6.0, FULL)]))
    assert all(map(_finite, estimates))


def test_a_speed_helps_while_coasting_and_is_ignored_under_the_brake() -> None:
    plain = ride(STOP)
    speed = 80.0 + 0.1 * np.random.default_rng(5).standard_normal(130)
    coasting = [
        m._replace(speed_mps=float(v)) if not m.brake_pressure_pa else m for m, v in zip(plain, speed, strict=True)
    ]
    sliding = [m._replace(speed_mps=20.0) if m.brake_pressure_pa else m for m in coasting]
    config = replace(QUICK, speed_std_mps=0.1)
    without, seen, slid = (drive(config, measurements)[1] for measurements in (plain, coasting, sliding))
    assert seen[3].speed_std_mps < 0.6 * without[3].speed_std_mps
    assert abs(seen[3].speed_mps - 80.0) < 0.15
    assert slid == seen
    radar = replace(config, speed_source="radar")
    true = [m._replace(speed_mps=80.0 - 0.822 * max(m.t_ns / 1e9 - 5.0, 0.0)) for m in plain]
    assert drive(radar, true)[1][-1].speed_std_mps < 0.6 * seen[-1].speed_std_mps


def test_standing_still_is_no_slippery_rail() -> None:
    config = replace(QUICK, iterations=30, window=30, step=10)
    measurements = ride([(5.0, 0.0), (60.0, FULL)], speed_mps=30.0)  # stands after 35 s
    _, estimates = drive(config, measurements)
    assert all(map(_finite, estimates))
    standing = [e for e in estimates if e.t_ns > 45e9]
    assert all(abs(e.speed_mps) < 2.5 and e.mu > 0.045 for e in standing)
    assert {e.window for e in standing} == {0}


@pytest.mark.parametrize("start_mu", [0.0, 0.05, 0.12])
def test_the_bound_never_exceeds_the_estimate(start_mu: float) -> None:
    phases: list[tuple[float, float | None]] = [(5.0, 0.0), (8.0, FULL), (30.0, 0.0), (6.0, FULL), (4.0, 100e3)]
    _, estimates = drive(replace(QUICK, start_mu=start_mu), ride(phases, mu=0.035))
    assert all(e.mu_lower <= e.mu for e in estimates)


@pytest.mark.parametrize("seed", range(12))
def test_rough_streams_give_finite_numbers_or_counted_drops(seed: int) -> None:
    """Random phases, gaps, noise, order, stamps, pressures and nonsense: never an exception, never a NaN."""
    rng = np.random.default_rng(seed)
    pressures = [0.0, FULL, None, float(rng.uniform(0, 6e5)), 15e3, -2e3]
    phases = [(float(rng.uniform(0.5, 8)), pressures[int(rng.integers(6))]) for _ in range(8)]
    stream = []
    for m in ride(phases, mu=float(rng.uniform(0.005, 0.2)), speed_mps=float(rng.uniform(1, 95)), seed=seed):
        chance = rng.random()
        position = m.position_m + float(rng.standard_t(1.5)) * 0.5 + (1e4 if chance < 0.01 else 0.0)
        speed = float(rng.normal(40, 40)) if rng.random() < 0.3 else None
        variance = float(10.0 ** rng.uniform(-13, 9)) if chance > 0.97 else 0.25
        shift = round(rng.normal(0, 1e8)) if chance < 0.1 else round(rng.normal(0, 1e11)) if chance > 0.995 else 0
        rough = Measurement(m.t_ns + shift, position, variance, m.brake_pressure_pa, speed)
        if chance > 0.02:
            stream.append(rough if chance < 0.95 else rough._replace(position_m=math.nan))
        if 0.5 < chance < 0.52:
            stream.append(rough._replace(brake_pressure_pa=None))
    config = replace(
        QUICK,
        window=int(rng.integers(6, 25)),
        max_lag_s=float(rng.choice([0.0, 0.3])),
        max_outliers=10,
        speed_source=("axle", "doppler")[rng.integers(2)],
    )
    state, estimates = drive(config, stream, seed)
    assert all(map(_finite, estimates))
    assert len(estimates) > 5
    assert all(e.mu_lower <= e.mu + 1e-12 for e in estimates)
    # of the last two a measurement is used without its speed; no position repeats itself here
    of_others = (Outcome.RESET, Outcome.SPEED_IN_KMH, Outcome.STUCK)
    assert sum(state.counts[o] for o in Outcome if o not in of_others) == len(stream)  # each is counted once
