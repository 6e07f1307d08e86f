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

from adhesion_node.core import ImuSample, Outcome, SpeedSample
from adhesion_node.core.bank.findings.learnt import learnt
from adhesion_node.core.bank.labels.noises import NOISES, of_receiver
from adhesion_node.core.bank.sensors.scatter import FAR, LASTING, PLACE_FAR, Coloured, Scatter

H = 0.1


def scatter_of(values: np.ndarray, told: float, rate_hz: float = 10.0, far: float = FAR) -> Scatter:
    scatter = Scatter()
    for index, value in enumerate(values):
        scatter = scatter.after(S + round(index / rate_hz * S), float(value), told, far=far)
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


@pytest.mark.parametrize("seed", range(5))
def test_positions_scatter_by_their_noise_and_not_by_outliers(seed: int) -> None:
    """At 40 m/s; one of twenty is off by 20 m, and stands beside two others."""
    rng, times = np.random.default_rng(seed), np.arange(0.0, 60.0, H)
    places = 40.0 * times + 0.5 * rng.standard_normal(times.size)
    outliers = places + 20.0 * rng.standard_normal(times.size) * (rng.random(times.size) < 0.05)
    assert scatter_of(outliers, 0.5**2, far=PLACE_FAR).variance_of(0.5**2) < 2.0**2 * 0.5**2
    assert scatter_of(places, 0.1**2, far=PLACE_FAR).variance_of(0.1**2) == pytest.approx(0.5**2, rel=0.6)


def test_samples_apart_or_back_in_time_tell_nothing() -> None:
    scatter = Scatter()
    for t_ns, value in ((0, 0.0), (3 * S, 9.0), (6 * S, 0.0), (5 * S, 9.0), (5 * S, 0.0), (9 * S, 9.0)):
        scatter = scatter.after(t_ns, value, 1e-4)
    assert scatter.samples == 0


@pytest.mark.parametrize("hertz", [1.2, 0.7])
def test_an_accelerometer_that_bounces_slowly_is_told_by_its_seconds(hertz: float) -> None:
    """As the body of a coach does; from sample to sample it seems to be sure."""
    told, shaking = 0.01**2, Coloured()
    for index in range(600):
        t_s = H * index
        shaking = shaking.after(round(t_s * S), 0.2 * float(np.sin(2.0 * np.pi * hertz * t_s)), told, H, None)
    assert shaking.variance_of(told, H) > 20.0 * told  # of what comes and goes as much is left
    still = Coloured()
    for index in range(600):
        still = still.after(round(H * index * S), -0.02 if index > 300 else 0.01, told, H, None)
    assert still.variance_of(told, H) == told


def lasting(count: int, std: float, lasts_s: float, seed: int) -> np.ndarray:
    """A Gauss-Markov process, sampled every `H`."""
    kept, news = np.exp(-H / lasts_s), np.random.default_rng(seed).standard_normal(count)
    values = std * news
    for index in range(1, count):
        values[index] = kept * values[index - 1] + std * np.sqrt(1.0 - kept**2) * news[index]
    return np.asarray(values)


def coloured(values: np.ndarray, told: float, rate_hz: float = 10.0) -> Coloured:
    found = Coloured(LASTING)
    for index, value in enumerate(values):
        t_ns = round((1.0 + index / rate_hz) * S)
        found = found.after(t_ns, float(value), told, found.quick.since_s(t_ns), None)
    return found


@pytest.mark.parametrize("lasts_s", [0.5, 1.0])
@pytest.mark.parametrize("rate_hz", [4.0, 10.0])
def test_errors_that_last_weigh_as_much_white_noise_as_leaves_the_same_behind(rate_hz: float, lasts_s: float) -> None:
    """What lasts T, sampled every h, leaves as much in a mean as white noise of 2 T / h times its variance."""
    of = []
    for seed in range(5):
        errors = lasting(round(120 * rate_hz), 0.1, lasts_s * rate_hz * H, seed)
        of.append(coloured(errors, 0.05**2, rate_hz).variance_of(0.05**2, 1.0 / rate_hz))
    white = 0.1**2 * 2.0 * lasts_s * rate_hz
    assert 0.1 * white < np.mean(of) < 3.0 * white


@pytest.mark.parametrize("rate_hz", [1.0, 4.0, 10.0])
@pytest.mark.parametrize("seed", range(5))
def test_errors_that_do_not_last_weigh_what_they_are_told(rate_hz: float, seed: int) -> None:
    """Of a train that is driven: by 0.2 m/s^2 more or less every 5 s."""
    rng = np.random.default_rng(seed)
    notches = np.repeat(rng.choice([-0.1, 0.1], 24), round(5 * rate_hz))
    speeds = 40.0 + np.cumsum(notches) / rate_hz + 0.1 * rng.standard_normal(notches.size)
    assert coloured(speeds, 0.1**2, rate_hz).variance_of(0.1**2, 1.0 / rate_hz) == 0.1**2


@pytest.mark.parametrize("mu", [0.3, 0.06, 0.03])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("told_m", [0.2, 0.5])
def test_positions_that_tell_less_than_their_noise_are_known_for_it(told_m: float, seed: int, mu: float) -> None:
    """Of 2 m: they count as a receiver's, not as a sliding wheel's, once it is known how they scatter, after 2 s."""
    times, truth, places = braked_run(mu, seed, 30.0)
    shown = places + 2.0 * np.random.default_rng(seed + 100).standard_normal(times.size)
    found = Run(times, truth[:, 1], *followed(measurements(times, shown, told_m)))
    assert found.state.counts[Outcome.SLIDING] == 0
    assert found.state.counts[Outcome.RESET] <= 1
    assert found.state.memory is not None
    assert learnt(found.state.memory)["position_scatter"] == pytest.approx(2.0, rel=0.3)
    braked = [each for each in found.estimates if each.t_ns > 10 * S]
    assert all(abs(each.speed_mps - found.speed_at(each)) < 4.0 * each.speed_std_mps for each in braked)
    assert all(each.mu_lower < mu for each in braked)


@pytest.mark.parametrize(("told_m", "wanders_m", "white_m"), [(0.2, 2.0, 0.1), (3.0, 1.0, 0.05), (3.0, 2.0, 0.1)])
def test_a_receiver_may_wander_by_another_measure_than_it_declares(
    told_m: float, wanders_m: float, white_m: float
) -> None:
    """Over 30 s; 3 m stand for what declares nothing. The train runs on for 30 s before it brakes."""
    off, kept = list[float](), list[bool]()
    for seed in range(12):
        times, truth, _ = braked_run(0.03, seed, 40.0)
        before = np.arange(-30.0, 0.0, H)
        times = np.concatenate((before, times)) + 30.0
        places = np.concatenate((truth[0, 0] + truth[0, 1] * before, truth[:, 0]))
        speeds = np.concatenate((np.full(before.size, truth[0, 1]), truth[:, 1]))
        errors = lasting(times.size, wanders_m, 30.0, seed + 300)
        errors += white_m * np.random.default_rng(seed + 400).standard_normal(times.size)
        found = Run(times, speeds, *followed(measurements(times, places + errors, told_m)))
        braked = [each for each in found.estimates if each.t_ns > 42 * S]
        off += [(each.speed_mps - found.speed_at(each)) / each.speed_std_mps for each in braked]
        kept += [each.mu_lower < 0.03 for each in braked]
    assert np.mean(np.abs(off) < 3.0) > 0.99
    assert np.mean(kept) > 0.99


def test_what_satellites_do_is_no_twin_of_what_a_receiver_declares() -> None:
    own = {index: noise.stds_m(0.0) for index, noise in enumerate(NOISES) if not noise.white}
    quiet, near, far = (0.05, 1.0), (0.1, 1.0), (0.1, 2.0)
    for declared_m, of in ((0.2, {near, far}), (1.0, {near, far}), (2.0, {quiet, near}), (3.0, {quiet, near, far})):
        found = of_receiver(declared_m)
        assert {own[index] for index in found if index in own} == of
        assert set(range(len(NOISES))) - set(own) < set(found)


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


@pytest.mark.parametrize("lasts_s", [0.5, 1.0])
@pytest.mark.parametrize("mu", [0.3, 0.06, 0.03])
@pytest.mark.parametrize("seed", range(3))
def test_a_speed_whose_errors_last_is_known_for_it(mu: float, seed: int, lasts_s: float) -> None:
    """As a receiver's own filter leaves them, of 0.2 m/s, told as 0.05; the train brakes 5 s after it was met."""
    times, truth, places = braked_run(mu, seed, 60.0)
    shown = truth[:, 1] + lasting(times.size, 0.2, lasts_s, seed + 200)
    measured = [
        each._replace(speeds=(SpeedSample(each.t_ns, float(v), 0.05**2),))
        for each, v in zip(measurements(times, places, 0.3), shown, strict=True)
    ]
    found = Run(times, truth[:, 1], *followed(measured))
    assert_known(found, mu, 35.0, 50.0)


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
