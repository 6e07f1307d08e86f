# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The log times of a recording: of the simulated clock, without one, with two, whatever the stamps say."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path

import pytest
from conftest import SpinUntil
from messages import message_class
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from recorders import S, clock, publishers, stamped, start

from adhesion_node.bag import BagReader
from adhesion_node.nodes import recorder
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.wire.topics import (
    CLOCK,
    POSITION,
    TRUTH_MU,
)


def test_log_times_are_those_of_publishing_however_late_the_recorder_is(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [TRUTH_MU, POSITION], sim=True)
    # Nothing is taken meanwhile: the recorder finds all of it in its queues, 60 ticks late.
    for tick in range(60):
        ends[CLOCK].publish(clock(tick * S))
        ends[TRUTH_MU].publish(message_class(TRUTH_MU)(data=float(tick)))
        if tick % 7:  # an uneven topic: its queue must not run ahead of the clock's
            ends[POSITION].publish(stamped(POSITION, tick * S))
    spin_until(executor, lambda: sum(recording.counts.values()) == 111)
    recording.close()
    with BagReader(tmp_path / "bag") as reader:
        mus = [(record.log_ns, record.message.data) for record in reader.messages(["train1/truth/mu"])]
        positions = [
            (record.log_ns, record.message.header.stamp.sec) for record in reader.messages(["train1/position"])
        ]
        order = [record.topic for record in reader.messages()]
    assert mus == [(tick * S, float(tick)) for tick in range(60)]
    assert positions == [(tick * S, tick) for tick in range(60) if tick % 7]
    assert order[:3] == ["/train1/truth/mu", "/train1/truth/mu", "/train1/position"]


def test_a_message_keeps_its_clock_when_later_clocks_overtake_it(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """Three messages to a tick: their queue falls behind the clock's."""
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [POSITION], sim=True)
    for number in range(90):
        if number % 3 == 0:
            ends[CLOCK].publish(clock(number // 3 * S))
        ends[POSITION].publish(stamped(POSITION, number // 3 * S + number))
    spin_until(executor, lambda: recording.heard[POSITION] == 90)
    recording.close()
    with BagReader(tmp_path / "bag") as reader:
        times = [(record.log_ns, record.message.header.stamp.nanosec) for record in reader.messages()]
    assert times == [(number // 3 * S, number) for number in range(90)]


def has_heard(recording: Recorder, count: int) -> bool:
    return recording.heard[CLOCK] == recording.heard[POSITION] == count


def test_two_clocks_are_told_and_begin_no_file_with_every_message(
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    capfd: pytest.CaptureFixture[str],
) -> None:
    apart_s = 1800
    limits = recorder.LIMITS._replace(max_duration_ns=apart_s * S)
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [POSITION], True, limits)
    other = publishers(Node("other", context=context), CLOCK)[CLOCK]
    spin_until(executor, other.get_subscription_count)
    for second in range(30):
        for end, t_ns in ((ends[CLOCK], second * S), (other, (second + apart_s) * S)):
            end.publish(clock(t_ns))
            ends[POSITION].publish(stamped(POSITION, t_ns))
        spin_until(executor, partial(has_heard, recording, 2 * (second + 1)))
    recording.close()
    with BagReader(tmp_path / "bag") as reader:
        assert reader.counts == {"/train1/position": 60}
    assert len(list((tmp_path / "bag").glob("*.mcap"))) <= 2
    assert capfd.readouterr().err.count(recorder.WENT_BACK) == 1


def test_without_a_clock_the_stamp_takes_its_place(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [TRUTH_MU, POSITION], sim=True)
    ends[POSITION].publish(stamped(POSITION, 3 * S))
    spin_until(executor, lambda: recording.heard[POSITION])
    ends[TRUTH_MU].publish(message_class(TRUTH_MU)(data=0.1))
    spin_until(executor, lambda: recording.heard[TRUTH_MU])
    recording.close()
    with BagReader(tmp_path / "bag") as reader:
        assert [record.log_ns for record in reader.messages()] == [3 * S, 3 * S]


def test_a_clock_that_is_switched_on_on_the_way_moves_no_log_time(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """Until the first /clock all was logged at 0."""
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [POSITION], sim=False)
    before_ns = time.time_ns()
    assert recording.set_parameters([Parameter("use_sim_time", value=True)])[0].successful
    ends[POSITION].publish(stamped(POSITION, 3 * S))
    spin_until(executor, lambda: recording.heard[POSITION])
    recording.close()
    with BagReader(tmp_path / "bag") as reader:
        (record,) = reader.messages()
    assert before_ns <= record.log_ns <= time.time_ns()


def test_a_stamp_before_1970_does_not_end_the_recording(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [POSITION], sim=True)
    ends[POSITION].publish(stamped(POSITION, -3 * S))
    spin_until(executor, lambda: recording.heard[POSITION])
    recording.close()
    with BagReader(tmp_path / "bag") as reader:
        assert [(record.log_ns, record.message.header.stamp.sec) for record in reader.messages()] == [(0, -3)]
