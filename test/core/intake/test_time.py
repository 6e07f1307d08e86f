# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Time as the whole pipeline judges it: no stamp silences it, no order of arrival changes a bit, all is counted."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

import numpy as np
import pytest
from oracles import ride

from adhesion_node.core import (
    Config,
    Measurement,
    Outcome,
    PositionSample,
    PressureSample,
    Sample,
    SpeedSample,
    WheelSample,
)
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.pipeline import Pipeline

S = 10**9
FAST = Config(iterations=3)


def feed(pipeline: Pipeline, samples: Iterable[Sample]) -> list[Prediction]:
    return [prediction for sample in samples for prediction in pipeline.push(sample)]


def braking() -> list[Measurement]:
    """6 s of cruising, then 6 s of braking, 10 Hz."""
    return ride([(6.0, 0.0), (6.0, 410e3)])


def pairs(measurements: Sequence[Measurement]) -> list[Sample]:
    return [
        sample
        for m in measurements
        for sample in (PressureSample(m.t_ns, m.brake_pressure_pa or 0.0), PositionSample(*m[:3]))
    ]


@pytest.mark.parametrize("ahead_s", [5.0, 30.0, 59.0, 3600.0])
def test_one_position_stamped_ahead_silences_nothing(ahead_s: float) -> None:
    measurements = braking()
    samples = pairs(measurements)
    stray = PositionSample(measurements[49].t_ns + round(ahead_s * S), 400.0, 0.25)
    plain, hit = Pipeline(FAST, 1), Pipeline(FAST, 1)
    expected, got = feed(plain, samples), feed(hit, [*samples[:100], stray, *samples[100:]])
    assert [p.estimate for p in got] == [p.estimate for p in expected]
    assert hit.dropped == {"STRAY": 1}
    assert hit.state.counts[Outcome.RESET] == 0


@pytest.mark.parametrize("ahead_s", [5.0, 30.0, 59.0])
def test_one_pressure_stamped_ahead_changes_nothing(ahead_s: float) -> None:
    measurements = braking()
    samples = pairs(measurements)
    stray = PressureSample(measurements[49].t_ns + round(ahead_s * S), 410e3)
    plain, hit = Pipeline(FAST, 1), Pipeline(FAST, 1)
    expected, got = feed(plain, samples), feed(hit, [*samples[:100], stray, *samples[100:]])
    assert [p.estimate for p in got] == [p.estimate for p in expected]
    assert hit.dropped == {"STRAY": 1}


def test_a_recording_in_a_loop_with_a_slower_pressure_goes_on_each_turn() -> None:
    """20 s, pressure at 5 Hz beside positions at 10 Hz: the second and third turn give estimates too."""
    measurements = ride([(14.0, 0.0), (6.0, 410e3)])
    turn = [s for s in pairs(measurements) if isinstance(s, PositionSample) or s.t_ns % (S // 5) == 0]
    pipeline = Pipeline(FAST, 1)
    for number in range(3):
        predictions = feed(pipeline, turn)
        assert predictions[-1].estimate.t_ns > 19 * S
        assert len(predictions) >= (20 - 2 - 1) * 10 // FAST.step
        assert pipeline.state.counts[Outcome.RESET] == number
    assert pipeline.measurements - pipeline.accepted - sum(pipeline.dropped.values()) <= 3


STREAMS: dict[str, Callable[[Measurement], Sample]] = {
    "position": lambda m: PositionSample(*m[:3]),
    "pressure": lambda m: PressureSample(m.t_ns, m.brake_pressure_pa or 0.0),
    "speed": lambda m: SpeedSample(m.t_ns, 80.0 - m.t_ns * 1e-9 / 3),
    "wheels": lambda m: WheelSample(m.t_ns, tuple(w - m.t_ns * 1e-9 for w in (170.0, 171.0, 165.0))),
}


def streams(delays: dict[str, float], every: dict[str, int]) -> list[Sample]:
    """All sensors of a braking in the order of arrival: stamp and delay, s; of some only every n-th message."""
    arriving = [
        (m.t_ns + delays.get(name, 0.0) * S, number, make(m))
        for index, m in enumerate(braking())
        for number, (name, make) in enumerate(STREAMS.items())
        if index % every.get(name, 1) == 0
    ]
    return [sample for *_, sample in sorted(arriving, key=lambda each: each[:2])]


@pytest.mark.parametrize("every", [{}, {"pressure": 2}, {"speed": 3}, {"pressure": 2, "speed": 5, "wheels": 7}])
@pytest.mark.parametrize("name", STREAMS)
def test_the_delay_of_no_stream_changes_a_bit(name: str, every: dict[str, int]) -> None:
    """Each stream comes up to 0.19 s behind the others: less than `pressure_wait_s`."""
    digests = set()
    for delay_s in (0.0, 0.05, 0.1, 0.15, 0.19):
        pipeline = Pipeline(FAST, 1)
        feed(pipeline, streams({name: delay_s}, every))
        pipeline.finish()
        assert pipeline.dropped == {}
        digests.add(pipeline.digest)
    assert len(digests) == 1


def test_random_delays_of_all_streams_change_no_bit() -> None:
    rng = np.random.default_rng(5)
    digests = set()
    for _ in range(8):
        pipeline = Pipeline(FAST, 1)
        feed(pipeline, streams(dict(zip(STREAMS, rng.uniform(0.0, 0.19, 4), strict=True)), {"speed": 2}))
        pipeline.finish()
        digests.add(pipeline.digest)
    assert len(digests) == 1


def test_a_speed_that_begins_and_ends_in_between_is_used_the_same_in_every_order() -> None:
    digests, stds = set(), []
    for behind_s in (0.0, 0.15):
        samples = streams({"speed": behind_s}, {})
        pipeline = Pipeline(FAST, 1)
        feed(pipeline, [s for s in samples if not isinstance(s, SpeedSample) or 2 * S <= s.t_ns < 5 * S])
        pipeline.finish()
        digests.add(pipeline.digest)
        assert pipeline.last is not None
        stds.append(pipeline.last.speed_std_mps)
    assert len(digests) == 1
    without = Pipeline(FAST, 1)
    feed(without, [s for s in streams({}, {}) if not isinstance(s, SpeedSample)])
    without.finish()
    assert without.digest not in digests


def test_two_sources_far_apart_leave_one_at_work_and_are_told() -> None:
    """Positions of two clocks, 4000 s apart: the first one is followed, each message of the other is counted."""
    measurements = braking()
    other = [m._replace(t_ns=m.t_ns + 4000 * S) for m in measurements]
    mixed = [sample for one, two in zip(measurements, other, strict=True) for sample in pairs([one]) + pairs([two])[1:]]
    alone, both = Pipeline(FAST, 1), Pipeline(FAST, 1)
    expected = feed(alone, pairs(measurements))
    told = set()
    predictions = []
    for sample in mixed:
        predictions += both.push(sample)
        told |= {event.outcome for event in both.events if event.is_told}
    assert [p.estimate for p in predictions] == [p.estimate for p in expected]
    both.finish()
    assert both.dropped == {"STRAY": len(other)}
    assert told == {Outcome.STRAY}


@pytest.mark.parametrize("jitter", [0.1, 0.5])
def test_200_hz_with_jitter_loses_nothing(jitter: float) -> None:
    rng = np.random.default_rng(1)
    pipeline = Pipeline(FAST, 1)
    for tick in range(4000):
        t_ns = S + round((tick + rng.uniform(-jitter, jitter)) * S / 200)
        pipeline.push(PositionSample(t_ns, 8e-8 * t_ns, 0.25))
    pipeline.finish()
    in_order = pipeline.measurements - pipeline.state.counts[Outcome.LATE]
    assert pipeline.accepted == in_order >= 0.99 * pipeline.measurements


def test_a_gap_of_all_sensors_is_bridged_without_a_loss() -> None:
    measurements = [m for m in braking() if not 3 * S < m.t_ns < 9 * S]
    pipeline = Pipeline(FAST, 1)
    feed(pipeline, pairs(measurements))
    pipeline.finish()
    assert (pipeline.accepted, pipeline.dropped) == (len(measurements), {})
    assert pipeline.state.counts[Outcome.RESET] == 0


def test_after_a_gap_the_first_position_has_its_pressure() -> None:
    """Nothing for 5 s, then all sensors again: no brake is assumed where a released one is measured."""
    measurements = [m for m in ride([(12.0, 0.0)]) if not 3 * S < m.t_ns < 8 * S]
    pipeline = Pipeline(FAST, 1)
    assumed = 0
    for sample in pairs(measurements):
        pipeline.push(sample)
        newest = pipeline.state.newest
        assumed += newest is not None and newest.brake_pressure_pa is None
    assert assumed == 0


def test_a_slow_sensor_of_a_message_in_3_s_is_followed() -> None:
    pipeline = Pipeline(FAST, 1)
    for k in range(40):
        pipeline.push(PositionSample(3 * k * S, 60.0 * k, 0.25))
    pipeline.finish()  # the last one, far from all others, has none that agrees
    assert (pipeline.accepted, pipeline.dropped) == (39, {"STRAY": 1})


def test_silence_ends_the_waits() -> None:
    """A pressure that is slower than the positions, then silence: what waits is used, and a later one counts too."""
    samples = [s for s in pairs(braking()[:50]) if isinstance(s, PositionSample) or s.t_ns % (S // 5) == 0]
    pipeline = Pipeline(FAST, 1)
    feed(pipeline, samples)
    assert pipeline.measurements - pipeline.accepted == 1
    pipeline.settle()
    assert pipeline.accepted == pipeline.measurements == 50
    feed(pipeline, pairs(braking()[50:]))
    pipeline.finish()
    assert (pipeline.accepted, pipeline.dropped) == (120, {})


def test_the_stamps_of_estimates_rise() -> None:
    rng = np.random.default_rng(2)
    samples = pairs(braking())
    order = np.argsort(np.arange(len(samples)) + rng.uniform(0.0, 6.0, len(samples)))
    predictions = feed(Pipeline(FAST, 1), [samples[k] for k in order])
    assert all(before.estimate.t_ns < after.estimate.t_ns for before, after in pairwise(predictions))
