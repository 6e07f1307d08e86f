# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Sensors that scatter by more than their messages tell."""

from __future__ import annotations

import numpy as np
import pytest
from banks import S, braked_run, measurements
from test_bank_trust import Run, assert_known, followed

from adhesion_node.core import ImuSample, SpeedSample
from adhesion_node.core.bank.findings.learnt import learnt
from adhesion_node.core.bank.scatter import Scatter, Shaking

H = 0.1


def scatter_of(values: np.ndarray, told: float, rate_hz: float = 10.0) -> Scatter:
    scatter = Scatter()
    for index, value in enumerate(values):
        scatter = scatter.after(S + round(index / rate_hz * S), float(value), told)
    return scatter


@pytest.mark.parametrize("rate_hz", [1.0, 10.0, 50.0])
@pytest.mark.parametrize("seed", range(5))
def test_what_scatters_more_than_is_told_counts(rate_hz: float, seed: int) -> None:
    """On a train that brakes, by 0.9 m/s^2 after a build-up of 3 s."""
    times = np.arange(200) / rate_hz
    speeds = 60.0 - 0.9 * np.maximum(times - 3.0, 0.0) + 0.3 * np.random.default_rng(seed).standard_normal(times.size)
    told = 0.05**2
    assert scatter_of(speeds, told, rate_hz).variance_of(told) == pytest.approx(0.09, rel=0.6)
    assert scatter_of(speeds[:20], told, rate_hz).variance_of(told) == told  # of too few nothing is known
    assert scatter_of(speeds, 0.09, rate_hz).variance_of(0.09) == 0.09
    assert scatter_of(speeds, 1.0, rate_hz).variance_of(1.0) == 1.0


def test_a_train_that_brakes_harder_and_harder_does_not_scatter() -> None:
    times = np.arange(0.0, 30.0, H)
    assert scatter_of(60.0 - 0.1 * times**2, 0.03**2).variance_of(0.03**2) == 0.03**2


def test_samples_apart_or_back_in_time_tell_nothing() -> None:
    scatter = Scatter()
    for t_ns, value in ((0, 0.0), (3 * S, 9.0), (6 * S, 0.0), (5 * S, 9.0), (5 * S, 0.0), (9 * S, 9.0)):
        scatter = scatter.after(t_ns, value, 1e-4)
    assert scatter.samples == 0


@pytest.mark.parametrize("hertz", [1.2, 0.7])
def test_an_accelerometer_that_bounces_slowly_is_told_by_its_seconds(hertz: float) -> None:
    """As the body of a coach does; from sample to sample it seems to be sure."""
    told, shaking = 0.01**2, Shaking()
    for index in range(600):
        t_s = H * index
        shaking = shaking.after(round(t_s * S), 0.2 * float(np.sin(2.0 * np.pi * hertz * t_s)), told, H, None)
    assert shaking.variance_of(told, H) > 20.0 * told  # of what comes and goes as much is left
    still = Shaking()
    for index in range(600):
        still = still.after(round(H * index * S), -0.02 if index > 300 else 0.01, told, H, None)
    assert still.variance_of(told, H) == told


@pytest.mark.parametrize("mu", [0.3, 0.06, 0.03])
@pytest.mark.parametrize("seed", range(3))
def test_a_speed_that_tells_a_sixth_of_its_noise_is_known_for_it(mu: float, seed: int) -> None:
    times, truth, places = braked_run(mu, seed, 30.0)
    shown = truth[:, 1] + 0.3 * np.random.default_rng(seed + 100).standard_normal(times.size)
    measured = [
        each._replace(speeds=(SpeedSample(each.t_ns, float(v), 0.05**2),))
        for each, v in zip(measurements(times, places, 0.3), shown, strict=True)
    ]
    found = Run(times, truth[:, 1], *followed(measured))
    assert_known(found, mu, 9.0, 25.0)
    assert found.state.memory is not None
    assert learnt(found.state.memory)["speed_scatter"] == pytest.approx(0.3, rel=0.4)
    assert "acceleration_scatter" not in learnt(found.state.memory)


@pytest.mark.parametrize("mu", [0.3, 0.06, 0.03])
@pytest.mark.parametrize("seed", range(3))
def test_an_accelerometer_that_is_shaken_is_known_for_it(mu: float, seed: int) -> None:
    """By 0.5 m/s^2 at 5.3 Hz, as the floor of a coach is, and told as one of 0.05."""
    times, truth, places = braked_run(mu, seed, 30.0)
    felt = np.gradient(truth[:, 1], H) + 0.5 * np.sin(2.0 * np.pi * 5.3 * times + seed)
    measured = [
        each._replace(imu=(ImuSample(each.t_ns, float(a), 0.05**2),))
        for each, a in zip(measurements(times, places, 0.3), felt, strict=True)
    ]
    assert_known(Run(times, truth[:, 1], *followed(measured)), mu, 9.0, 25.0)
