# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Where positions fail to come the other sensors are given out without one, in time, and nothing is lost for it."""

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest

from adhesion_node.core import (
    Config,
    DemandSample,
    ImuSample,
    PositionSample,
    PressureSample,
    Sample,
    SpeedSample,
    WheelSample,
)
from adhesion_node.core.estimator import gate_of
from adhesion_node.core.intake.inbox import drain, push
from adhesion_node.core.intake.outcome import Outcome
from adhesion_node.core.intake.pairing import Gate, Inbox, Matched, Tick

S = 1_000_000_000
GATE = gate_of(Config(tick_s=0.5))

MAKE: dict[str, Callable[[int], Sample]] = {
    "position": lambda t_ns: PositionSample(t_ns, 30e-9 * t_ns, 1.0),
    "pressure": lambda t_ns: PressureSample(t_ns, 0.0),
    "speed": lambda t_ns: SpeedSample(t_ns, 30.0),
    "wheels": lambda t_ns: WheelSample(t_ns, (65.0, 66.0)),
    "imu": lambda t_ns: ImuSample(t_ns, -0.1),
    "demand": lambda t_ns: DemandSample(t_ns, 0.0),
}


class Sensor(NamedTuple):
    """A stream: Hz, how late its messages come, s, when it is silent, and by how much its clock is ahead."""

    name: str
    rate_hz: float
    late_s: float = 0.0
    silent: tuple[float, float] = (0.0, 0.0)
    ahead: Callable[[float], float] = lambda _t_s: 0.0
    held_until_s: float = 0.0
    """What was measured before comes all at once then."""


def arriving(sensors: Iterable[Sensor], until_s: float) -> list[tuple[float, Sample]]:
    """Samples in the order of arrival, each with its time of arrival, s."""
    samples = []
    for number, sensor in enumerate(sensors):
        for k in range(round(until_s * sensor.rate_hz)):
            t_s = 100.0 + k / sensor.rate_hz
            if not sensor.silent[0] <= t_s - 100.0 < sensor.silent[1]:
                came_s = max(t_s + sensor.late_s, 100.0 + sensor.held_until_s)
                samples.append((came_s, number, MAKE[sensor.name](round((t_s + sensor.ahead(t_s - 100.0)) * S))))
    return [(came_s, sample) for came_s, _, sample in sorted(samples, key=lambda each: each[:2])]


class Run(NamedTuple):
    """What a gate gave out, when, s, and what it told."""

    matched: list[Matched]
    came_s: list[float]
    outcomes: list[Outcome]

    @property
    def ticks_s(self) -> list[float]:
        """Stamps of the ticks, s from the beginning."""
        return [each.anchor.t_ns / S - 100.0 for each in self.matched if isinstance(each.anchor, Tick)]

    @property
    def positions(self) -> int:
        """Positions that were given out."""
        return len(self.matched) - len(self.ticks_s)

    def longest_silence_s(self, end_s: float) -> float:
        """Longest time, by the arrival, without anything given out, from the first on."""
        return max(later - before for before, later in pairwise([*self.came_s, 100.0 + end_s]))


def run(sensors: Sequence[Sensor], until_s: float, gate: Gate = GATE) -> Run:
    inbox, result = Inbox(), Run([], [], [])
    for came_s, sample in arriving(sensors, until_s):
        pushed = push(gate, inbox, sample)
        inbox = pushed.inbox
        given = pushed.ended + pushed.matched
        result.matched.extend(given)
        result.came_s.extend([came_s] * len(given))
        result.outcomes.extend(event.outcome for event in pushed.events)
    result.matched.extend(drain(gate, inbox).matched)
    return result


PRESSURE, SPEED, IMU = Sensor("pressure", 10), Sensor("speed", 10), Sensor("imu", 50)


@pytest.mark.parametrize("rate_hz", [2.0, 3.0, 10.0])
@pytest.mark.parametrize("late_s", [0.0, 0.19])
def test_positions_of_2_hz_or_more_leave_no_room_for_a_tick(rate_hz: float, late_s: float) -> None:
    came = run([Sensor("position", rate_hz, late_s), PRESSURE, SPEED, IMU], 30.0)
    assert (came.ticks_s, came.positions) == ([], 30 * rate_hz)


@pytest.mark.parametrize("late_s", [0.0, 0.05, 0.19])
def test_between_positions_of_1_hz_there_is_a_tick_and_no_position_is_lost(late_s: float) -> None:
    came = run([Sensor("position", 1, late_s), PRESSURE, SPEED], 30.0)
    assert came.ticks_s == pytest.approx([k + 0.5 for k in range(30)][: len(came.ticks_s)])
    assert (len(came.ticks_s) >= 29, came.positions, came.outcomes) == (True, 30, [])


def test_a_tick_waits_no_longer_than_for_the_position_behind_it_and_the_others() -> None:
    """However late some have been at first: where all have come as far there is nothing to wait for."""
    came = run([Sensor("position", 1), Sensor("pressure", 10, held_until_s=4.0)], 30.0)
    waits = [came_s - each.anchor.t_ns / S for came_s, each in zip(came.came_s, came.matched, strict=False)]
    late = [wait for wait, each in zip(waits, came.matched, strict=False) if each.anchor.t_ns > 110 * S]
    assert len(late) > 36
    assert max(late) <= 0.81


@pytest.mark.parametrize("rate_hz", [1.0, 2.0, 10.0])
@pytest.mark.parametrize("late_s", [0.3, 0.5, 0.9, 1.5])
def test_positions_that_come_later_than_is_waited_are_not_lost_to_ticks(rate_hz: float, late_s: float) -> None:
    """How late they are is learnt from the first one."""
    came = run([PRESSURE, SPEED, Sensor("position", rate_hz, late_s)], 60.0)
    assert came.positions >= 60 * rate_hz - late_s * rate_hz - 2
    assert set(came.outcomes) <= {Outcome.LATE}


@pytest.mark.parametrize("late_s", [2.5, 4.0, 6.0])
def test_nor_are_those_that_all_come_much_later(late_s: float) -> None:
    came = run([PRESSURE, SPEED, Sensor("position", 1, late_s)], 60.0)
    assert came.positions >= 60.0 - late_s
    assert set(came.outcomes) <= {Outcome.LATE}


@pytest.mark.parametrize("late_s", [6.0, 30.0, 50.0])
def test_a_single_position_that_comes_much_later_silences_nothing_for_as_long(late_s: float) -> None:
    places = Sensor("position", 0.1, ahead=lambda t_s: -late_s * (t_s == 60.0))
    came = run([PRESSURE, SPEED, places], 120.0)
    assert came.outcomes == [Outcome.LATE]
    assert came.longest_silence_s(120.0) <= 3.0


@pytest.mark.parametrize("beside", [PRESSURE, SPEED, IMU, Sensor("wheels", 5), Sensor("demand", 4)])
def test_through_an_outage_of_the_positions_ticks_come_in_time(beside: Sensor) -> None:
    came = run([Sensor("position", 5, 0.1, silent=(10.0, 40.0)), beside], 50.0)
    assert came.ticks_s == pytest.approx([9.8 + 0.5 * k for k in range(1, 61)])
    assert came.longest_silence_s(50.0) <= 1.0
    assert (came.positions, came.outcomes) == (100, [])


def test_no_tick_without_tick_s() -> None:
    sensors = [Sensor("position", 1, silent=(10.0, 40.0)), SPEED]
    assert run(sensors, 50.0, gate_of(Config(tick_s=0.0))).ticks_s == []


@pytest.mark.parametrize("name", ["speed", "wheels"])
def test_speed_or_wheels_alone_are_enough_to_run_and_to_begin(name: str) -> None:
    came = run([Sensor(name, 10), PRESSURE], 100.0)
    assert came.ticks_s == pytest.approx([0.5 * k for k in range(1, 200)])
    assert came.came_s[0] <= 104.0
    assert came.longest_silence_s(100.0) <= 1.0


def test_the_first_positions_may_come_late_in_a_burst() -> None:
    """Speeds and pressures of 2 s are there before the first position, as a network delivers them at the start."""
    came = run([SPEED, PRESSURE, Sensor("position", 10, held_until_s=2.0)], 10.0)
    assert (came.positions, came.ticks_s, came.outcomes) == (100, [], [])


def test_the_first_tick_waits_for_a_sensor_that_begins_late() -> None:
    """A speed begins, then an accelerometer, and a position when the first tick is over."""
    others = [Sensor("speed", 50), Sensor("position", 1.6, silent=(0.0, 0.6))]
    prompt, late = (run([*others, Sensor("imu", 50, late_s, silent=(0.0, 0.35))], 3.0) for late_s in (0.0, 0.15))
    assert isinstance(prompt.matched[0].anchor, Tick)
    assert late.matched == prompt.matched


@pytest.mark.parametrize("name", ["pressure", "imu", "demand"])
def test_no_other_sensor_begins_by_itself(name: str) -> None:
    assert run([Sensor(name, 10)], 100.0).matched == []


@pytest.mark.parametrize("name", ["speed", "wheels"])
def test_behind_what_tells_of_motion_ticks_end_after_tick_for_s_and_it_begins_them_again(name: str) -> None:
    sensors = [Sensor("position", 10, silent=(5.0, 1e3)), Sensor(name, 10, silent=(10.0, 100.0)), PRESSURE]
    ticks = run(sensors, 110.0, gate_of(Config(tick_s=0.5, tick_for_s=20.0))).ticks_s
    assert max(later - before for before, later in pairwise(t for t in ticks if t < 29.9)) < 0.51
    assert [t for t in ticks if 30.0 < t < 100.0] == []
    assert ticks[-1] > 109.0


def test_every_sample_is_given_out_once_and_in_order() -> None:
    sensors = [Sensor("position", 1, 0.1, silent=(10.0, 20.0)), *(Sensor(name, 17) for name in list(MAKE)[1:])]
    came = run(sensors, 30.0)
    for index, source in enumerate(GATE.sources):
        if source.each:
            given = [sample for each in came.matched for sample in each.values[index]]
            sent = [sample for _, sample in arriving(sensors, 30.0) if isinstance(sample, source.kind)]
            assert given == [sample for sample in sent if sample.t_ns <= came.matched[-1].anchor.t_ns]


def test_ticks_depend_on_no_order_of_arrival() -> None:
    rng, runs = np.random.default_rng(7), []
    for seed in range(20):
        late_s = rng.uniform(0.0, 0.19 * (seed > 0), 5)
        sensors = [
            Sensor("position", 1, late_s[0], silent=(5.0, 9.0)),
            Sensor("pressure", 10, late_s[1], silent=(20.0, 30.0)),
            Sensor("speed", 7, late_s[2], silent=(7.0, 12.0)),
            Sensor("wheels", 3, late_s[3], silent=(11.0, 11.7)),
            Sensor("imu", 50, late_s[4], silent=(21.0, 22.3)),
        ]
        runs.append(run(sensors, 40.0).matched)
    assert runs.count(runs[0]) == len(runs)
    assert len(runs[0]) > 60


@pytest.mark.parametrize("held", ["position", "speed", "pressure", "all"])
@pytest.mark.parametrize("rate_hz", [1.0, 10.0])
@pytest.mark.parametrize("held_s", [2.0, 6.0])
def test_a_buffered_history_at_the_start_silences_nothing(held: str, rate_hz: float, held_s: float) -> None:
    names = {"position": rate_hz, "speed": 10.0, "pressure": 10.0}
    sensors = [Sensor(name, hz, held_until_s=held_s if held in (name, "all") else 0.0) for name, hz in names.items()]
    came = run(sensors, 60.0)
    assert came.positions >= (60.0 - held_s) * rate_hz - 2
    assert came.positions + came.outcomes.count(Outcome.LATE) == 60 * rate_hz
    assert set(came.outcomes) <= {Outcome.LATE, Outcome.RESET, Outcome.OVERTAKEN}
    assert came.longest_silence_s(60.0) <= max(held_s, 1.0)


@pytest.mark.parametrize("name", ["position", "speed", "pressure", "imu"])
@pytest.mark.parametrize("ahead_s", [-1.0, 1.0])
@pytest.mark.parametrize("rate_hz", [1.0, 10.0])
def test_stamps_off_by_a_second_for_long_silence_nothing(name: str, ahead_s: float, rate_hz: float) -> None:
    names = {"position": rate_hz, "speed": 10.0, "pressure": 10.0, "imu": 20.0}

    def ahead(t_s: float) -> float:
        return ahead_s if 20.0 <= t_s < 70.0 else 0.0

    sensors = [Sensor(each, hz, 0.1) for each, hz in names.items() if each != name]
    sensors.append(Sensor(name, names[name], 0.1, ahead=ahead))
    came = run(sensors, 100.0)
    assert came.longest_silence_s(100.0) <= 2.2
    assert came.positions >= 100 * rate_hz - 1.3 * rate_hz - 2
    assert (
        came.positions + len([each for each in came.outcomes if each in (Outcome.LATE, Outcome.DUPLICATE)])
        == 100 * rate_hz
    )
    assert set(came.outcomes) <= {Outcome.LATE, Outcome.DUPLICATE, Outcome.REPEATED, Outcome.OVERTAKEN}
