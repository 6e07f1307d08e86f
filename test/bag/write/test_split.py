# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A recording in several files: their sizes and durations, what the metadata says, interruption, equal runs."""

from __future__ import annotations

import hashlib
import resource
import tracemalloc
from collections import Counter
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from conftest import SpinUntil
from messages import message_class
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from recorders import clock, publishers, simulated, stamped
from test_recording_survives import assert_complete, indexed, metadata

from adhesion_node.bag import BagReader, BagWriter, Limits, Record
from adhesion_node.bag.write import writer
from adhesion_node.bag.write.writer import file_name
from adhesion_node.nodes import recorder
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.tools import recover
from adhesion_node.wire.topics import CLOCK, POSITION, TRUTH_MU

S = 10**9
TEXT = "std_msgs/msg/String"


def noise(steps: int, longest: int) -> list[Record]:
    """Incompressible messages at 10 Hz on three topics."""
    rng = np.random.default_rng(1)
    return [
        Record(f"/t{rng.integers(3)}", TEXT, rng.bytes(int(rng.integers(longest))), step * S // 10)
        for step in range(steps)
    ]


def write(path: Path, records: list[Record], limits: Limits) -> None:
    with BagWriter(path, limits) as recording:
        for record in records:
            recording.write(*record)


@pytest.mark.parametrize("longest", [100, 5000])
def test_no_file_is_greater_than_allowed(tmp_path: Path, longest: int) -> None:
    records, limit = noise(2000, longest), 150_000
    write(tmp_path / "bag", records, Limits(max_bytes=limit, span_ns=S))
    sizes = [(tmp_path / "bag" / name).stat().st_size for name in metadata(tmp_path / "bag")["relative_file_paths"]]
    assert len(sizes) > 1
    assert all(limit // 3 < size <= limit for size in sizes[:-1]), "none is too big, none is wastefully small"
    assert sizes[-1] <= limit
    assert_complete(tmp_path / "bag", len(records))
    with BagReader(tmp_path / "bag") as reader:
        assert list(reader.messages()) == records


def test_a_message_greater_than_a_file_is_a_file_of_its_own(tmp_path: Path) -> None:
    records = noise(4, 5000)
    write(tmp_path / "bag", records, Limits(max_bytes=10.0))
    assert_complete(tmp_path / "bag", 4)
    assert metadata(tmp_path / "bag")["relative_file_paths"] == [file_name(number) for number in range(4)]


def test_files_by_duration_are_listed_with_their_times_and_counts(tmp_path: Path) -> None:
    records = noise(1050, 50)
    write(tmp_path / "bag", records, Limits(max_duration_ns=10 * S))
    information = metadata(tmp_path / "bag")
    names = [file_name(number) for number in range(11)]
    assert information["relative_file_paths"] == names
    for number, file in enumerate(information["files"]):
        count = 100 if number < 10 else 50
        assert file == {
            "path": names[number],
            "starting_time": {"nanoseconds_since_epoch": number * 10 * S},
            "duration": {"nanoseconds": (count - 1) * S // 10},
            "message_count": count,
        }
        assert indexed(tmp_path / "bag" / names[number]) == count
    assert information["starting_time"] == {"nanoseconds_since_epoch": 0}
    assert information["duration"] == {"nanoseconds": records[-1].log_ns}
    by_topic = {
        entry["topic_metadata"]["name"]: entry["message_count"] for entry in information["topics_with_message_count"]
    }
    assert by_topic == Counter(record.topic for record in records)
    assert_complete(tmp_path / "bag", len(records))


@pytest.mark.parametrize("steps", [(0, 1800), (0, 1000, 2000, 1000), (5000, 0, 3000, 9000)])
def test_time_that_goes_to_and_fro_begins_few_files(tmp_path: Path, steps: tuple[int, ...]) -> None:
    """It began one with every message or two, as with two publishers of /clock."""
    records = [Record("/t", TEXT, b"x", steps[k % len(steps)] * S + k) for k in range(400)]
    write(tmp_path / "bag", records, Limits(max_duration_ns=1800 * S, span_ns=S))
    assert len(metadata(tmp_path / "bag")["relative_file_paths"]) <= len(steps)
    assert_complete(tmp_path / "bag", len(records))
    with BagReader(tmp_path / "bag") as reader:
        assert sorted(reader.messages()) == sorted(records)


def test_a_long_file_ends_where_time_begins_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a recording of days of something that loops: memory stays that of one file."""
    monkeypatch.setattr(writer, "FALLEN", 100)
    records = [Record("/t", TEXT, b"x", (3000 + k % 110) * S) for k in range(330)]
    write(tmp_path / "bag", records, Limits(max_duration_ns=105 * S))
    counts = [file["message_count"] for file in metadata(tmp_path / "bag")["files"]]
    assert counts == [105, 5 + 110, 105, 5]


def test_an_interrupted_recording_of_several_files_is_recovered(tmp_path: Path) -> None:
    records = noise(1000, 500)
    dying = BagWriter(tmp_path / "bag", Limits(max_duration_ns=30 * S, span_ns=S))
    for record in records:
        dying.write(*record)
    lost = dying.unsaved  # nothing more is done with the writer: its process died
    assert 0 < lost <= 10
    summary = recover.recover(tmp_path / "bag", tmp_path / "whole")
    assert not summary["complete"]
    with BagReader(tmp_path / "whole") as reader:
        assert list(reader.messages()) == records[:-lost]
    assert_complete(tmp_path / "whole", len(records) - lost)


def test_a_recording_of_more_files_than_a_process_may_open(tmp_path: Path) -> None:
    records = noise(300, 50)
    write(tmp_path / "bag", records, Limits(max_duration_ns=S // 10))
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (200, before[1]))
    try:
        with BagReader(tmp_path / "bag") as reader:
            assert list(reader.messages()) == records
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def has_heard(recording: Recorder, ticks: int) -> bool:
    return all(recording.heard[topic] == ticks for topic in (TRUTH_MU, POSITION))


def record_run(path: Path, context: Context, spin_until: SpinUntil, burst: int) -> list[str]:
    """Record 20 s of simulated time, `burst` ticks at a time, into files of 5 s; return the digests of the files."""
    executor = SingleThreadedExecutor(context=context)
    talker = Node("talker", context=context)
    ends = publishers(talker, TRUTH_MU, POSITION, CLOCK)
    limits = recorder.LIMITS._replace(max_duration_ns=5 * S)
    recording = Recorder(path, limits, context=context, parameter_overrides=simulated())
    executor.add_node(talker)
    executor.add_node(recording)
    spin_until(executor, lambda: all(end.get_subscription_count() > 0 for end in ends.values()))
    for tick in range(200):
        t_ns = 7 * S + tick * S // 10
        ends[CLOCK].publish(clock(t_ns))
        ends[TRUTH_MU].publish(message_class(TRUTH_MU)(data=float(tick)))
        ends[POSITION].publish(stamped(POSITION, t_ns))
        if (tick + 1) % burst == 0:
            spin_until(executor, partial(has_heard, recording, tick + 1))
            if burst >= 2:  # the timer comes at least so often while the clock does not run slower than the system's
                recording.save()
    recording.close()
    executor.shutdown()
    recording.destroy_node()
    talker.destroy_node()
    return [hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted(path.iterdir())]


def test_equal_runs_leave_equal_bytes_however_busy_the_recorder_is(
    tmp_path: Path, context: Context, spin_until: SpinUntil
) -> None:
    digests = [record_run(tmp_path / str(burst), context, spin_until, burst) for burst in (1, 2, 10, 40)]
    assert len(digests[0]) == 5, "four files and the metadata"
    assert all(digest == digests[0] for digest in digests)


@pytest.mark.parametrize("option", ["--max-size-mb", "--max-duration-s", "--min-free-mb"])
@pytest.mark.parametrize("value", ["-1", "nan"])
def test_bad_limits_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str, value: str) -> None:
    assert recorder.main(["--output", str(tmp_path / "bag"), option, value]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"recorder: {option[2:]} = {float(value)}: give at least ")
    assert not (tmp_path / "bag").exists()


def test_memory_is_that_of_one_file_however_many_there_are(tmp_path: Path) -> None:
    limits, held = Limits(span_ns=S // 5, max_duration_ns=20 * S), []
    tracemalloc.start()
    try:
        with BagWriter(tmp_path / "bag", limits) as recording:
            for step in range(5 * 20 * 6):
                for number in range(10):
                    recording.write(f"/topic{number}", POSITION.type, bytes(300), step * S // 5)
                if step % 100 == 99:
                    held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert len(list((tmp_path / "bag").glob("*.mcap"))) == 6
    assert held[5] < 1.1 * held[1]
