# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Stamps of a receiver that step by a second for a while are put back; whatever else is odd about stamps is not."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

import numpy as np
import pytest
from oracles import ride

from adhesion_node.core import Config, Outcome, PositionSample, PressureSample, SpeedSample
from adhesion_node.core.intake.clock import Clock
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.pipeline import Pipeline

S = 10**9


def run(
    count: int = 400, rate_hz: float = 10.0, speed_mps: float = 40.0, jitter: float = 0.0, noise_m: float = 0.5
) -> list[PositionSample]:
    """A train that slows by 0.5 m/s^2 from the middle on, as a receiver of some noise sees it."""
    rng = np.random.default_rng(1)
    times = (np.arange(count) + jitter * rng.uniform(-1.0, 1.0, count)) / rate_hz
    braked = np.clip(times - times[count // 2], 0.0, speed_mps)
    places = speed_mps * times - 0.25 * braked**2 + noise_m * rng.standard_normal(count)
    return [
        PositionSample(S + round(time * S), place, 0.25) for time, place in zip(times.tolist(), places, strict=True)
    ]


def stepped(samples: Iterable[PositionSample], by_s: float, first: int, last: int) -> list[PositionSample]:
    """Stamps from the first to the last sample are off."""
    return [
        sample._replace(t_ns=sample.t_ns + round(by_s * S) * (first <= index < last))
        for index, sample in enumerate(samples)
    ]


def read(
    samples: Sequence[PositionSample], now: Sequence[PositionSample] | None = None, every: int = 1, phase: int = 0
) -> tuple[list[PositionSample], int]:
    """What is let through, and how many steps were told; two other sensors are heard at every n-th time of `now`."""
    clock, through, told = Clock(), list[PositionSample](), 0
    for index, (sample, true) in enumerate(zip(samples, now or samples, strict=True)):
        if index % every == phase:
            clock = clock.beside(PressureSample(true.t_ns - S // 50, 0.0)).clock
            clock = clock.beside(SpeedSample(true.t_ns, 1.0)).clock
        clock, used, events = clock.read(sample)
        through += used
        told += len(events)
    return through + list(clock.settled().samples), told


def largest_off_s(found: Sequence[PositionSample], true: Sequence[PositionSample]) -> float:
    return max(abs(one.t_ns - other.t_ns) for one, other in zip(found, true, strict=True)) / S


@pytest.mark.parametrize("by_s", [-2.5, -1.0, -0.5, 0.5, 1.0, 2.5])
@pytest.mark.parametrize(("rate_hz", "jitter", "noise_m"), [(10.0, 0.0, 0.5), (10.0, 0.2, 2.0), (4.0, 0.1, 1.0)])
def test_stamps_that_step_and_return_are_put_back(by_s: float, rate_hz: float, jitter: float, noise_m: float) -> None:
    true = run(400, rate_hz, jitter=jitter, noise_m=noise_m)
    found, told = read(stepped(true, by_s, 100, 260), true)
    assert [each.position_m for each in found] == [each.position_m for each in true]
    assert largest_off_s(found, true) <= 2.0 * jitter / rate_hz
    assert told == 2


@pytest.mark.parametrize("speed_mps", [0.0, 2.0, 8.0])
def test_so_they_are_while_the_train_is_slow(speed_mps: float) -> None:
    true = run(speed_mps=speed_mps)
    assert read(stepped(true, 1.0, 100, 260), true) == (true, 2)


@pytest.mark.parametrize("by_s", [-1.0, 1.0])
def test_one_hertz_is_enough(by_s: float) -> None:
    true = run(200, 1.0)
    assert read(stepped(true, by_s, 60, 120), true) == (true, 2)


def test_a_step_from_one_error_to_the_other_is_one_of_two_seconds() -> None:
    true = run()
    assert read(stepped(stepped(true, 1.0, 100, 200), -1.0, 200, 300), true) == (true, 3)


def test_stamps_that_return_while_the_train_stands_are_known_again() -> None:
    moving, standing = run(100), [PositionSample(S + round(k * 0.1 * S), 400.0, 0.25) for k in range(100, 200)]
    true = [*moving[:60], *(each._replace(position_m=40.0 * (each.t_ns / S - 1.0)) for each in moving[60:]), *standing]
    assert read(stepped(true, 1.0, 40, 150), true) == (true, 2)


def lost(samples: list[PositionSample]) -> list[PositionSample]:
    return samples[:100] + samples[110:]


def held_up(samples: list[PositionSample]) -> list[PositionSample]:
    """A driver that stamps what it sends stalls for 1 s, then sends all at once."""
    burst = [each._replace(t_ns=samples[110].t_ns + k * S // 500) for k, each in enumerate(samples[100:111])]
    return samples[:100] + burst + samples[111:]


def one_ahead(samples: list[PositionSample]) -> list[PositionSample]:
    return stepped(samples, 1.0, 100, 101)


def out_of_order(samples: list[PositionSample]) -> list[PositionSample]:
    return samples[:100] + samples[110:120] + samples[100:110] + samples[120:]


def twice(samples: list[PositionSample]) -> list[PositionSample]:
    return [each for sample in samples for each in (sample, sample)]


def standing_clock(samples: list[PositionSample]) -> list[PositionSample]:
    return [each._replace(t_ns=samples[100].t_ns) if 100 <= k < 130 else each for k, each in enumerate(samples)]


def other_time(samples: list[PositionSample]) -> list[PositionSample]:
    return stepped(samples, 60.0, 100, 400)


def a_balise(samples: list[PositionSample]) -> list[PositionSample]:
    return [each._replace(position_m=each.position_m - 40.0 * (k >= 100)) for k, each in enumerate(samples)]


@pytest.mark.parametrize("rate_hz", [1.0, 10.0])
@pytest.mark.parametrize(
    "odd", [list, lost, held_up, one_ahead, out_of_order, twice, standing_clock, other_time, a_balise]
)
def test_what_is_no_step_of_the_clock_is_let_through_as_it_is(
    odd: Callable[[list[PositionSample]], list[PositionSample]], rate_hz: float
) -> None:
    true = run(400, rate_hz)
    samples = odd(true)
    assert read(samples, true if len(true) == len(samples) else samples) == (samples, 0)


@pytest.mark.parametrize("by_s", [-1.0, 1.0])
def test_a_clock_of_all_sensors_is_left_to_the_gate(by_s: float) -> None:
    """Put back alone, positions would belong to another moment than all else, for good."""
    samples = stepped(run(), by_s, 100, 300)
    assert read(samples, samples) == (samples, 0)


@pytest.mark.parametrize("by_s", [-1.0, 1.0])
def test_positions_beside_which_nothing_is_heard_are_left_as_they_are(by_s: float) -> None:
    clock, through = Clock(), list[PositionSample]()
    samples = stepped(run(), by_s, 100, 300)
    for sample in samples:
        clock, used, _ = clock.read(sample)
        through += used
    assert through == samples


@pytest.mark.parametrize("phase", range(10))
@pytest.mark.parametrize("by_s", [-1.0, 1.0])
def test_sensors_of_one_hertz_tell_which_time_is_right(by_s: float, phase: int) -> None:
    true = run()
    found, told = read(stepped(true, by_s, 100, 300), true, every=10, phase=phase)
    assert largest_off_s(found[:300], true[:300]) == 0.0
    assert largest_off_s(found[320:], true[320:]) == 0.0
    assert told == 2


@pytest.mark.parametrize("by_s", [-2.0, -1.0, 1.0, 2.0])
def test_stamps_that_are_set_right_stay_as_they_are(by_s: float) -> None:
    """Those in the beginning were wrong: what steps is no error."""
    true = run()
    samples = stepped(true, by_s, 0, 100)
    assert read(samples, true) == (samples, 0)


@pytest.mark.parametrize("by_s", [-1.0, 1.0])
def test_where_the_step_was_missed_or_the_return_all_is_soon_right(by_s: float) -> None:
    true = run()
    samples = stepped(true, by_s, 100, 200)
    for gap in (slice(100, 104), slice(200, 204)):
        left, now = samples.copy(), true.copy()
        del left[gap], now[gap]
        found, _ = read(left, now)
        assert largest_off_s(found[230:], now[230:]) == 0.0


def balises(speeds_mps: Sequence[float], apart_m: float = 250.0) -> list[PositionSample]:
    """Places all as far apart, of a train that runs from each to the next at such a speed."""
    times = S + np.cumsum([0.0, *(apart_m / speed for speed in speeds_mps)]) * S
    return [PositionSample(round(t_ns), apart_m * k, 1.0) for k, t_ns in enumerate(times.tolist())]


@pytest.mark.parametrize("late_s", [0.1, 1.0, 2.0])
@pytest.mark.parametrize("then_mps", [23.0, 26.0, 28.0, 32.0, 34.0, 38.0])
def test_a_train_that_runs_slower_or_faster_over_balises_waits_for_none(late_s: float, then_mps: float) -> None:
    """The way of each period is the same, as where the clock of a receiver steps."""
    clock = Clock()
    for sample in balises([30.0] * 9 + [then_mps] * 9):
        clock = clock.beside(PressureSample(sample.t_ns + round(late_s * S), 0.0)).clock
        clock, used, _ = clock.read(sample)
        assert used == (sample,)


@pytest.mark.parametrize("wrong", [1, 2])
@pytest.mark.parametrize("by_s", [-3.0, -1.0, 1.0, 3.0])
def test_what_is_set_aside_before_an_outage_does_not_wait_for_its_end(by_s: float, wrong: int) -> None:
    clock, true = Clock(), run(100)
    samples = stepped(true, by_s, 100 - wrong, 100)
    for sample, each in zip(samples, true, strict=True):
        clock = clock.beside(PressureSample(each.t_ns, 0.0)).clock.read(sample).clock
    assert clock.doubted == tuple(samples[-wrong:])
    through = []
    for k in range(100):
        clock, used, _ = clock.beside(PressureSample(true[-1].t_ns + k * S // 10, 0.0))
        through += [(sample, k) for sample in used]
    assert [sample for sample, _ in through] == samples[-wrong:]
    assert clock.doubted == ()


@pytest.mark.parametrize("by_s", [-1.0, 1.0])
def test_nor_does_it_set_the_time_back(by_s: float) -> None:
    """Two positions whose clock has stepped, then none for 2 minutes."""
    measurements = ride([(150.0, 0.0)])
    pipeline = Pipeline(Config(), 1)
    for k, (t_ns, position_m, variance_m2, *_) in enumerate(measurements):
        pipeline.push(SpeedSample(t_ns, 80.0, 0.1))
        if k < 100 or k > 1300:
            pipeline.push(PositionSample(t_ns + (98 <= k < 100) * round(by_s * S), position_m, variance_m2))
    assert pipeline.state.counts[Outcome.RESET] == 0


def test_a_step_that_is_meant_is_none() -> None:
    samples, clock, told = stepped(run(), -1.0, 100, 400), Clock(), 0
    for index, (sample, true) in enumerate(zip(samples, run(), strict=True)):
        clock = clock.unsure() if index == 100 else clock
        clock, _, events = clock.beside(PressureSample(true.t_ns, 0.0)).clock.read(sample)
        told += len(events)
    assert told == 0


def estimates(positions: Iterable[PositionSample], pressures: Sequence[PressureSample]) -> tuple[list[Prediction], int]:
    pipeline = Pipeline(Config(), 1)
    made = [
        each
        for pressure, position in zip(pressures, positions, strict=True)
        for sample in (pressure, position)
        for each in pipeline.push(sample)
    ]
    return [*made, *pipeline.finish()], pipeline.state.counts[Outcome.SHIFTED]


def test_the_estimates_are_those_of_a_clock_that_is_right() -> None:
    measurements = ride([(20.0, 0.0), (15.0, 410e3)])
    positions = [PositionSample(*each[:3]) for each in measurements]
    pressures = [PressureSample(each.t_ns, each.brake_pressure_pa or 0.0) for each in measurements]
    right, none = estimates(positions, pressures)
    found, told = estimates(stepped(positions, 1.0, 100, 300), pressures)
    assert (none, told) == (0, 2)
    at = {each.estimate.t_ns: each.estimate for each in right}
    same = [each.estimate for each in found if each.estimate.t_ns in at]
    assert len(same) > 0.9 * len(right)
    assert max(abs(one.speed_mps - at[one.t_ns].speed_mps) for one in same) < 0.05
    assert all(one.estimate.t_ns < other.estimate.t_ns for one, other in pairwise(found))
