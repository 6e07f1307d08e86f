# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The gate for time: pairing by stamps, whatever the order of arrival; waits, ages, jumps; nothing without bound."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from adhesion_node.core import (
    Config,
    DemandSample,
    ForceSample,
    ImuSample,
    PositionSample,
    PressureSample,
    Sample,
    SpeedSample,
    WheelSample,
)
from adhesion_node.core.creep.config import CreepConfig
from adhesion_node.core.creep.estimator import gate_of as creep_gate_of
from adhesion_node.core.estimator import gate_of
from adhesion_node.core.intake.inbox import drain, push
from adhesion_node.core.intake.outcome import Outcome
from adhesion_node.core.intake.pairing import Gate, Inbox, Matched, Tick

S = 1_000_000_000
GATE = gate_of(Config(max_outliers=5))
CREEP = creep_gate_of(CreepConfig())


class Feeder:
    """Pushes samples and keeps what comes out."""

    def __init__(self, gate: Gate = GATE) -> None:
        self.gate, self.inbox = gate, Inbox()
        self.matched: list[Matched] = []
        self.ended: list[Matched] = []
        self.outcomes: list[Outcome] = []
        self.details: list[str] = []

    def push(self, *samples: Sample) -> list[Matched]:
        """Push samples; return what they release."""
        before = len(self.matched)
        for sample in samples:
            self._keep(push(self.gate, self.inbox, sample))
        return self.matched[before:]

    def drain(self) -> list[Matched]:
        """End of the data."""
        before = len(self.matched)
        self._keep(drain(self.gate, self.inbox))
        return self.matched[before:]

    def _keep(self, pushed: Any) -> None:
        self.inbox = pushed.inbox
        self.ended += pushed.ended
        self.matched += pushed.matched
        self.outcomes += [event.outcome for event in pushed.events]
        self.details += [event.detail for event in pushed.events]


def position(t_s: float) -> PositionSample:
    return PositionSample(round(t_s * S), 10 * t_s, 0.25)


def pressure(t_s: float, pressure_pa: float) -> PressureSample:
    return PressureSample(round(t_s * S), pressure_pa)


def speed(t_s: float, speed_mps: float) -> SpeedSample:
    return SpeedSample(round(t_s * S), speed_mps)


def running(until_s: float = 1.0, gate: Gate = GATE) -> Feeder:
    """A gate behind its beginning: positions and pressures of 10 Hz up to a time, no other sensor."""
    feeder = Feeder(gate)
    for tick in range(round(until_s * 10) + 1):
        feeder.push(pressure(tick / 10, tick), position(tick / 10))
    return feeder


def anchors(matched: list[Matched]) -> list[int]:
    """Stamps of the anchors, without those of ticks."""
    return [each.anchor.t_ns for each in matched if not isinstance(each.anchor, Tick)]


def pressures(matched: list[Matched]) -> list[float | None]:
    return [each.values[0] and each.values[0].pressure_pa for each in matched]


def test_pairs_equal_stamps_at_once() -> None:
    feeder = running()
    assert feeder.push(pressure(1.1, 5.0)) == []
    ((anchor, values),) = feeder.push(position(1.1))
    assert (anchor, values) == (position(1.1), (pressure(1.1, 5.0), None, (pressure(1.1, 5.0),), (), (), (), ()))


def test_in_the_beginning_every_sensor_is_waited_for() -> None:
    feeder = Feeder()
    assert feeder.push(pressure(0.0, 5.0), position(0.0)) == []
    others: list[Sample] = [speed(0.0, 9.0), WheelSample(0, (20.0,)), ImuSample(0, -0.1), DemandSample(0, 6.0)]
    assert feeder.push(*others[:-1]) == []
    ((_, values),) = feeder.push(others[-1])
    assert values == (pressure(0.0, 5.0), others[3], (pressure(0.0, 5.0),), *((each,) for each in others))


def test_the_order_of_arrival_within_a_tick_does_not_matter() -> None:
    ticks: list[list[Sample]] = [[position(t), pressure(t, 100 * t), speed(t, 80 - t)] for t in (1.0, 1.1, 1.2)]
    wanted = None
    for orders in itertools.product(itertools.permutations(range(3)), repeat=3):
        feeder = Feeder()
        feeder.push(*(tick[i] for tick, order in zip(ticks, orders, strict=True) for i in order))
        feeder.drain()
        wanted = wanted or feeder.matched
        assert feeder.matched == wanted
    assert wanted is not None
    assert [(values[0], values[3]) for _, values in wanted] == [(tick[1], (tick[2],)) for tick in ticks]


def test_waits_for_the_pressure_of_its_own_time() -> None:
    feeder = running()
    assert feeder.push(position(1.1)) == []
    assert pressures(feeder.push(pressure(1.1, 2.0))) == [2.0]


def test_takes_the_newest_pressure_that_is_not_later() -> None:
    feeder = running()
    feeder.push(pressure(1.05, 1.0), position(1.1))
    assert pressures(feeder.push(pressure(1.15, 2.0))) == [1.0]


def test_a_sensor_that_has_fallen_silent_is_waited_for_only_as_long_as_allowed() -> None:
    feeder = running()
    released = [[each.anchor.t_ns / S for each in feeder.push(position(t))] for t in (1.1, 1.2, 1.35, 1.6)]
    assert released == [[], [], [1.1], [1.2, 1.35]]
    assert [each.anchor.t_ns / S for each in feeder.drain()] == [1.6]
    assert feeder.drain() == []


def test_a_sensor_that_is_gone_is_not_waited_for() -> None:
    feeder = running()
    for tick in range(11, 60):
        feeder.push(position(tick / 10))
    assert len(feeder.push(position(6.0))) == 1


def test_an_old_value_counts_as_none() -> None:
    feeder = running()
    feeder.push(*(position(1.0 + k / 10) for k in range(1, 25)))
    known = {each.anchor.t_ns / S: value for each, value in zip(feeder.matched, pressures(feeder.matched), strict=True)}
    assert known[3.0] == 10.0  # 2 s old
    assert known[3.1] is None


def test_every_speed_comes_once_between_two_positions() -> None:
    feeder = running()
    for k in range(1, 6):
        feeder.push(pressure(1 + k / 10, 0.0), speed(1 + k / 10, float(k)), position(1 + k / 10))
    feeder.push(pressure(1.55, 0.0), position(1.55), speed(1.62, 7.0), speed(1.6, 6.0), speed(1.7, 8.0))
    feeder.push(pressure(1.7, 0.0), position(1.7), speed(1.71, 9.0))
    feeder.drain()
    speeds = {each.anchor.t_ns / S: [one.speed_mps for one in each.values[3]] for each in feeder.matched}
    assert [speeds[t] for t in (1.3, 1.4, 1.5, 1.55, 1.7)] == [[1.0, 2.0, 3.0], [4.0], [5.0], [], [6.0, 7.0, 8.0]]


def test_a_speed_that_comes_late_is_given_out_with_the_next_position_if_it_is_not_too_old() -> None:
    """Speeds of 2 Hz, 0.4 s late, beside positions of 10 Hz: they are not waited for so long."""
    feeder = running()
    for k in range(1, 40):
        late = [speed(1 + k / 10 - 0.4, float(k))] if k % 5 == 0 else []
        feeder.push(pressure(1 + k / 10, 0.0), *late, position(1 + k / 10))
    feeder.drain()
    ages = [each.anchor.t_ns - one.t_ns for each in feeder.matched for one in each.values[3]]
    assert len(ages) >= 6
    assert max(ages) <= 0.3 * S + 1


def test_the_samples_of_a_long_gap_are_bounded() -> None:
    feeder = running(gate=gate_of(Config(tick_s=0.0)))
    feeder.push(*(speed(1 + k / 200, float(k)) for k in range(2000)))
    feeder.push(position(11.0))
    ((_, values),) = feeder.drain()[-1:]
    assert [one.speed_mps for one in values[3]] == [float(k) for k in range(1600, 2000)]


def test_behind_a_gap_the_order_of_arrival_does_not_matter() -> None:
    """A sample far behind all others may have overtaken one that is not so far."""
    found = []
    overtaking, behind = (ImuSample(round(t_s * S), -0.5) for t_s in (3.09, 3.11))
    before = pressure(2.99, 5.0)
    orders: tuple[tuple[Sample, Sample], ...] = ((before, overtaking), (overtaking, before))
    for order in orders:
        feeder = running()
        feeder.push(*order, behind, position(3.3))
        feeder.drain()
        assert feeder.outcomes == []
        found.append(feeder.matched)
    assert found[0] == found[1]
    assert found[0][-1].values[5] == (overtaking, behind)


def test_late_and_double_anchors_are_told() -> None:
    feeder = running()
    feeder.push(position(0.95), position(1.0), position(1.1), position(1.1))
    assert feeder.outcomes == [Outcome.LATE, Outcome.DUPLICATE, Outcome.DUPLICATE]
    assert feeder.details[0].endswith("0.05 s behind the newest")


def test_a_second_pressure_with_the_same_stamp_is_told() -> None:
    feeder = running()
    feeder.push(pressure(1.0, 7.0), pressure(0.9, 8.0))
    assert feeder.outcomes == [Outcome.REPEATED, Outcome.REPEATED]


def test_a_sample_that_comes_when_all_of_its_time_is_used_is_told() -> None:
    """A speed of before the last one that was given out, or older than may be; a pressure's last value holds anyhow."""
    feeder = running(5.0)
    for k in range(1, 6):
        feeder.push(pressure(5 + k / 10, 0.0), speed(5 + k / 10, 30.0), position(5 + k / 10))
    assert feeder.outcomes == []
    feeder.push(speed(5.45, 30.0), speed(4.0, 30.0), pressure(5.45, 0.0), ImuSample(round(5.45 * S), 0.0))
    assert feeder.outcomes == [Outcome.OVERTAKEN, Outcome.OVERTAKEN]
    assert feeder.details == ["SpeedSample of 5.45 s", "SpeedSample of 4 s"]
    feeder.push(ImuSample(round(4.0 * S), 0.0))
    assert feeder.outcomes[2:] == [Outcome.OVERTAKEN]


def test_random_streams_lose_and_double_nothing() -> None:
    rng = np.random.default_rng(12)
    for _ in range(50):
        feeder, samples = Feeder(), list[Sample]()
        for t in rng.uniform(0, 300, 60):
            samples.append((position(t), pressure(t, t), speed(t, t))[rng.integers(3)])
        feeder.push(*samples)
        feeder.drain()
        stamps = anchors(feeder.ended + feeder.matched)
        positions = [sample.t_ns for sample in samples if isinstance(sample, PositionSample)]
        assert len(set(stamps)) == len(stamps)
        assert set(stamps) <= set(positions)
        drops = sum(outcome is not Outcome.RESET for outcome in feeder.outcomes)
        assert len(positions) - drops <= len(stamps) <= len(positions)
        for anchor, (known, *_) in feeder.matched:
            if known is not None:
                assert 0 <= anchor.t_ns - known.t_ns <= Config().pressure_age_s * S


class TestCreep:
    """The same gate for the creep estimator: wheel speeds wait for the train's speed and the force."""

    MS = 1_000_000
    START = 10**12

    def wheel(self, ms: int) -> WheelSample:
        return WheelSample(self.START + ms * self.MS, (16.0, 16.1))

    def speed(self, ms: int, value: float = 10.0) -> SpeedSample:
        return SpeedSample(self.START + ms * self.MS, value)

    def force(self, ms: int, value: float = 5e4) -> ForceSample:
        return ForceSample(self.START + ms * self.MS, value)

    def test_the_order_of_arrival_does_not_matter(self) -> None:
        samples: tuple[Sample, ...] = (self.wheel(0), self.speed(0), self.force(0))
        for order in itertools.permutations(samples):
            assert Feeder(CREEP).push(*order) == [Matched(samples[0], samples[1:])]

    def test_a_wheel_speed_waits_for_both(self) -> None:
        feeder = Feeder(CREEP)
        assert feeder.push(self.wheel(10), self.speed(10), self.force(0)) == []
        ((_, (_, force)),) = feeder.push(self.force(20, 7e4))
        assert force == self.force(0)

    def test_slower_sensors_serve_several_wheel_speeds(self) -> None:
        feeder = Feeder(CREEP)
        for ms in range(0, 100, 10):
            if ms % 50 == 0:
                feeder.push(self.speed(ms, float(ms)), self.force(ms))
            feeder.push(self.wheel(ms))
        feeder.drain()
        assert [speed.speed_mps for _, (speed, _) in feeder.matched] == [0.0] * 5 + [50.0] * 5

    def test_a_stray_stamp_makes_no_later_sample_late(self) -> None:
        feeder = Feeder(CREEP)
        for ms in range(0, 1000, 10):
            stray = [self.wheel(30_000)] if ms == 500 else []
            feeder.push(*stray, self.speed(ms), self.force(ms), self.wheel(ms))
        feeder.drain()
        assert len(feeder.matched) == 100
        assert feeder.outcomes == [Outcome.STRAY]
