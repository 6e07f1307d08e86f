# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""The estimator where positions are few, fail to come for a while, or never come."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from oracles import ride, specific_resistance

from adhesion_node.core import Config, Measurement, Outcome, PositionSample, PressureSample, Sample, SpeedSample
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.pipeline import Pipeline

S = 10**9
MU, G = 0.0726, 9.8
RIDE = ride([(8.0, 0.0), (20.0, 410e3), (5.0, 0.0)], mu=MU)
METHODS = ["rail_condition", "particle_em"]


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
    out = [each for each in estimates if 15.5 * S <= each.t_ns <= 25 * S]
    assert all(b.position_std_m >= a.position_std_m for a, b in pairwise(out))
    truth = true_speeds()
    assert all(abs(e.speed_mps - truth[e.t_ns // (S // 10)]) < 4 * e.speed_std_mps for e in out)
    assert (pipeline.dropped, pipeline.resets) == ({}, 0)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("method", METHODS)
def test_a_doppler_speed_alone_is_enough_to_run(method: str) -> None:
    pipeline, predictions = replayed(
        Config(method=method, speed_source="doppler", iterations=10), stream(lambda _k: False, 0.0025)
    )
    assert_finite(predictions)
    estimates = [each.estimate for each in predictions]
    assert max(b.t_ns - a.t_ns for a, b in pairwise(estimates)) <= S
    assert all(each.position_std_m > 5000.0 for each in estimates)
    (late,) = [each for each in estimates if each.t_ns == 25 * S]
    assert late.mu == pytest.approx(MU, rel=0.1)
    assert late.speed_mps == pytest.approx(true_speeds()[250], abs=0.3)
    assert pipeline.dropped == {}


@pytest.mark.parametrize("far_m", [0.0, 400_000.0])
def test_the_first_position_places_a_train_known_by_its_speed(far_m: float) -> None:
    samples = [
        s._replace(position_m=s.position_m + far_m) if isinstance(s, PositionSample) else s
        for s in stream(lambda k: k >= 60, 0.01)
    ]
    pipeline, predictions = replayed(Config(speed_source="doppler", iterations=10), samples)
    assert (pipeline.dropped, pipeline.resets) == ({}, 0)
    first = next(each.estimate for each in predictions if each.estimate.t_ns > 7 * S)
    assert first.position_m - far_m == pytest.approx(80.0 * first.t_ns / S, abs=3.0)
    assert first.speed_std_mps < 0.2


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
    assert stds[0] == stds[1] < 0.5 * stds[2]


@pytest.mark.parametrize(
    "changes", [{"position_m": math.nan}, {"speeds": (SpeedSample(0, 30.0),)}, {"speed_mps": 30.0}, {}]
)
def test_a_measurement_without_a_position_is_valid_and_its_place_says_nothing(changes: dict[str, Any]) -> None:
    pipeline = Pipeline(Config(), 1)
    for k in range(20):
        position, variance = (0.0, math.inf) if k % 2 else (3.0 * k, 1.0)
        pipeline.push(Measurement(k * S // 10, position, variance)._replace(**changes if k % 2 else {}))
    assert pipeline.dropped == {}
    assert pipeline.state.counts[Outcome.ACCEPTED] == 20
    assert pipeline.last is not None
    assert math.isfinite(pipeline.last.position_m)


@pytest.mark.parametrize("bad", [{"speeds": (SpeedSample(0, math.nan),)}, {"speeds": (SpeedSample(0, 9.0, 0.0),)}])
def test_a_sample_beside_it_that_is_none_makes_it_invalid(bad: dict[str, Any]) -> None:
    assert not Measurement(0, 0.0, math.inf)._replace(**bad).is_valid()
