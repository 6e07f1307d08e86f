# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The bank under whatever may come: no error, no NaN, variances not below 0, probabilities that sum to 1."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from banks import SPEEDS, S
from hypothesis import given, settings
from hypothesis import strategies as st

from adhesion_node.core import Config, Measurement, Outcome, finish, init, step
from adhesion_node.core.bank.branching import MOST
from adhesion_node.core.bank.findings.verdict import found
from adhesion_node.core.bank.following import followed, met
from adhesion_node.core.bank.labels.noises import NOISES
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.intake.samples import ImuSample, PressureSample, SpeedSample, WheelSample
from adhesion_node.core.physics.train import CRH3
from adhesion_node.core.prediction import predict

CONFIG = Config(method="bank", grade_std=0.005, mass_std=0.05, brake_std=0.1, speed_source="doppler")
CONFIGS = (
    CONFIG,
    replace(CONFIG, pressure_kind="mean", law_probability=1.0),
    replace(CONFIG, pressure_kind="demanded", train=replace(CRH3, rotating_mass_fraction=0.1), speed_source="axle"),
    Config(method="bank"),
)
RAIL = Rail(0.05, 0.04, 0.02)

speeds = st.sampled_from([0.0, 1e-6, 2.9, 3.1, 30.0, 80.0, -20.0, 200.0])
steps_ns = st.sampled_from([100_000, 10_000_000, 100_000_000, 500_000_000, 2_000_000_000])
pressures = st.sampled_from([None, 0.0, -5e3, 9e3, 11e3, 150e3, 410e3, 1e7])
variances = st.sampled_from([math.inf, math.inf, 1e-12, 1e-4, 0.09, 4.0, 1e8])
places = st.sampled_from([0.0, 0.0, 0.0, 0.3, -3.0, 40.0, 1e4])
extras = st.sampled_from(["", "speed", "wheels", "imu", "wheels nan", "demand", "all"])
stops = st.lists(st.tuples(steps_ns, speeds, pressures, variances, places, extras), min_size=3, max_size=30)


def measured(rides: list[tuple[int, float, float | None, float, float, str]]) -> list[Measurement]:
    t_ns, s, result = S, 0.0, []
    for dt_ns, v, pressure, variance, off, extra in rides:
        t_ns, s = t_ns + dt_ns, s + v * dt_ns / S
        every = extra == "all"
        rim = (v / 0.46, 0.5 * v / 0.46, v / 0.46, math.nan)
        wheels = (WheelSample(t_ns - 1, rim),) if "wheels" in extra or every else ()
        if extra == "wheels nan":
            wheels = (WheelSample(t_ns - 1, (math.nan, 0.0)),)
        result.append(
            Measurement(
                t_ns,
                s + off,
                variance,
                pressure,
                demand_pa=410e3 if extra == "demand" else None,
                pressures=(PressureSample(t_ns - 50, pressure),) if every and pressure is not None else (),
                speeds=(SpeedSample(t_ns - 60, v, 1e-9), SpeedSample(t_ns, v)) if extra == "speed" or every else (),
                wheels=wheels,
                imu=(ImuSample(t_ns, -0.01 * off, None),) if extra == "imu" or every else (),
            )
        )
    return result


def check(memory: Memory) -> None:
    bank = memory.bank
    assert np.isfinite(bank.mean).all()
    assert np.isfinite(bank.covariance).all()
    assert math.isclose(float(bank.weight.sum()), 1.0, rel_tol=1e-9)
    assert 0 < bank.log_weight.size <= max(MOST, len(NOISES) * 69)
    variance = np.diagonal(bank.covariance, axis1=1, axis2=2)
    assert (variance >= 0.0).all()
    assert np.abs(bank.covariance - bank.covariance.transpose(0, 2, 1)).max() <= 1e-6 * (1.0 + variance.max())
    std = np.sqrt(variance) + 1e-9
    correlations = bank.covariance / (std[:, :, None] * std[:, None, :])
    assert np.abs(correlations).max() <= 1.0 + 1e-6


def probe(index: int, measurements: list[Measurement]) -> None:
    config = CONFIGS[index]
    memory = met(config, measurements[0])
    check(memory)
    for measurement in measurements[1:]:
        memory = followed(config, memory, measurement, lambda: RAIL)
        check(memory)
        findings = found(config, memory, RAIL, RAIL)
        assert 0.0 <= findings.rail.lower <= findings.rail.mu < math.inf
        assert 0.0 < findings.rail.std < math.inf
        resistance = config.train.specific_resistance(SPEEDS)
        slowing = resistance + findings.ahead.against(config.train, resistance)(SPEEDS)
        assert ((slowing >= -1e-15) & np.isfinite(slowing)).all()


@given(st.integers(0, len(CONFIGS) - 1), stops)
@settings(max_examples=40)
def test_any_sequence_of_measurements_leaves_a_sound_belief(
    index: int, rides: list[tuple[int, float, float | None, float, float, str]]
) -> None:
    probe(index, measured(rides))


@given(st.integers(0, len(CONFIGS) - 1), stops)
@settings(max_examples=20)
def test_the_estimator_never_raises_and_tells_finite_numbers(
    index: int, rides: list[tuple[int, float, float | None, float, float, str]]
) -> None:
    config = CONFIGS[index]
    state, estimates = init(config, 1), []
    for measurement in measured(rides):
        state, estimate = step(config, state, measurement)
        estimates += [] if estimate is None else [estimate]
    for estimate in (*estimates, *finish(config, state)[1]):
        assert all(math.isfinite(value) for value in estimate if isinstance(value, float))
        assert 0.0 <= estimate.mu_lower <= estimate.mu
        assert min(estimate.mu_std, estimate.position_std_m, estimate.speed_std_mps) >= 0.0
        predict(config, estimate)
    assert state.counts[Outcome.INVALID] == 0
