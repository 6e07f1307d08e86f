# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The recorder: every topic under its resolved name, log times of the simulated clock, interruption, shutdown."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from conftest import SpinUntil
from messages import message_class
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rosbags.rosbag2 import Reader
from rosgraph_msgs.msg import Clock

from adhesion_node.bag import BagReader, Limits
from adhesion_node.nodes import recorder
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.nodes.ros.qos import LATCHED, RESULT, SENSOR_PUBLISHER, advertise, subscribe
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import (
    BRAKING_CURVE,
    BRAKING_CURVE_NOMINAL,
    CLOCK,
    DIAGNOSTICS,
    POSITION,
    RECORDED,
    SENSORS,
    STATE,
    TRUTH,
    TRUTH_MU,
)

S = 10**9
SILENT = [Parameter("diagnostics_period_s", value=3600.0)]
"""What the recorder says of itself once a second would be recorded."""


def publishers(node: Node, *topics: Topic) -> dict[Topic, Publisher]:
    return {topic: advertise(node, topic, _profile(topic)) for topic in topics}


def _profile(topic: Topic) -> Any:
    if topic in (BRAKING_CURVE, BRAKING_CURVE_NOMINAL):
        return LATCHED
    return SENSOR_PUBLISHER if topic in (*SENSORS, *TRUTH) else RESULT


def stamped(topic: Topic, t_ns: int) -> Any:
    message = message_class(topic)()
    if hasattr(message, "header"):
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(t_ns, S)
    return message


def clock(t_ns: int) -> Clock:
    message = Clock()
    message.clock.sec, message.clock.nanosec = divmod(t_ns, S)
    return message


def simulated() -> list[Parameter]:
    return [Parameter("use_sim_time", value=True), *SILENT]


def start(
    path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    topics: list[Topic],
    sim: bool,
    limits: Limits = recorder.LIMITS,
) -> tuple[Recorder, dict[Topic, Publisher]]:
    """Return a recorder and publishers of `topics` and /clock that have found each other."""
    talker = Node("talker", context=context, namespace="/train1")
    ends = publishers(talker, *topics, CLOCK)
    given = simulated() if sim else SILENT
    recording = Recorder(path, limits, context=context, namespace="/train1", parameter_overrides=given)
    executor.add_node(talker)
    executor.add_node(recording)
    heard = [end for topic, end in ends.items() if sim or topic is not CLOCK]
    spin_until(executor, lambda: all(end.get_subscription_count() > 0 for end in heard))
    return recording, ends


@pytest.mark.parametrize("sim", [True, False])
def test_every_topic_is_recorded_under_its_resolved_name(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil, sim: bool
) -> None:
    before_ns = time.time_ns()
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, list(RECORDED), sim)
    ends[CLOCK].publish(clock(7 * S))
    for topic in RECORDED:
        ends[topic].publish(stamped(topic, 5 * S))
    spin_until(executor, lambda: len(recording.counts) == len(RECORDED))
    recording.close()
    expected = {topic.name if topic.name[0] == "/" else f"/train1/{topic.name}": topic.type for topic in RECORDED}
    with BagReader(tmp_path / "bag") as reader:
        assert reader.complete
        assert reader.topics == expected
        assert set(reader.counts.values()) == {1}
        latched = {name for name, info in reader.infos.items() for one in info.offered if one.durability.value == 1}
        for record in reader.messages():
            if sim:
                assert record.log_ns == 7 * S
            else:
                assert before_ns <= record.log_ns <= time.time_ns()
            assert not hasattr(record.message, "header") or record.message.header.stamp.sec == 5
    assert latched == {f"/train1/{topic.name}" for topic in (BRAKING_CURVE, BRAKING_CURVE_NOMINAL)}


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


def test_a_curve_from_before_the_recorder_is_recorded(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    talker = Node("talker", context=context)
    executor.add_node(talker)
    publishers(talker, BRAKING_CURVE)[BRAKING_CURVE].publish(stamped(BRAKING_CURVE, 4 * S))
    recording = Recorder(tmp_path / "bag", context=context, parameter_overrides=SILENT)
    executor.add_node(recording)
    spin_until(executor, lambda: recording.counts == {"/adhesion/braking_curve": 1})
    recording.close()
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 1


def test_an_existing_directory_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert recorder.main(["--output", str(tmp_path)]) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert "it exists already, give the name of a new directory" in line


def test_a_recording_of_days_goes_on_in_new_files(tmp_path: Path) -> None:
    """Unasked: the index of a file stays in memory until it ends."""
    options = recorder._parser().parse_args(["--output", str(tmp_path / "bag")])
    assert options.max_duration_s == recorder.MAX_DURATION_S <= 3600.0


def test_bad_usage(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        recorder.main([])
    assert end.value.code == 2
    assert "--output" in capsys.readouterr().err


@pytest.fixture
def talking(context: Context, executor: SingleThreadedExecutor) -> tuple[Publisher, list[int]]:
    """A node that publishes a position every 10 ms once it is heard, and the stamps it has published."""
    talker = Node("talker", context=context)
    executor.add_node(talker)
    end = advertise(talker, POSITION, SENSOR_PUBLISHER)
    sent: list[int] = []

    def talk() -> None:
        if end.get_subscription_count():
            sent.append(len(sent) + 1)
            end.publish(stamped(POSITION, sent[-1]))

    talker.create_timer(0.01, talk)
    return end, sent


@contextmanager
def recording_process(
    path: Path, *arguments: str, silent: Sequence[str] = ("-p", "diagnostics_period_s:=3600.0")
) -> Iterator[subprocess.Popen[str]]:
    """Run the program; it does not outlive a test that fails."""
    private = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")
    environment = {name: value for name, value in os.environ.items() if name not in private}
    code = "import sys; from adhesion_node.nodes.recorder import main; sys.exit(main())"
    command = [sys.executable, "-c", code, "--output", str(path), *arguments, "--ros-args", *silent]
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def has_messages(bag: Path) -> bool:
    """Tell whether a recording in progress has messages on the disk."""
    try:
        with BagReader(bag) as reader:
            return bool(reader.counts)
    except ValueError:
        return False


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_recording_properly(
    tmp_path: Path,
    talking: tuple[Publisher, list[int]],
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    number: signal.Signals,
) -> None:
    _, sent = talking
    with recording_process(tmp_path / "bag") as process:
        spin_until(executor, lambda: len(sent) >= 50 and has_messages(tmp_path / "bag"), 20.0)
        process.send_signal(number)
        spin_until(executor, lambda: process.poll() is not None)
        out, err = process.communicate()
    assert process.returncode == 0
    assert out == ""
    assert "Traceback" not in err
    with BagReader(tmp_path / "bag") as reader, Reader(tmp_path / "bag") as other:
        assert reader.complete
        assert other.message_count == reader.counts["/position"] > 0


def test_a_recorder_that_was_not_given_the_processor_still_has_what_came_meanwhile(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [STATE, POSITION], False)
    for number in range(1, 801):
        for topic in (STATE, POSITION):
            ends[topic].publish(stamped(topic, number * S))
            assert ends[topic].wait_for_all_acked(Duration(seconds=10))
    spin_until(executor, lambda: len(recording.counts) == 2 and min(recording.counts.values()) == 800)
    recording.close()


def _number(status: Any, key: str) -> int:
    return next(int(pair.value) for pair in status.values if pair.key == key)


def test_what_a_stopped_recorder_has_lost_is_told(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """Of 5000 messages its publisher keeps the last 100; some more are on their way."""
    talker, told = Node("talker", context=context), []
    end = advertise(talker, STATE)
    subscribe(talker, DIAGNOSTICS, lambda message: told.append(message.status[0]))
    executor.add_node(talker)
    with recording_process(tmp_path / "bag", silent=("-p", "diagnostics_period_s:=0.1")) as process:
        spin_until(executor, lambda: end.get_subscription_count() > 0 and bool(told), 20.0)
        end.publish(stamped(STATE, S))
        spin_until(executor, lambda: has_messages(tmp_path / "bag"))
        process.send_signal(signal.SIGSTOP)
        for number in range(5000):
            end.publish(stamped(STATE, (number + 2) * S))
        process.send_signal(signal.SIGCONT)
        spin_until(executor, lambda: "lost on the way" in told[-1].message)
        # of what is written each telling may be one: the rest are states
        spin_until(executor, lambda: _number(told[-1], "written") > 100 + len(told))
        process.send_signal(signal.SIGINT)
        spin_until(executor, lambda: process.poll() is not None)
        _, err = process.communicate()
    with BagReader(tmp_path / "bag") as reader:
        kept = reader.counts["/adhesion/state"]
    lost = _number(told[-1], "lost")
    assert 100 <= kept < 5001
    assert 1 <= lost <= 5001 - kept
    assert "adhesion/state: messages lost on the way" in err
