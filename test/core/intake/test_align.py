# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Pairing of the streams by their stamps alone."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from adhesion_node.core.intake.inbox import (
    MOST,
    Aligner,
    PositionSample,
    PressureSample,
    Sample,
    SpeedSample,
    WheelSample,
)
from adhesion_node.core.intake.samples import Measurement

S = 1_000_000_000


def _position(t_s: float) -> PositionSample:
    return PositionSample(round(t_s * S), 10 * t_s, 0.25)


def _pressure(t_s: float, pressure: float) -> PressureSample:
    return PressureSample(round(t_s * S), pressure)


def _all(aligner: Aligner, samples: list[Sample]) -> list[Measurement]:
    return [m for sample in samples for m in aligner.push(sample)] + aligner.flush()


def _aligner() -> Aligner:
    return Aligner(0.2, 1.0)


def test_pairs_equal_stamps_at_once() -> None:
    aligner = _aligner()
    assert aligner.push(_pressure(1.0, 5.0)) == []
    assert aligner.push(SpeedSample(S, 9.0)) == []
    assert aligner.push(_position(1.0)) == [Measurement(S, 10.0, 0.25, 5.0, 9.0)]


def test_the_median_axle_counts_while_it_is_fresh() -> None:
    aligner = _aligner()
    aligner.push(WheelSample(S, (100.0, 20.0, 90.0)))
    aligner.push(_pressure(1.1, 5.0))
    assert aligner.push(_position(1.1))[0].wheel_radps == 90.0
    aligner.push(_pressure(1.3, 5.0))
    assert aligner.push(_position(1.3))[0].wheel_radps is None  # 0.3 s old


def test_the_order_of_arrival_within_a_tick_does_not_matter() -> None:
    ticks: list[list[Sample]] = [
        [_position(t), _pressure(t, 100 * t), SpeedSample(round(t * S), 80 - t)] for t in (1.0, 1.1, 1.2)
    ]
    wanted = None
    for orders in itertools.product(itertools.permutations(range(3)), repeat=3):
        samples = [tick[i] for tick, order in zip(ticks, orders, strict=True) for i in order]
        got = [m._replace(speed_mps=None) for m in _all(_aligner(), samples)]
        wanted = wanted or got
        assert got == wanted
    assert wanted == [Measurement(round(t * S), 10 * t, 0.25, 100 * t) for t in (1.0, 1.1, 1.2)]


def test_waits_for_the_pressure_of_its_own_time() -> None:
    aligner = _aligner()
    aligner.push(_pressure(0.9, 1.0))
    assert aligner.push(_position(1.0)) == []
    assert aligner.push(_pressure(1.0, 2.0)) == [Measurement(S, 10.0, 0.25, 2.0)]


def test_takes_the_newest_pressure_that_is_not_later() -> None:
    aligner = _aligner()
    aligner.push(_pressure(0.95, 1.0))
    aligner.push(_position(1.0))
    assert aligner.push(_pressure(1.05, 2.0)) == [Measurement(S, 10.0, 0.25, 1.0)]


def test_without_pressure_waits_only_as_long_as_allowed() -> None:
    aligner = _aligner()
    released = [[m.t_ns / S for m in aligner.push(_position(t))] for t in (1.0, 1.1, 1.25, 1.5)]
    assert released == [[], [], [1.0], [1.1, 1.25]]
    assert [m.t_ns / S for m in aligner.flush()] == [1.5]
    assert aligner.flush() == []


def test_an_old_pressure_is_no_pressure() -> None:
    fresh, stale = _aligner(), _aligner()
    assert _all(fresh, [_pressure(0.0, 1.0), _position(1.0)])[0].brake_pressure_pa == 1.0
    assert _all(stale, [_pressure(0.0, 1.0), _position(1.001)])[0].brake_pressure_pa is None


def test_a_speed_counts_once_and_only_fresh() -> None:
    aligner = _aligner()
    samples: list[Sample] = [SpeedSample(S, 70.0), _position(1.05), _position(1.1), _position(1.5)]
    assert [m.speed_mps for m in _all(aligner, samples)] == [70.0, None, None]
    old: list[Sample] = [SpeedSample(S, 70.0), _position(1.21)]
    assert [m.speed_mps for m in _all(_aligner(), old)] == [None]


def test_late_and_double_positions_pass_in_order_of_arrival() -> None:
    samples: list[Sample] = [_pressure(2.0, 1.0), _position(1.0), _position(1.2), _position(1.1), _position(1.2)]
    assert [m.t_ns for m in _all(_aligner(), samples)] == [_position(t).t_ns for t in (1.0, 1.2, 1.1, 1.2)]


@pytest.mark.parametrize("jump_s", [-500.0, 500.0])
def test_a_clock_jump_loses_no_position_and_brings_no_old_pressure(jump_s: float) -> None:
    samples: list[Sample] = [_pressure(1000.0, 1.0), _position(1000.0), _position(1000.1), _position(1000.1 + jump_s)]
    measurements = _all(_aligner(), samples)
    assert [m.t_ns for m in measurements] == [s.t_ns for s in samples[1:]]
    assert [m.brake_pressure_pa for m in measurements] == [1.0, 1.0, None]


def test_goes_on_after_the_clock_jumped_back() -> None:
    before: list[Sample] = [x for k in range(20) for x in (_pressure(1000 + k / 10, 1.0), _position(1000 + k / 10))]
    after: list[Sample] = [x for k in range(20) for x in (_pressure(1 + k / 10, 2.0), _position(1 + k / 10))]
    measurements = _all(_aligner(), before + after)
    assert [m.brake_pressure_pa for m in measurements] == [1.0] * 20 + [2.0] * 20
    assert [m.t_ns for m in measurements] == [s.t_ns for s in before + after if isinstance(s, PositionSample)]


def test_random_streams_lose_and_double_nothing() -> None:
    rng = np.random.default_rng(12)
    for _ in range(50):
        samples: list[Sample] = []
        for t in rng.uniform(0, 300, 60):
            kind = rng.integers(3)
            samples.append((_position(t), _pressure(t, t), SpeedSample(round(t * S), t))[kind])
        measurements = _all(_aligner(), samples)
        assert sorted(m.t_ns for m in measurements) == sorted(s.t_ns for s in samples if isinstance(s, PositionSample))
        for m in measurements:
            if m.brake_pressure_pa is not None:
                assert 0 <= m.t_ns / S - m.brake_pressure_pa <= 1.0 + 1e-9  # a pressure is its own stamp here


def test_positions_whose_stamp_stands_still_do_not_wait_without_end() -> None:
    aligner = _aligner()
    released = [m for _ in range(MOST + 5) for m in aligner.push(_position(1.0))]
    assert len(released) == 5
    assert len(aligner.flush()) == MOST


def test_a_flood_keeps_the_newest_pressures() -> None:
    aligner = _aligner()
    for number in range(MOST + 5):
        aligner.push(PressureSample(S + number, float(number)))
    oldest, newest = PositionSample(S + 5, 0.0, 1.0), PositionSample(S + MOST + 4, 0.0, 1.0)
    pressures = [m.brake_pressure_pa for m in _all(aligner, [PositionSample(S + 4, 0.0, 1.0), oldest, newest])]
    assert pressures == [None, 5.0, float(MOST + 4)]
