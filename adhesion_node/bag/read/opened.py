# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.


"""What of a path is a recording: a file, or those of a directory, some of them compressed as a whole."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from ..metadata import Metadata
from .databases import DamagedDatabases, has_more_beside
from .foreign import ForeignRecording
from .recordings import McapRecording, Recording
from .unpacked import PACKED, UnpackedRecording

KINDS = (".mcap", ".db3")
"""How files of recordings end."""


def open_recording(path: Path, metadata: Metadata) -> Recording:
    """Open what is there; raises ValueError where that is no recording, or unreadable."""
    if path.is_dir():
        return _open_directory(path, metadata)
    if not path.exists():
        raise ValueError(f"bag = {path}: does not exist: name a rosbag2 directory or an .mcap file")
    if _kind(path) in KINDS:
        return _open_files([path])
    hints = {".bag": "convert it with rosbags-convert", ".csv": "make one of a log by import_csv"}
    hint = hints.get(path.suffix.lower(), "name a rosbag2 directory or an .mcap file")
    raise ValueError(f"bag = {path}: is no recording of ROS 2: {hint}")


def _open_directory(path: Path, metadata: Metadata) -> Recording:
    """Open what is there: the metadata is only asked for what the files cannot tell."""
    os.scandir(path).close()  # raises where it may not be read, which glob takes for empty
    files = next(filter(None, (_numbered(path, kind) for kind in KINDS)), None)
    if files is None:
        inner = sorted(file.parent for kind in KINDS for file in path.glob(f"*/*{kind}*"))
        hint = f", as {inner[0]}" if inner else ""
        raise ValueError(f"bag = {path}: holds no .mcap or .db3 file: name the directory of a recording{hint}")
    recording = _open_files(files)
    if not (metadata.readable or recording.damage):
        recording.damage.append(f"{path} has no readable metadata.yaml: its recording was interrupted")
    there = {file.name.removesuffix(PACKED) for file in files}
    recording.damage += [
        f"{path / name} is missing" for name in metadata.files if name.removesuffix(PACKED) not in there
    ]
    return recording


def _open_files(files: Sequence[Path]) -> Recording:
    if any(file.suffix == PACKED for file in files):
        return UnpackedRecording(files, _open_files)
    if _kind(files[0]) == ".mcap":
        return McapRecording(files)
    with suppress(ValueError):
        if not any(map(has_more_beside, files)):
            return ForeignRecording(files)
    return DamagedDatabases(files)


def _kind(file: Path) -> str:
    return Path(file.name.removesuffix(PACKED)).suffix


def _numbered(path: Path, kind: str) -> list[Path]:
    """Return the files of a split recording in their order, x_2 before x_10; what is there unpacked, too, is that."""
    files = {file.name.removesuffix(PACKED): file for file in (*path.glob(f"*{kind}{PACKED}"), *path.glob(f"*{kind}"))}
    return [files[name] for name in sorted(files, key=lambda name: (len(name), name))]
