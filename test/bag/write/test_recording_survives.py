# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is left of a recording when its recorder is killed at any moment, or its disk is full."""

from __future__ import annotations

import resource
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cdrs
import numpy as np
import pytest
import yaml
from conftest import SpinUntil
from mcap.reader import make_reader
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from recorders import clock, has_messages, recording_process, stamped, start
from rosbags.rosbag2 import Reader

from adhesion_node.bag import BagReader, BagWriter, Limits
from adhesion_node.bag.write.part import MARGIN_BYTES, STEP_BYTES
from adhesion_node.bag.write.writer import file_name
from adhesion_node.nodes import recorder
from adhesion_node.nodes.ros.qos import SENSOR_PUBLISHER, advertise, subscribe
from adhesion_node.tools import recover
from adhesion_node.wire.topics import CLOCK, DIAGNOSTICS, POSITION

S = 10**9
SIMULATED = ("--ros-args", "-p", "use_sim_time:=true")
RELIABLE = ("--ros-args", "-p", f"qos_overrides./{POSITION.name}.subscription.reliability:=reliable")
"""By default the recorder listens best effort, and a busy machine may lose of what is sent so."""

OFTEN = ("-p", "diagnostics_period_s:=0.1")
"""The recorder says ten times in a second of its own what it has taken."""


def assert_complete(bag: Path, messages: int) -> None:
    """Check with three readers that a recording is whole."""
    with BagReader(bag) as ours, Reader(bag) as other:
        assert ours.complete, ours.damage
        assert sum(ours.counts.values()) == len(list(ours.messages())) == other.message_count == messages
    listed = metadata(bag)["files"]
    assert [file["message_count"] for file in listed] == [indexed(bag / file["path"]) for file in listed]
    assert sorted(path.name for path in bag.iterdir()) == sorted([*(file["path"] for file in listed), "metadata.yaml"])


def metadata(bag: Path) -> dict[str, Any]:
    document = yaml.safe_load((bag / "metadata.yaml").read_text())
    return dict(document["rosbag2_bagfile_information"])


def indexed(file: Path) -> int:
    """The number of messages by the index at the end of an MCAP file."""
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    return summary.statistics.message_count


@dataclass
class Talker:
    """Publishes a position every 10 ms once it is heard; the stamp is the number of the message.

    `taken` is what a recorder has said: how many messages it had by then, of all topics.
    """

    node: Node
    clock_stands: bool
    noise: Iterator[str] | None = None
    sent: int = 0
    taken: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        patient = copy(SENSOR_PUBLISHER)
        patient.depth = recorder.DEPTH  # for a recorder that is held up
        self._end = advertise(self.node, POSITION, patient)
        self._clock = advertise(self.node, CLOCK, SENSOR_PUBLISHER)
        subscribe(self.node, DIAGNOSTICS, self._hear)
        self.node.create_timer(0.01, self._talk)

    def _hear(self, message: Any) -> None:
        said = {pair.key: pair.value for pair in message.status[0].values}
        self.taken.append(int(said["written"]) + int(said["waiting"]))

    def _talk(self) -> None:
        if not self._end.get_subscription_count():
            return
        if self.clock_stands:
            self._clock.publish(clock(5 * S))
        self.sent += 1
        message = stamped(POSITION, self.sent)
        if self.noise is not None:
            message.header.frame_id = next(self.noise)
        self._end.publish(message)


@pytest.mark.parametrize(("seed", "options"), [(1, ()), (2, ()), (3, ()), (4, SIMULATED), (5, SIMULATED)])
def test_a_killed_recorder_loses_a_second_at_most(
    seed: int,
    options: tuple[str, ...],
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
) -> None:
    """With and without a simulated clock, which stands still: no log time passes then.

    It is a second in which the recorder is given the processor: its own ten last words tell of it.
    """
    talker = Talker(Node("talker", context=context), clock_stands=bool(options))
    executor.add_node(talker.node)
    with recording_process(tmp_path / "bag", *options, *RELIABLE, silent=OFTEN) as process:
        spin_until(executor, lambda: has_messages(tmp_path / "bag"))
        enough = talker.sent + int(np.random.default_rng(seed).integers(100, 200))
        words = len(talker.taken) + 11
        spin_until(executor, lambda: talker.sent >= enough and len(talker.taken) >= words)
        process.kill()
        process.wait()
    with BagReader(tmp_path / "bag") as reader:
        assert not reader.complete
        numbers = [record.message.header.stamp.nanosec for record in reader.messages(["/position"])]
        on_disk = sum(reader.counts.values())
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), "nothing is missing before the end"
    assert on_disk >= talker.taken[-11] > 0, "of a second before its last word"
    assert recover.main([str(tmp_path / "bag"), "--output", str(tmp_path / "whole")]) == 0
    assert_complete(tmp_path / "whole", on_disk)


def incompressible(rng: np.random.Generator) -> Iterator[str]:
    while True:
        yield rng.bytes(8000).hex()


@pytest.mark.parametrize("options", [(), SIMULATED])
def test_a_full_disk_ends_the_recorder_with_a_complete_recording(
    options: tuple[str, ...],
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
) -> None:
    """A limit of the file's size stands for the disk: the operating system refuses to write beyond, as root too."""
    texts = incompressible(np.random.default_rng(1))
    talker = Talker(Node("talker", context=context), clock_stands=bool(options), noise=texts)
    executor.add_node(talker.node)
    with recording_process(tmp_path / "bag", *options, *RELIABLE) as process:
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (10**6, 10**6))
        spin_until(executor, lambda: process.poll() is not None)
        out, err = process.communicate()
    assert (process.returncode, out) == (1, "")
    assert "Traceback" not in err
    last = err.splitlines()[-1]
    assert "File too large: the recording ends here, make room for another" in last
    assert str(tmp_path / "bag") in last
    with BagReader(tmp_path / "bag") as reader:
        numbers = [record.message.header.stamp.nanosec for record in reader.messages()]
    messages = len(numbers)
    assert numbers == list(range(numbers[0], numbers[0] + messages))
    assert messages > 20
    assert_complete(tmp_path / "bag", messages)


@contextmanager
def file_size_limit(size: int) -> Iterator[None]:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def write_without_end(writer: BagWriter, rng: np.random.Generator, longest: int) -> None:
    for number in count():
        cdr = rng.bytes(int(rng.integers(longest)))
        writer.write(f"/topic_{rng.integers(20)}", "std_msgs/msg/String", cdr, number * S // 10)


@pytest.mark.parametrize("seed", range(12))
def test_wherever_the_disk_is_full_the_recording_can_be_ended(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    longest = int(rng.choice([30, 300, 30_000]))
    writer = BagWriter(tmp_path / "bag", Limits(span_ns=3 * S // 10))
    with file_size_limit(int(rng.integers(400_000, 1_500_000))):
        with pytest.raises(OSError, match="File too large") as full:
            write_without_end(writer, rng, longest)
        assert full.value.filename == str(tmp_path / "bag" / file_name(0))
        messages = sum(writer.counts.values())
        writer.close()
    assert_complete(tmp_path / "bag", messages)


def test_a_recording_that_cannot_begin_leaves_nothing(tmp_path: Path) -> None:
    with file_size_limit(STEP_BYTES), pytest.raises(OSError, match="File too large"):
        BagWriter(tmp_path / "bag")
    assert not (tmp_path / "bag").exists()
    with pytest.raises(OSError, match=r"MB are free where 1000000000 MB are to stay free"):
        BagWriter(tmp_path / "bag", Limits(min_free_bytes=1e15))
    assert not (tmp_path / "bag").exists()


def test_the_end_of_a_file_gives_back_the_room_that_metadata_needs(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    writer.write("/position", POSITION.type, cdrs.position(0, 0.0, 1.0), 0)
    held = (tmp_path / "bag" / file_name(0)).stat().st_blocks
    writer.close()
    left = (tmp_path / "bag" / file_name(0)).stat()
    assert (held - left.st_blocks) * 512 >= MARGIN_BYTES
    assert left.st_size < 10_000


def test_the_recorder_stops_before_its_disk_is_full(
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [POSITION], sim=False)
    ends[POSITION].publish(stamped(POSITION, 1))
    spin_until(executor, lambda: recording.counts)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=99_000_000))
    with pytest.raises(OSError, match="99 MB are free where 100 MB are to stay free: delete something") as full:
        spin_until(executor, lambda: False)
    assert full.value.filename == str(tmp_path / "bag")
    recording.close()
    assert_complete(tmp_path / "bag", 1)


def test_a_disk_that_is_full_at_the_end_still_leaves_a_complete_recording(
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The messages that wait for their log time do not fit any more."""
    monkeypatch.setattr(recorder, "ROUNDS", 10_000)  # however long it takes, they wait
    recording, ends = start(tmp_path / "bag", context, executor, spin_until, [POSITION], sim=True)
    texts = incompressible(np.random.default_rng(1))
    for number in range(40):
        message = stamped(POSITION, number)
        message.header.frame_id = next(texts)
        ends[POSITION].publish(message)
    spin_until(executor, lambda: recording.heard[POSITION] == 40)
    with file_size_limit(400_000), pytest.raises(OSError, match="File too large: the recording ends here"):
        recording.close()
    messages = recording.counts["/train1/position"]
    assert 0 < messages < 40
    assert_complete(tmp_path / "bag", messages)
