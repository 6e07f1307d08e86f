# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.


"""Recordings of other recorders: sqlite3, and what is compressed by files or by messages, whole and cut off."""

from __future__ import annotations

import os
import sqlite3
import tempfile
from contextlib import closing
from itertools import product
from pathlib import Path
from shutil import copyfile

import cdrs
import pytest
from recorded import S
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from test_recording_survives import file_size_limit

from adhesion_node.bag import BagReader, Record, typestore
from adhesion_node.tools import recover
from adhesion_node.wire.topics import POSITION

TOPIC = "/train1/odometry/position"

FORMS = [
    (plugin, mode)
    for plugin, mode in product(StoragePlugin, CompressionMode)
    if (plugin, mode) != (StoragePlugin.SQLITE3, CompressionMode.STORAGE)  # it has no compression of its own
]

CUT = [form for form in FORMS if form[1] is not CompressionMode.STORAGE]


def recording(path: Path, plugin: StoragePlugin, mode: CompressionMode, steps: int = 50) -> tuple[Path, list[Record]]:
    """Write a recording; its file and what it holds, which hardly compresses."""
    foreign = Writer(path, version=9, storage_plugin=plugin)
    foreign.set_compression(mode, CompressionFormat.ZSTD)
    places = [step / 7 for step in range(steps)]
    written = [Record(TOPIC, POSITION.type, cdrs.position(n * S, x, x), n * S) for n, x in enumerate(places)]
    with foreign:
        connection = foreign.add_connection(TOPIC, POSITION.type, typestore=typestore())
        for record in written:
            foreign.write(connection, record.log_ns, record.cdr)
    (file,) = (file for file in path.iterdir() if file.name != "metadata.yaml")
    return file, written


@pytest.mark.parametrize(("plugin", "mode"), FORMS)
def test_recordings_of_other_recorders(tmp_path: Path, plugin: StoragePlugin, mode: CompressionMode) -> None:
    file, written = recording(tmp_path / "foreign", plugin, mode)
    with BagReader(tmp_path / "foreign") as reader:
        assert reader.complete
        assert reader.topics == {TOPIC: POSITION.type}
        assert reader.counts == {TOPIC: 50}
        assert list(reader.messages()) == written
        assert list(reader.messages(["position"])) == []
    (tmp_path / "foreign" / "metadata.yaml").unlink()
    for path in (tmp_path / "foreign", file):
        with BagReader(path) as reader:
            assert list(reader.messages()) == written, "an interrupted recorder leaves no metadata"


@pytest.mark.parametrize(("plugin", "mode"), CUT)
@pytest.mark.parametrize("has_metadata", [True, False])
def test_what_is_before_the_cut_is_read_and_recovered(
    tmp_path: Path, plugin: StoragePlugin, mode: CompressionMode, has_metadata: bool
) -> None:
    """A database, or a file that was compressed as a whole, was refused; compressed messages were no messages."""
    file, written = recording(tmp_path / "cut", plugin, mode, steps=20_000)
    with file.open("r+b") as stream:
        stream.truncate(stream.seek(0, 2) * 2 // 3)
    if not has_metadata:
        (tmp_path / "cut" / "metadata.yaml").unlink()
    with BagReader(tmp_path / "cut") as reader:
        read = list(reader.messages())
        assert read == written[: len(read)]
        assert reader.lost == ({TOPIC: 20_000 - len(read)} if has_metadata else {})
        assert not reader.complete
        assert all(str(tmp_path / "cut") in said for said in reader.damage[: 1 + (mode is CompressionMode.FILE)])
    assert len(read) > 10_000
    assert recover.main([str(tmp_path / "cut"), "--output", str(tmp_path / "whole")]) == 0
    with BagReader(tmp_path / "whole") as whole:
        assert (whole.complete, list(whole.messages())) == (True, read)


def test_a_recorder_that_was_interrupted_had_compressed_what_it_had_finished(tmp_path: Path) -> None:
    """Only the last file was read."""
    first, written = recording(tmp_path / "first", StoragePlugin.MCAP, CompressionMode.FILE)
    last, _ = recording(tmp_path / "last", StoragePlugin.MCAP, CompressionMode.NONE)
    (tmp_path / "both").mkdir()
    first.rename(tmp_path / "both" / "x_0.mcap.zstd")
    last.rename(tmp_path / "both" / "x_1.mcap")
    (tmp_path / "both" / "x_2.mcap").touch()
    with BagReader(tmp_path / "both") as reader:
        assert list(reader.messages()) == sorted([*written, *written], key=lambda record: record.log_ns)
        assert f"{tmp_path / 'both' / 'x_2.mcap'}: is empty" in reader.damage[0]


def test_what_a_killed_recorder_has_left_beside_its_database_is_read(tmp_path: Path) -> None:
    """It was left out without a word."""
    file, written = recording(tmp_path / "run", StoragePlugin.SQLITE3, CompressionMode.NONE)
    killed = tmp_path / "killed.db3"
    with closing(sqlite3.connect(file)) as recorder:
        recorder.execute("PRAGMA journal_mode = WAL")
        recorder.execute("INSERT INTO messages SELECT id + 50, topic_id, timestamp + 50000000000, data FROM messages")
        recorder.commit()
        for ending in ("", "-wal"):
            copyfile(f"{file}{ending}", f"{killed}{ending}")
    with BagReader(killed) as reader:
        assert [record.log_ns for record in reader.messages()] == [n * S for n in range(100)]
        assert list(reader.messages())[:50] == written


@pytest.mark.parametrize("mode", [CompressionMode.FILE, CompressionMode.NONE])
def test_no_room_for_what_is_unpacked_names_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], mode: CompressionMode
) -> None:
    file, _ = recording(tmp_path / "run", StoragePlugin.SQLITE3, mode, steps=2000)
    if mode is CompressionMode.NONE:
        os.truncate(file, 200_000)
    (tmp_path / "room").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "room"))
    with file_size_limit(100_000):
        assert recover.main([str(file), "--output", str(tmp_path / "whole")]) == 1
    assert capsys.readouterr().err.startswith(f"recover: {tmp_path / 'room'}/adhesion_node_")
    assert list((tmp_path / "room").iterdir()) == []
    assert not (tmp_path / "whole").exists()


def test_a_path_may_hold_what_means_something_in_an_address(tmp_path: Path) -> None:
    """sqlite3 opened another file, and the database was refused."""
    _, written = recording(tmp_path / "run", StoragePlugin.SQLITE3, CompressionMode.NONE)
    (tmp_path / "run").rename(tmp_path / "run #1? ü%20")
    with BagReader(tmp_path / "run #1? ü%20") as reader:
        assert (reader.complete, list(reader.messages())) == (True, written)
