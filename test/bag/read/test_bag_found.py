# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is a recording and what is none: directories, split recordings, metadata, those of other recorders."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

import pytest
from recorded import write_steps

from adhesion_node.bag import BagReader
from adhesion_node.bag.write.writer import file_name

INFINITE = (
    "rosbag2_bagfile_information: {topics_with_message_count: [{topic_metadata: {name: a}, message_count: .inf}]}"
)


@pytest.mark.parametrize("text", ["[" * 20_000, INFINITE])
def test_metadata_that_makes_no_sense_is_as_good_as_none(text: str, tmp_path: Path) -> None:
    written = write_steps(tmp_path / "bag", 3)
    (tmp_path / "bag" / "metadata.yaml").write_text(text)
    with BagReader(tmp_path / "bag") as reader:
        assert list(reader.messages()) == written
        assert "has no readable metadata.yaml" in reader.damage[0]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("x.mcap", b"", r"x\.mcap: is empty: name another recording"),
        ("x.mcap", b"garbage " * 100, r"x\.mcap: is not an MCAP file"),
        ("x.mcap", b"\x89MCAP0\r\n", r"x\.mcap: holds no readable message \(.*breaks off"),
        ("x.mcap", b"\x89MCAP0\r\n" + b"\xff" * 300, r"x\.mcap: holds no readable message"),
        ("x.db3", b"garbage " * 100, r"no readable message \(.*x\.db3 is cut off or damaged \(no such table: topics\)"),
        ("x.bag", b"#ROSBAG V2.0", r"x\.bag: is no recording of ROS 2: convert it with rosbags-convert"),
        ("x.CSV", b"time,speed", r"x\.CSV: is no recording of ROS 2: make one of a log by import_csv"),
        ("x.mcap.zstd", b"text", r"x\.mcap\.zstd: nothing of it can be decompressed: name another recording"),
        ("x.csv.zstd", b"text", r"x\.csv\.zstd: is no recording of ROS 2: name a rosbag2 directory"),
        ("x.txt", b"text", r"x\.txt: is no recording of ROS 2: name a rosbag2 directory or an \.mcap file"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message):
        BagReader(tmp_path / name)


def test_directories_without_a_recording_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"missing: does not exist: name a rosbag2 directory"):
        BagReader(tmp_path / "missing")
    with pytest.raises(ValueError, match=r"holds no \.mcap or \.db3 file"):
        BagReader(tmp_path)


def test_a_folder_that_may_not_be_read_is_not_told_to_be_empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(path: Any) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(os, "scandir", refuse)
    with pytest.raises(PermissionError, match="Permission denied"):
        BagReader(tmp_path)


def test_recordings_within_a_folder_are_named(tmp_path: Path) -> None:
    for name in ("tuesday", "monday"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run_0.mcap").touch()
    with pytest.raises(ValueError, match=r"name the directory of a recording, as .*monday$"):
        BagReader(tmp_path)


def test_broken_metadata_does_not_matter(tmp_path: Path) -> None:
    written = write_steps(tmp_path / "bag", 3)
    (tmp_path / "bag" / "metadata.yaml").write_text("{ this is : [ no yaml")
    with BagReader(tmp_path / "bag") as reader:
        assert list(reader.messages()) == written


def test_a_missing_file_of_a_split_recording_is_reported(tmp_path: Path) -> None:
    written = write_steps(tmp_path / "bag", 3)
    metadata = tmp_path / "bag" / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(f"- {file_name(0)}\n", f"- {file_name(0)}\n  - bag_1.mcap\n"))
    with BagReader(tmp_path / "bag") as reader:
        assert list(reader.messages()) == written
        assert not reader.complete
        assert reader.damage[0].endswith("bag_1.mcap is missing")


def test_split_recordings_are_merged(tmp_path: Path) -> None:
    one, two = write_steps(tmp_path / "one", 300), write_steps(tmp_path / "two", 300, first=200)
    both = tmp_path / "both"
    both.mkdir()
    (tmp_path / "one" / file_name(0)).rename(both / "x_9.mcap")
    (tmp_path / "two" / file_name(0)).rename(both / "x_10.mcap")
    with BagReader(both) as reader:
        assert list(reader.messages()) == sorted([*one, *two], key=lambda record: record.log_ns)
