# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The recorder: every topic under its resolved name, what came before it, where it writes, bad usage."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from conftest import SpinUntil
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from recorders import SILENT, S, clock, publishers, stamped, start
from rosbags.rosbag2 import Reader

from adhesion_node.bag import BagReader
from adhesion_node.nodes import recorder
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.wire.topics import (
    BRAKING_CURVE,
    BRAKING_CURVE_NOMINAL,
    CLOCK,
    RECORDED,
)


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
