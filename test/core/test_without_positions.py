# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The estimator where positions are few, fail to come for a while, or never come."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from oracles import ride, specific_resistance
from scipy.integrate import cumulative_trapezoid

from adhesion_node.core import (
    Config,
    Measurement,
    PositionSample,
    PressureSample,
    Sample,
    SpeedSample,
    WheelSample,
)
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.pipeline import Pipeline

S = 10**9
MU, G = 0.0726, 9.8
RIDE = ride([(8.0, 0.0), (20.0, 410e3), (5.0, 0.0)], mu=MU)
METHODS = ["bank", "rail_condition", "particle_em"]


def true_speeds() -> list[float]:
    """Of the ride, m/s, at every measurement."""
    speeds = [80.0]
    for m in RIDE[:-1]:
        v = speeds[-1]
        a = G * (MU + float(specific_resistance(np.array(v)))) if m.brake_pressure_pa else 0.0
        speeds.append(v - 0.1 * a)
    return speeds


def stream(has_position: Callable[[int], bool], speed_variance: float | None) -> list[Sample]:
    """The ride's samples; `has_position` tells by the index, no speed without its variance."""
    rng, samples = np.random.default_rng(3), list[Sample]()
    for index, (m, v) in enumerate(zip(RIDE, true_speeds(), strict=True)):
        samples.append(PressureSample(m.t_ns, m.brake_pressure_pa or 0.0))
        if speed_variance is not None:
            noisy = v + math.sqrt(speed_variance) * float(rng.standard_normal())
            samples.append(SpeedSample(m.t_ns, noisy, speed_variance))
        if has_position(index):
            samples.append(PositionSample(*m[:3]))
    return samples


def replayed(config: Config, samples: list[Sample]) -> tuple[Pipeline, list[Prediction]]:
    pipeline = Pipeline(config, 1)
    predictions = [each for sample in samples for each in pipeline.push(sample)]
    return pipeline, predictions + pipeline.finish()


def assert_finite(predictions: list[Prediction]) -> None:
    for each in predictions:
        assert all(math.isfinite(value) for value in each.estimate if isinstance(value, float)), each.estimate


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("speed_variance", [None, 0.01])
def test_an_outage_of_the_positions_is_gone_through(method: str, speed_variance: float | None) -> None:
    """10 s within a braking: estimates go on, their position grows uncertain, and the speed stays in its interval."""
    config = Config(method=method, speed_source="doppler", iterations=10)
    pipeline, predictions = replayed(config, stream(lambda k: not 150 <= k < 250, speed_variance))
    assert_finite(predictions)
    estimates = [each.estimate for each in predictions]
    assert max(b.t_ns - a.t_ns for a, b in pairwise(estimates)) <= S
    out = [each for each in estimates if 15.5 * S <= each.t_ns < 25 * S]
    assert all(b.position_std_m >= a.position_std_m for a, b in pairwise(out))
    truth = true_speeds()
    assert all(abs(e.speed_mps - truth[e.t_ns // (S // 10)]) < 4 * e.speed_std_mps for e in out)
    assert (pipeline.dropped, pipeline.resets) == ({}, 0)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("method", METHODS)
def test_a_doppler_speed_alone_is_enough_to_run(method: str) -> None:
    pipeline, predictions = replayed(
        Config(method=method, speed_source="doppler", iterations=10, tick_s=0.5), stream(lambda _k: False, 0.0025)
    )
    assert_finite(predictions)
    estimates = [each.estimate for each in predictions]
    assert max(b.t_ns - a.t_ns for a, b in pairwise(estimates)) <= S
    assert all(each.position_std_m > 5000.0 for each in estimates)
    (late,) = [each for each in estimates if each.t_ns == 25 * S]
    assert late.mu == pytest.approx(MU, rel=0.1)
    assert late.speed_mps == pytest.approx(true_speeds()[250], abs=0.3)
    assert pipeline.dropped == {}


def ways_m(speeds: Sequence[float], mu: float) -> list[float]:
    """From speeds to a standstill on adhesion `mu`, by steps of the speed."""
    fine = np.linspace(0.0, max(speeds), 4000)
    way = cumulative_trapezoid(fine / (G * (mu + specific_resistance(fine))), fine, initial=0.0)
    return [float(each) for each in np.interp(speeds, fine, way)]


@pytest.mark.parametrize("placed", [False, True])
def test_a_speed_that_is_lost_makes_the_curve_longer_and_no_right_speed_one_in_kmh(placed: bool) -> None:
    """Axles under the brake tell nothing, positions come no more: from 45 m/s on 0.03 it is soon told as 14 m/s."""
    mu, run = 0.03, ride([(20.0, 0.0), (60.0, 410e3)], mu=0.03, speed_mps=45.0)
    speeds = [45.0]
    for m in run[:-1]:
        slowing = G * (mu + float(specific_resistance(np.array(speeds[-1])))) if m.brake_pressure_pa else 0.0
        speeds.append(speeds[-1] - 0.1 * slowing)
    samples = list[Sample]()
    for m, speed in zip(run, speeds, strict=True):
        samples += [PressureSample(m.t_ns, m.brake_pressure_pa or 0.0), SpeedSample(m.t_ns, speed)]
        samples += [PositionSample(*m[:3])] if placed and m.t_ns < 19 * S else []
    pipeline, predictions = replayed(Config(), samples)
    assert_finite(predictions)
    assert pipeline.dropped == {}
    braked = [each for each in predictions if each.estimate.t_ns > 22 * S]
    ways = ways_m([speeds[each.estimate.t_ns // (S // 10)] for each in braked], mu)
    assert len(braked) > 100
    assert min(each.estimate.speed_mps / speeds[each.estimate.t_ns // (S // 10)] for each in braked) < 0.6, "it is lost"
    assert all(each.safe is None or each.safe.distance_m[-1] >= way for each, way in zip(braked, ways, strict=True))


def test_a_train_of_which_nothing_is_heard_does_not_run_back() -> None:
    """Positions end where it slows below 2 m/s, as under a roof; it stands, the brake applied."""
    phases: list[tuple[float, float | None]] = [(20.0, 0.0), (150.0, 410e3)]
    samples = list[Sample]()
    run, true_way = (ride(phases, mu=0.07, speed_mps=45.0, sigma_m=sigma_m) for sigma_m in (0.5, 1e-9))
    for m, place, later in zip(run, true_way, true_way[1:], strict=False):
        samples += [PressureSample(m.t_ns, m.brake_pressure_pa or 0.0)]
        samples += [PositionSample(*m[:3])] if later.position_m - place.position_m > 0.2 else []
    pipeline, predictions = replayed(Config(), samples)
    assert len(predictions) > 200
    assert pipeline.back_m == 0.0


@pytest.mark.parametrize("far_m", [0.0, 400_000.0])
def test_the_first_position_places_a_train_known_by_its_speed(far_m: float) -> None:
    samples = [
        s._replace(position_m=s.position_m + far_m) if isinstance(s, PositionSample) else s
        for s in stream(lambda k: k >= 60, 0.01)
    ]
    pipeline, predictions = replayed(Config(speed_source="doppler", iterations=10, speed_scale_std=0.005), samples)
    assert (pipeline.dropped, pipeline.resets) == ({}, 0)
    first = next(each.estimate for each in predictions if each.estimate.t_ns > 7 * S)
    assert first.position_m - far_m == pytest.approx(80.0 * first.t_ns / S, abs=3.0)
    assert first.speed_std_mps < 0.3  # the scale of the speeds is known to 0.5 %


@pytest.mark.parametrize("method", METHODS)
def test_positions_of_1_hz_lead_to_the_adhesion(method: str) -> None:
    _, predictions = replayed(Config(method=method, iterations=10), stream(lambda k: k % 10 == 0, None))
    assert_finite(predictions)
    estimates = [each.estimate for each in predictions]
    assert max(b.t_ns - a.t_ns for a, b in pairwise(estimates)) <= S
    assert next(each.mu for each in estimates if each.t_ns > 24 * S) == pytest.approx(MU, rel=0.1)


@pytest.mark.parametrize("source", ["axle", "doppler", "radar"])
def test_a_braked_axle_says_nothing_doppler_and_radar_do(source: str) -> None:
    with_it = replayed(Config(speed_source=source, iterations=5), stream(lambda _k: True, 0.01))[1]
    without = replayed(Config(iterations=5), stream(lambda _k: True, None))[1]
    stds = [[e.estimate.speed_std_mps for e in run if 20 * S < e.estimate.t_ns < 28 * S] for run in (with_it, without)]
    assert (np.mean(stds[0]) < 0.9 * np.mean(stds[1])) == (source != "axle")


def test_the_variance_that_a_speed_tells_is_used_and_else_the_setting() -> None:
    stds = []
    for variance, setting in ((0.01, 5.0), (None, 0.1), (None, 5.0)):
        samples: list[Sample] = [
            sample._replace(variance=variance) if isinstance(sample, SpeedSample) else sample
            for sample in stream(lambda _k: True, 0.01)[:240]
        ]
        stds.append(replayed(Config(speed_std_mps=setting, iterations=5), samples)[1][-1].estimate.speed_std_mps)
    assert stds[0] == pytest.approx(stds[1])
    assert stds[1] < 0.5 * stds[2]


@pytest.mark.parametrize(
    "changes", [{"position_m": math.nan}, {"speeds": (SpeedSample(0, 30.0),)}, {"speed_mps": 30.0}, {}]
)
def test_a_measurement_without_a_position_is_valid_and_its_place_says_nothing(changes: dict[str, Any]) -> None:
    pipeline = Pipeline(Config(), 1)
    for k in range(20):
        position, variance = (0.0, math.inf) if k % 2 else (3.0 * k, 1.0)
        pipeline.push(Measurement(k * S // 10, position, variance)._replace(**changes if k % 2 else {}))
    assert pipeline.dropped == {}
    assert (pipeline.accepted, pipeline.ticks) == (10, 10)
    assert pipeline.last is not None
    assert math.isfinite(pipeline.last.position_m)


@pytest.mark.parametrize("bad", [{"speeds": (SpeedSample(0, math.nan),)}, {"speeds": (SpeedSample(0, 9.0, 0.0),)}])
def test_a_sample_beside_it_that_is_none_makes_it_invalid(bad: dict[str, Any]) -> None:
    assert not Measurement(0, 0.0, math.inf)._replace(**bad).is_valid()


@pytest.mark.parametrize("method", METHODS)
def test_no_order_of_arrival_changes_a_bit_through_outages(method: str) -> None:
    """Positions of 1 Hz with an outage of 6 s, speeds with one of 4 s, each sensor late by less than the wait."""
    rng, digests = np.random.default_rng(11), set()
    config = Config(method=method, speed_source="doppler", iterations=3)
    for turn in range(6):
        late_s = dict(
            zip((PressureSample, SpeedSample, PositionSample), rng.uniform(0, 0.19 * (turn > 0), 3), strict=True)
        )
        samples = [
            each
            for each in stream(lambda k: k % 10 == 0 and not 100 <= k < 160, 0.01)
            if not (isinstance(each, SpeedSample) and 14 * S <= each.t_ns < 18 * S)
        ]
        samples.sort(key=lambda each: each.t_ns * 1e-9 + late_s[type(each)])
        pipeline, _ = replayed(config, samples)
        digests.add(pipeline.digest)
        assert pipeline.dropped == {}
        assert pipeline.ticks >= 25
    assert len(digests) == 1


@pytest.mark.parametrize("dropped", [(0, 1), (2, 3), (0, 1, 2, 3)])
def test_a_bogie_that_drops_out_for_73_s_silences_nothing(dropped: tuple[int, ...]) -> None:
    pipeline, estimates = Pipeline(Config(iterations=3), 1), 0
    for k in range(1000):
        t_ns = k * S // 10
        axles = tuple(math.nan if axle in dropped and 100 <= k < 830 else 30.0 / 0.46 for axle in range(4))
        samples: list[Sample] = [
            PressureSample(t_ns, 0.0),
            WheelSample(t_ns, axles),
            PositionSample(t_ns, 3.0 * k, 0.25),
        ]
        for sample in samples:
            estimates += len(pipeline.push(sample))
    assert estimates >= 198
    assert pipeline.accepted >= 997
    assert pipeline.dropped == ({"INVALID": 730} if len(dropped) == 4 else {})
    assert pipeline.state.newest is not None
    assert len(pipeline.state.newest.wheels[-1].speeds_radps) == 4


@pytest.mark.parametrize("source", ["axle", "doppler"])
@pytest.mark.parametrize("mps", [20.0, 50.0])
@pytest.mark.parametrize(("first", "every"), [(0, 1), (50, 1), (50, 10)])
def test_a_speed_in_kmh_from_the_beginning_is_found_by_the_positions(
    source: str, mps: float, first: int, every: int
) -> None:
    """The estimate began with it; there was one reset after the other, and no speed without them."""
    pipeline, predictions = Pipeline(Config(speed_source=source, iterations=3), 1), list[Prediction]()
    rng = np.random.default_rng(2)
    for k in range(400):
        t_ns, position_m = k * S // 10, mps * k / 10 + 0.5 * float(rng.standard_normal())
        samples: list[Sample] = [PressureSample(t_ns, 0.0), SpeedSample(t_ns, 3.6 * mps)]
        if k >= first and k % every == 0:
            samples.append(PositionSample(t_ns, position_m, 0.25))
        predictions += [each for sample in samples for each in pipeline.push(sample)]
    assert pipeline.resets <= 1
    assert pipeline.dropped["SPEED_IN_KMH"] > 50
    late = [each.estimate for each in predictions if each.estimate.t_ns > 12 * S]
    assert len(late) > 25
    assert all(abs(each.speed_mps - mps) < 1.5 for each in late)
