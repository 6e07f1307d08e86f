# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The braking curves of an estimate: the safe one never shorter, the track ahead counted, none without a brake."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from windowed import windowed

from adhesion_node.core import Config, Estimate, Regime
from adhesion_node.core.bank.findings.ahead import NOTHING, Ahead
from adhesion_node.core.physics.adhesion import WET
from adhesion_node.core.physics.track import Grade, Track, Tunnel
from adhesion_node.core.physics.train import Train
from adhesion_node.core.prediction import predict

G = 9.8
FREE = Train(resistance_c0=0.0, resistance_c1=0.0, resistance_c2=0.0)
"""Rolls without resistance, so that v^2/(2 a) is exact."""


def estimate(mu: float = 0.08, lower: float = 0.05, position_m: float = 0.0, speed_mps: float = 60.0) -> Estimate:
    return Estimate(10**9, mu, 0.01, lower, Regime.ADHESION_LIMITED, position_m, speed_mps, 0.1, 0.1)


def config(*sections: Grade | Tunnel) -> Config:
    return windowed(train=FREE, track=Track(sections))


@pytest.mark.parametrize("speed_mps", [1.0, 30.0, 83.0])
def test_both_curves_are_the_closed_form(speed_mps: float) -> None:
    given = estimate(speed_mps=speed_mps)
    prediction = predict(config(), given)
    assert prediction.estimate is given
    assert prediction.safe is not None
    assert prediction.nominal is not None
    for curve, mu in ((prediction.safe, 0.05), (prediction.nominal, 0.08)):
        assert curve.speed_mps[0] == speed_mps
        assert curve.speed_mps[-1] == 0.0
        assert curve.distance_m[-1] == pytest.approx(speed_mps**2 / (2 * mu * G))
        assert curve.time_s[-1] == pytest.approx(speed_mps / (mu * G))
        assert curve.deceleration_mps2 == pytest.approx(mu * G)


@pytest.mark.parametrize(("mu", "lower"), [(0.08, 0.08), (0.08, 0.0799), (0.2, 0.05), (0.2, 0.15), (0.03, 0.0)])
@pytest.mark.parametrize("train", [Train(), Train(rotating_mass_fraction=0.1)], ids=["CRH3", "rotating"])
def test_the_safe_curve_is_nowhere_shorter(mu: float, lower: float, train: Train) -> None:
    prediction = predict(Config(train=train), estimate(mu, lower))
    assert prediction.safe is not None
    assert prediction.nominal is not None
    assert np.array_equal(prediction.safe.speed_mps, prediction.nominal.speed_mps)
    assert np.all(prediction.safe.distance_m >= prediction.nominal.distance_m)
    assert np.all(prediction.safe.time_s >= prediction.nominal.time_s)


def test_more_adhesion_than_the_brake_uses_gives_no_shorter_curve() -> None:
    prediction = predict(config(), estimate(mu=0.3, lower=0.2))
    brake = 0.9332 / G  # model.md: B/M = 0.9332 m/s^2
    assert prediction.nominal is not None
    assert prediction.safe is not None
    assert prediction.nominal.distance_m[-1] == pytest.approx(60.0**2 / (2 * brake * G), rel=1e-4)
    assert np.array_equal(prediction.safe.distance_m, prediction.nominal.distance_m)


def test_the_least_resistance_on_the_way_counts() -> None:
    """At 1000 m: uphill behind and here, level further on, then 4 permille down with a tunnel that overlaps it."""
    sections = (
        Grade(-1000.0, 0.0, -20.0),
        Grade(0.0, 1500.0, 15.0),
        Grade(5000.0, 7000.0, -8.0),
        Tunnel(6000.0, 8000.0),
    )
    for position_m, least in ((-500.0, -0.02), (1000.0, -0.004), (6999.0, -0.004 + 0.00026), (9e3, 0.0)):
        prediction = predict(config(*sections), estimate(position_m=position_m))
        assert prediction.safe is not None
        assert prediction.safe.deceleration_mps2 == pytest.approx((0.05 + least) * G), position_m


@pytest.mark.parametrize(("begins_m", "least"), [(7250.0, -0.004), (7290.0, 0.0)])
def test_a_fall_counts_that_begins_on_the_way_or_within_a_minute_of_travel(begins_m: float, least: float) -> None:
    """On the level 60^2 / (2 0.05 9.8) = 3673 m, and 60 s at 60 m/s."""
    prediction = predict(config(Grade(begins_m, begins_m + 2000.0, -8.0)), estimate())
    assert prediction.safe is not None
    assert prediction.safe.deceleration_mps2 == pytest.approx((0.05 + least) * G)


@pytest.mark.parametrize("seed", range(8))
def test_wherever_in_a_minute_the_brake_is_applied_the_train_stops_within_the_curve(seed: int) -> None:
    """On random hills; the oracle steps along the true grade under a train of 200 m, by 1 m."""
    rng = np.random.default_rng(seed)
    ends = np.concatenate([[-1e3], np.cumsum(rng.uniform(100.0, 3e3, 20))])
    rises = rng.uniform(-0.03, 0.02, 20) * np.diff(ends)
    heights = np.concatenate([[0.0], np.cumsum(rises)])
    given = config(*(Grade(*map(float, one)) for one in zip(ends[:-1], ends[1:], rises, strict=True)))
    prediction = predict(given, estimate(lower=0.05, position_m=500.0, speed_mps=40.0))
    assert prediction.safe is not None
    for begins_m in rng.uniform(500.0, 500.0 + 60.0 * 40.0, 5):
        place, squared = float(begins_m), 40.0**2
        while squared > 0.0:
            front, rear = np.interp([place, place - 200.0], ends, heights)
            squared -= 2.0 * G * (0.05 + (front - rear) / 200.0)
            place += 1.0
        assert place - begins_m <= prediction.safe.distance_m[-1] + 1.0


@pytest.mark.parametrize(("std_m", "least"), [(0.1, 0.0), (4e3, 0.0), (5e3, -0.01)])
@pytest.mark.parametrize("begins_m", [20e3, -20e3])
def test_every_fall_counts_that_may_be_where_the_train_is(begins_m: float, std_m: float, least: float) -> None:
    """Three standard deviations, ahead of them a minute of travel and the way: 3600 m and 3673 m."""
    fall = config(Grade(begins_m, begins_m + 6e3, -60.0))
    prediction = predict(fall, estimate()._replace(position_std_m=std_m))
    assert prediction.safe is not None
    assert prediction.safe.deceleration_mps2 == pytest.approx((0.05 + least) * G)


def test_an_uphill_end_of_the_line_is_counted_on_only_when_it_lies_everywhere_ahead() -> None:
    prediction = predict(config(Grade(0.0, 2000.0, 20.0)), estimate(position_m=500.0))
    assert prediction.nominal is not None
    assert prediction.nominal.deceleration_mps2 == pytest.approx(0.08 * G)  # level beyond 2000 m


def test_a_downgrade_stronger_than_the_brake_has_no_curve() -> None:
    steep = config(Grade(3000.0, 5000.0, -120.0))  # 60 permille
    prediction = predict(steep, estimate(mu=0.08, lower=0.05))
    assert prediction.safe is None
    assert prediction.nominal is not None
    assert prediction.nominal.deceleration_mps2 == pytest.approx(0.02 * G)
    assert predict(steep, estimate(mu=0.06, lower=0.05))[1:3] == (None, None)
    assert predict(steep, estimate(mu=0.06, lower=0.05, position_m=5200.0)).safe is not None


def test_without_any_adhesion_the_resistance_alone_brakes() -> None:
    assert predict(config(), estimate(mu=0.0, lower=0.0))[1:3] == (None, None)
    rolling = predict(Config(), estimate(mu=0.0, lower=0.0, speed_mps=1.0))
    assert rolling.safe is not None
    assert rolling.safe.deceleration_mps2[-1] == pytest.approx(0.79e-3 * G)


def test_a_train_at_rest_has_curves_of_no_length() -> None:
    prediction = predict(config(), estimate(speed_mps=0.0))
    assert prediction.safe is not None
    assert prediction.safe.distance_m[-1] == prediction.safe.time_s[-1] == 0.0


def test_an_uncertain_brake_lowers_the_safe_curve_alone() -> None:
    certain, uncertain = (predict(replace(config(), brake_std=std), estimate(0.2, 0.15)) for std in (0.0, 0.05))
    assert certain.safe is not None
    assert uncertain.safe is not None
    assert uncertain.nominal is not None
    brake = 0.9332  # model.md: B/M, m/s^2
    assert certain.safe.deceleration_mps2 == pytest.approx(brake, rel=1e-4)
    assert uncertain.safe.deceleration_mps2 == pytest.approx(brake * (1.0 - 1.644854 * 0.05), rel=1e-4)
    assert uncertain.nominal.deceleration_mps2 == pytest.approx(brake, rel=1e-4)
    # an adhesion below even the weak brake is used in full
    sliding = predict(replace(config(), brake_std=0.05), estimate(0.08, 0.05)).safe
    assert sliding is not None
    assert sliding.deceleration_mps2 == pytest.approx(0.05 * G)


def test_of_a_brake_that_nothing_is_known_of_the_safe_curve_counts_on_nearly_none() -> None:
    known, unknown = (predict(replace(config(), brake_std=std), estimate(0.2, 0.15)).safe for std in (0.0, 1.0))
    assert known is not None
    assert unknown is not None
    assert 0.0 < unknown.deceleration_mps2[0] < 0.1 * known.deceleration_mps2[0]


def test_the_nominal_curve_follows_the_identified_law() -> None:
    """By quadrature of v dv/a on 0.8 times the wet law, the brake's limit included; the safe one stays at its bound."""
    mu = 0.8 * (0.04 + 13.7 / (120.0 + 3.6 * 60.0))
    prediction = predict(config(), estimate(mu, 0.05)._replace(shape=WET))
    assert prediction.nominal is not None
    assert prediction.safe is not None
    distance, _ = quad(lambda v: v / (G * min(0.8 * (0.04 + 13.7 / (120.0 + 3.6 * v)), 0.9332 / G)), 0.0, 60.0)
    assert prediction.nominal.distance_m[-1] == pytest.approx(distance, rel=1e-3)
    assert prediction.nominal.distance_m[-1] < 60.0**2 / (2.0 * mu * G)
    assert prediction.safe.distance_m[-1] == pytest.approx(60.0**2 / (2.0 * 0.05 * G))


@pytest.mark.parametrize("slope", [-0.01, 0.0, 0.02])
def test_who_may_be_eight_times_as_fast_has_the_way_of_that_train_on_any_grade(slope: float) -> None:
    """Uphill it was the way of the slow one: what the grade gives was counted whole."""
    given = estimate(speed_mps=2.0)._replace(ahead=Ahead((0.0,), (NOTHING,), 0.03, 1.0 / 64.0))
    safe = predict(config(Grade(-1e5, 1e5, 2e5 * slope)), given).safe
    assert safe is not None
    assert safe.distance_m[-1] == pytest.approx(16.0**2 / (2.0 * G * (0.03 + slope)), rel=1e-3)
    assert (safe.speed_mps[0], safe.speed_mps[-1]) == (2.0, 0.0)


def test_the_fastest_train_uses_no_more_than_its_brake_does() -> None:
    """With rotating masses the limit of the brake took away what had been left for the fastest train."""
    train = Train(rotating_mass_fraction=0.08, resistance_c0=0.0, resistance_c1=0.0, resistance_c2=0.0)
    given = estimate(speed_mps=10.0)._replace(ahead=Ahead((0.0,), (NOTHING,), train.full_brake, 0.16))
    safe = predict(windowed(train=train), given).safe
    assert safe is not None
    assert safe.distance_m[-1] == pytest.approx(25.0**2 / (2.0 * G * train.full_brake / 1.08), rel=1e-3)


@pytest.mark.parametrize("slope", [0.0, 0.02])
def test_no_less_is_counted_on_than_the_floor_of_the_fastest_train(slope: float) -> None:
    given = estimate(speed_mps=20.0)._replace(ahead=Ahead((0.0,), (0.01,), 0.05, 0.5))
    safe = predict(config(Grade(-1e5, 1e5, 2e5 * slope)), given).safe
    assert safe is not None
    slowing = max(0.01 + slope, 0.5 * (0.05 + slope))
    assert safe.distance_m[-1] == pytest.approx(20.0**2 / (2.0 * G * slowing), rel=1e-3)
