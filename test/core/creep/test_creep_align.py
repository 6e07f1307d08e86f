# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Pairing of wheel speeds with speeds and forces: by stamps alone, in any order of arrival."""

from __future__ import annotations

import itertools

from adhesion_node.core.creep.inbox import CreepAligner, ForceSample, Paired, Sample
from adhesion_node.core.intake.inbox import SpeedSample, WheelSample

MS = 1_000_000
START = 10**12


def wheel(ms: int) -> WheelSample:
    return WheelSample(START + ms * MS, (16.0, 16.1))


def speed(ms: int, value: float = 10.0) -> SpeedSample:
    return SpeedSample(START + ms * MS, value)


def force(ms: int, value: float = 5e4) -> ForceSample:
    return ForceSample(START + ms * MS, value)


def test_the_order_of_arrival_does_not_matter() -> None:
    samples: tuple[Sample, ...] = (wheel(0), speed(0), force(0))
    for order in itertools.permutations(samples):
        aligner = CreepAligner(0.2, 0.1)
        paired = [pair for sample in order for pair in aligner.push(sample)]
        assert paired == [Paired(START, (16.0, 16.1), 10.0, 5e4)]


def test_a_wheel_speed_waits_for_both() -> None:
    aligner = CreepAligner(0.2, 0.1)
    assert aligner.push(wheel(10)) == []
    assert aligner.push(speed(10)) == []
    assert aligner.push(force(0)) == []
    assert [pair.force_n for pair in aligner.push(force(20, 7e4))] == [5e4]


def test_without_one_of_them_it_waits_no_longer_than_told() -> None:
    aligner = CreepAligner(0.2, 0.1)
    paired = [pair for ms in range(0, 300, 10) for s in (wheel(ms), speed(ms)) for pair in aligner.push(s)]
    assert [pair.t_ns for pair in paired] == [START + ms * MS for ms in range(0, 100, 10)]
    assert {pair.force_n for pair in paired} == {None}
    assert len(aligner.flush()) == 20


def test_an_old_value_counts_as_none() -> None:
    aligner = CreepAligner(0.2, 0.1)
    aligner.push(speed(0))
    aligner.push(force(100))
    assert aligner.push(wheel(101)) == []
    (pair,) = aligner.flush()
    assert (pair.speed_mps, pair.force_n) == (None, 5e4)


def test_slower_sensors_serve_several_wheel_speeds() -> None:
    aligner = CreepAligner(0.2, 0.1)
    paired = []
    for ms in range(0, 100, 10):
        extra = (speed(ms, float(ms)), force(ms)) if ms % 50 == 0 else ()
        paired += [pair for s in (*extra, wheel(ms)) for pair in aligner.push(s)]
    paired += aligner.flush()
    assert [pair.speed_mps for pair in paired] == [0.0] * 5 + [50.0] * 5


def test_a_clock_step_starts_anew() -> None:
    aligner = CreepAligner(0.2, 0.1)
    aligner.push(wheel(0))
    hour = 3_600_000
    released = aligner.push(wheel(hour))
    assert [pair.t_ns for pair in released] == [START]
    aligner.push(speed(hour))
    assert [pair.t_ns for pair in aligner.push(force(hour))] == [START + hour * MS]
