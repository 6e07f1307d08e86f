# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The pipeline: every measurement accounted for, every published number the core's, the order of arrival no matter."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise

import pytest
from oracles import ride

from adhesion_node.core import Config, Measurement, finish, init, step
from adhesion_node.core.intake.samples import PositionSample, PressureSample, Sample, SpeedSample
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.pipeline import Pipeline

S = 10**9
FAST = Config(method="particle_em", iterations=3, particles=10, window=20, step=10)
"""EM that is quick rather than good."""


def pair(measurement: Measurement) -> tuple[PressureSample, PositionSample]:
    assert measurement.brake_pressure_pa is not None
    return PressureSample(measurement.t_ns, measurement.brake_pressure_pa), PositionSample(*measurement[:3])


def feed(pipeline: Pipeline, samples: Iterable[Sample]) -> list[Prediction]:
    return [prediction for sample in samples for prediction in pipeline.push(sample)]


def clean() -> list[Measurement]:
    """100 measurements: 6 s of cruising, then braking."""
    return ride([(6.0, 0.0), (4.0, 410e3)])


def shifted(measurements: list[Measurement], by_s: float) -> list[Measurement]:
    return [m._replace(t_ns=m.t_ns + round(by_s * S)) for m in measurements]


def pressures_first(measurements: list[Measurement]) -> list[Sample]:
    return [sample for m in measurements for sample in pair(m)]


def positions_first(measurements: list[Measurement]) -> list[Sample]:
    return [sample for m in measurements for sample in reversed(pair(m))]


def pressures_a_sample_late(measurements: list[Measurement]) -> list[Sample]:
    pairs = [pair(m) for m in measurements]
    late = [sample for (late, _), (_, position) in pairwise(pairs) for sample in (position, late)]
    return [pairs[0][1], *late, pairs[-1][0]]


def pressures_far_ahead(measurements: list[Measurement]) -> list[Sample]:
    pairs = [pair(m) for m in measurements]
    return [*(pressure for pressure, _ in pairs), *(position for _, position in pairs)]


def rough(measurements: list[Measurement]) -> Iterator[Sample]:
    """Yield the clean run's samples and, between them, 1 late, 2 duplicate, 3 invalid and 4 outlying positions."""
    for index, measurement in enumerate(measurements):
        pressure, position = pair(measurement)
        yield pressure
        yield position
        if index == 30:
            yield position._replace(t_ns=position.t_ns - 5 * S)
        if index in (40, 70):
            yield position._replace(position_m=position.position_m + 0.1)
        if index == 50:
            yield position._replace(t_ns=position.t_ns + S // 100, position_m=math.nan)
            yield position._replace(t_ns=position.t_ns + S // 50, variance_m2=-1.0)
            yield position._replace(t_ns=position.t_ns + S // 25, position_m=1e9)
        if index in (45, 60, 65, 80):
            yield position._replace(t_ns=position.t_ns + S // 20, position_m=position.position_m + 100.0)


@pytest.mark.parametrize("max_lag_s", [0.0, 0.5])
def test_every_position_is_accepted_or_dropped_for_a_reason(max_lag_s: float) -> None:
    measurements = clean()
    pipeline = Pipeline(Config(iterations=3, particles=10, max_lag_s=max_lag_s), 1)
    samples = list(rough(measurements))
    feed(pipeline, samples)
    positions = sum(isinstance(sample, PositionSample) for sample in samples)
    assert pipeline.measurements == positions == len(measurements) + 10
    pipeline.finish()
    assert pipeline.dropped == {"DUPLICATE": 2, "INVALID": 3, "LATE": 1, "OUTLIER": 4}
    assert pipeline.accepted == len(measurements)
    assert pipeline.measurements == positions == pipeline.accepted + sum(pipeline.dropped.values())


@pytest.mark.parametrize("max_lag_s", [0.0, 0.5])
@pytest.mark.parametrize("jump_s", [-30.0, 30.0, -100.0, 3600.0])
def test_a_jump_of_the_stamps_loses_no_position_unseen(jump_s: float, max_lag_s: float) -> None:
    twice = shifted(clean(), 200.0) + shifted(clean(), 200.0 + jump_s)
    pipeline = Pipeline(Config(iterations=3, particles=10, max_lag_s=max_lag_s), 1)
    feed(pipeline, pressures_first(twice))
    pipeline.finish()
    assert pipeline.measurements == pipeline.accepted + sum(pipeline.dropped.values()) == len(twice)


def test_what_waits_for_its_pressure_is_counted_at_the_end() -> None:
    """The last positions come without a pressure: they wait, and `finish` uses them."""
    measurements = clean()
    pipeline = Pipeline(FAST, 1)
    feed(pipeline, pressures_first(measurements[:-2]))
    feed(pipeline, [pair(m)[1] for m in measurements[-2:]])
    pipeline.finish()
    assert (pipeline.measurements, pipeline.accepted, pipeline.dropped) == (len(measurements), len(measurements), {})


def test_refused_messages_are_counted_by_reason() -> None:
    pipeline = Pipeline(FAST, 1)
    for topic, reason in (("position", "WRONG_FRAME"), ("position", "NOT_FINITE"), ("brake_pressure", "WRONG_FRAME")):
        pipeline.refuse(topic, reason)
    feed(pipeline, list(pair(clean()[0])))
    pipeline.finish()
    assert pipeline.dropped == {"NOT_FINITE": 1, "WRONG_FRAME": 2}
    assert (pipeline.measurements, pipeline.accepted) == (3, 1)  # a pressure is no measurement


def test_drops_change_no_result() -> None:
    measurements = clean()
    tidy, untidy = Pipeline(FAST, 1), Pipeline(FAST, 1)
    feed(tidy, pressures_first(measurements))
    feed(untidy, rough(measurements))
    assert tidy.windows > 2
    assert tidy.digest == untidy.digest


def test_it_publishes_what_the_core_estimates() -> None:
    """Against a plain loop over the core, without any pairing."""
    measurements = clean()[:-3]
    state, expected = init(FAST, 7), []
    for measurement in measurements:
        state, estimate = step(FAST, state, measurement)
        expected += [] if estimate is None else [estimate]
    expected += finish(FAST, state)[1]
    pipeline = Pipeline(FAST, 7)
    predictions = feed(pipeline, pressures_first(measurements)) + pipeline.finish()
    assert [prediction.estimate for prediction in predictions] == expected
    assert pipeline.last == expected[-1]
    assert pipeline.windows == sum(estimate.window > 0 for estimate in expected)
    assert 0 < pipeline.windows < len(expected)


@pytest.mark.parametrize("beyond", [1, 7, 9])
def test_finish_gives_the_last_short_window(beyond: int) -> None:
    measurements = clean()[: 90 + beyond]
    pipeline = Pipeline(FAST, 1)
    predictions = feed(pipeline, pressures_first(measurements))
    windows, digest = pipeline.windows, pipeline.digest
    assert predictions[-1].estimate.t_ns == measurements[89].t_ns
    (last,) = pipeline.finish()
    assert last.estimate.t_ns == measurements[-1].t_ns
    assert 0 < last.estimate.window <= FAST.window - FAST.step + beyond
    assert pipeline.windows == windows + 1
    assert pipeline.last == last.estimate
    assert pipeline.digest != digest


def test_finish_adds_nothing_after_a_full_step() -> None:
    pipeline = Pipeline(FAST, 1)
    feed(pipeline, pressures_first(clean()[:90]))
    digest = pipeline.digest
    assert pipeline.finish() == []
    assert pipeline.digest == digest


def test_an_unused_pipeline_has_nothing_to_say() -> None:
    pipeline = Pipeline(FAST, 1)
    assert pipeline.finish() == []
    assert (pipeline.measurements, pipeline.accepted, pipeline.dropped, pipeline.windows) == (0, 0, {}, 0)
    assert pipeline.last is None
    assert pipeline.digest == hashlib.sha256().hexdigest()


@pytest.mark.parametrize("start_s", [0.0, 1000.0])
@pytest.mark.parametrize("order", [positions_first, pressures_a_sample_late, pressures_far_ahead])
def test_the_order_of_arrival_between_the_streams_changes_no_bit(
    order: Callable[[list[Measurement]], list[Sample]], start_s: float
) -> None:
    measurements = shifted(clean()[:-4], start_s)
    agreed, other = Pipeline(FAST, 1), Pipeline(FAST, 1)
    for pipeline, samples in ((agreed, pressures_first(measurements)), (other, order(measurements))):
        feed(pipeline, samples)
        pipeline.finish()
        assert pipeline.accepted == len(measurements)
    assert agreed.digest == other.digest


def test_a_pressure_that_differs_gives_another_digest() -> None:
    measurements = clean()
    digests = set()
    for pressure_pa in (410e3, 200e3):
        pipeline = Pipeline(FAST, 1)
        changed = measurements[:80] + [m._replace(brake_pressure_pa=pressure_pa) for m in measurements[80:]]
        feed(pipeline, pressures_first(changed))
        digests.add(pipeline.digest)
    assert len(digests) == 2


def test_a_speed_takes_part() -> None:
    measurements = ride([(6.0, 0.0)])
    without, with_speed = Pipeline(FAST, 1), Pipeline(FAST, 1)
    feed(without, pressures_first(measurements))
    for measurement in measurements:
        feed(with_speed, [SpeedSample(measurement.t_ns, 80.0), *pair(measurement)])
    assert without.last is not None
    assert with_speed.last is not None
    assert with_speed.last.speed_std_mps < without.last.speed_std_mps
    assert (with_speed.measurements, with_speed.dropped) == (len(measurements), {})


def test_the_seed_is_part_of_the_result() -> None:
    digests = set()
    for seed in (1, 2, 1):
        pipeline = Pipeline(FAST, seed)
        feed(pipeline, pressures_first(clean()))
        digests.add(pipeline.digest)
    assert len(digests) == 2
