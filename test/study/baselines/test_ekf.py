# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The baseline EKF: its derivative, its equality with a textbook filter, the kink, and what it drops."""

from __future__ import annotations

import numpy as np
import pytest
from oracles import Linear, ride

from adhesion_node.core import Config, Estimate, Measurement, Regime
from adhesion_node.core.physics.train import Train
from adhesion_node.study.baselines.ekf import NAIVE, TUNED, Tuning, ekf, filter_rides, jacobian, ride_of

BRAKE = 0.0952


def _run(config: Config, measurements: list[Measurement], tuning: Tuning = TUNED) -> list[Estimate]:
    return ekf(config, tuning, [config.start_mu], [ride_of(config, measurements)])[0]


@pytest.mark.parametrize("mu", [0.07, 0.12])
def test_jacobian_is_the_derivative_of_the_step(mu: float) -> None:
    config, mean, small = Config(), np.array([100.0, 70.0, mu]), 1e-5

    def step(x: np.ndarray) -> np.ndarray:
        return np.array([*config.motion.advance(x[0], x[1], 0.1, BRAKE, x[2]), x[2]])

    columns = [(step(mean + d) - step(mean - d)) / (2 * small) for d in small * np.eye(3)]
    slope = jacobian(config, mean[None], np.array([0.1]), np.array([BRAKE]))[0]
    np.testing.assert_allclose(slope, np.array(columns).T, atol=1e-7)


def test_equals_the_textbook_filter_where_the_train_is_linear() -> None:
    model = Linear(c0=0.8, c1=0.006)
    train = Train(resistance_c0=0.8, resistance_c1=0.006, resistance_c2=0.0)
    config, tuning = Config(train=train, start_mu=0.06), Tuning(0.02, 1e-3)
    measurements = ride([(1.0, 0.0), (10.0, 410e3)], mu=0.07, seed=3)
    filtered = filter_rides(config, tuning, [config.start_mu], [ride_of(config, measurements)])
    mean, covariance = filtered.mean[10, 0], filtered.covariance[10, 0]  # the last of the cruising
    a = np.eye(3)
    a[:2, :2] = model.matrix(0.1)
    a[:2, 2] = model.push(0.1, 1.0) - model.push(0.1, 0.0)
    noise = np.diag([*np.diag(model.noise(0.1)), 1e-6])
    for measurement in measurements[11:]:
        mean = a @ mean + np.append(model.push(0.1, 0.0), 0.0)
        covariance = a @ covariance @ a.T + noise
        gain = covariance[:, 0] / (covariance[0, 0] + 0.25)
        mean = mean + gain * (measurement.position_m - mean[0])
        covariance = covariance - np.outer(gain, covariance[0])
        assert 0.0 < mean[2] < BRAKE  # else the core's kink is at work and the comparison void
    np.testing.assert_allclose(filtered.mean[-1, 0], mean, rtol=1e-9)
    np.testing.assert_allclose(filtered.covariance[-1, 0], covariance, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("start_mu", [0.0, 0.05, 0.12])
def test_finds_a_constant_adhesion_from_every_start(start_mu: float) -> None:
    measurements = ride([(20.0, 0.0), (40.0, 410e3)], mu=0.0726, speed_mps=83.0, seed=1)
    estimates = _run(Config(start_mu=start_mu), measurements)
    assert {e.regime for e in estimates if e.t_ns < 19e9} == {Regime.COASTING}
    late = [e for e in estimates if e.t_ns > 40e9]
    assert np.mean([abs(e.mu - 0.0726) for e in late]) < 0.003
    assert np.mean([e.regime is Regime.ADHESION_LIMITED for e in late]) > 0.9
    assert all(0.0 <= e.mu_lower <= e.mu for e in estimates)
    assert late[-1].speed_mps == pytest.approx(83.0 - 9.8 * 0.0726 * 40.0, rel=0.1)


def test_the_brakes_limit_is_all_that_a_good_rail_shows() -> None:
    measurements = ride([(20.0, 0.0), (30.0, 410e3)], mu=0.15, speed_mps=83.0, seed=1)
    estimates = _run(Config(), measurements)
    late = [e for e in estimates if e.t_ns > 35e9]
    assert all(e.mu <= BRAKE + 1e-4 for e in late)
    assert np.mean([e.regime is Regime.BRAKE_LIMITED for e in late]) > 0.8


def test_a_fast_walk_is_noisier() -> None:
    measurements = ride([(20.0, 0.0), (40.0, 410e3)], mu=0.0726, speed_mps=83.0, seed=2)
    errors = []
    for tuning in (TUNED, NAIVE):
        estimates = _run(Config(), measurements, tuning)
        errors.append(np.mean([abs(e.mu - 0.0726) for e in estimates if e.t_ns > 30e9]))
    assert errors[1] > 3 * errors[0]


def test_drops_what_is_invalid_or_not_newer() -> None:
    config, measurements = Config(step=1), ride([(3.0, 0.0)], seed=1)
    last = measurements[15]
    bad = [last, replace_position(last, float("nan")), last._replace(t_ns=0)]
    assert _run(config, [*measurements[:16], *bad, *measurements[16:]]) == _run(config, measurements)


def test_rides_side_by_side_are_those_one_by_one() -> None:
    """Of different lengths, starts and brakes."""
    config = Config()
    rides = [ride([(cruise, 0.0), (lasts, 410e3)], seed=1) for cruise, lasts in ((2.0, 9.0), (5.0, 3.0), (1.0, 15.0))]
    starts = [0.0, 0.05, 0.12]
    together = ekf(config, TUNED, starts, [ride_of(config, measurements) for measurements in rides])
    for start, measurements, found in zip(starts, rides, together, strict=True):
        assert found == _run(Config(start_mu=start), measurements)
    assert len({len(found) for found in together}) == 3


def replace_position(measurement: Measurement, position_m: float) -> Measurement:
    return measurement._replace(t_ns=measurement.t_ns + 10**8, position_m=position_m)


def test_an_estimate_every_l_measurements() -> None:
    config = Config(step=7)
    estimates = _run(config, ride([(5.0, 0.0), (5.0, 410e3)], seed=1))
    assert [e.t_ns for e in estimates] == [round(0.1e9 * (7 * i + 6)) for i in range(14)]


def test_tuning_names_the_value_that_is_out_of_range() -> None:
    with pytest.raises(ValueError, match=r"ekf\.mu_noise = -1"):
        Tuning(mu_noise=-1.0)
