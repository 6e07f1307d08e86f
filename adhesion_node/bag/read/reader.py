# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Reads a recording: a rosbag2 directory or a single file, finished or not, in the order of log time."""

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Self

from ...wire.messages.refused import Rejected
from ..metadata import Metadata, read_metadata
from ..types import same_name
from .foreign import ForeignRecording
from .mcap_file import TopicInfo
from .recordings import McapRecording, Record, Recording
from .statuses import TYPE as DIAGNOSTICS
from .statuses import statuses


class BagReader:
    """An open recording; a context manager.

    `topics` are the types and `counts` the numbers of messages by topic name, for topics that hold messages.
    `complete` is False when something of the recording is lost or was never written; `damage` then says what, a
    sentence each, and `lost` how many messages of which topic, where the metadata tells. What is there can be read all
    the same. Raises ValueError when there is no such recording or nothing in it is readable.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        metadata = read_metadata(self.path)
        self._recording = _open(self.path, metadata)
        try:
            self.infos, self.counts = self._survey()
        except BaseException:
            self.close()
            raise
        missing = {name: count - self.counts.get(name, 0) for name, count in metadata.messages.items()}
        self.lost = {name: count for name, count in missing.items() if count > 0}
        self.topics: dict[str, str] = {name: info.type for name, info in self.infos.items()}
        losses = [f"{name}: {count} messages are lost" for name, count in self.lost.items()]
        self.damage = (*self._recording.damage, *losses)
        self.complete = not self.damage
        self.namespace = ""
        """Of the train that is read, as "/train1": relative names are its topics."""
        self._undecodable: set[Record] = set()

    def messages(self, names: Iterable[str] | None = None) -> Iterator[Record]:
        """Yield the records in the order of (log time, arrival), of all topics or of those named.

        Names match with or without the leading slash; a topic that is not there yields nothing.
        """
        chosen = set(self.topics) if names is None else {self.resolve(name) for name in names}
        return self._recording.records(chosen.__contains__)

    def decoded(self, records: Iterable[Record]) -> Iterator[tuple[Record, Any]]:
        """Yield records, each with its message; those that do not decode are left out.

        The values of a status come as one dict.
        """
        for record in records:
            try:
                message = (record.type == DIAGNOSTICS and statuses(record.cdr)) or record.message
            except Rejected:
                self._undecodable.add(record)
            else:
                yield record, message

    @property
    def undecodable(self) -> dict[str, int]:
        """Numbers of the messages that `decoded` has left out so far, by topic."""
        return dict(Counter(record.topic for record in self._undecodable))

    def resolve(self, name: str) -> str | None:
        """Return the name under which a topic is recorded, or None when it is not there."""
        whole = name if name.startswith("/") else f"{self.namespace}/{name}"
        return next((recorded for recorded in self.topics if same_name(recorded, whole)), None)

    def close(self) -> None:
        """Close the files."""
        self._recording.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _survey(self) -> tuple[dict[str, TopicInfo], dict[str, int]]:
        infos: dict[str, TopicInfo] = {}
        counts: Counter[str] = Counter()
        for info, count in self._recording.infos():
            if not count:
                continue
            if info.encoding != "cdr":
                raise ValueError(f"bag = {self.path}: topic {info.name} is {info.encoding!r}: only CDR (ROS 2) is read")
            known = infos.setdefault(info.name, info)
            if known.type != info.type:
                raise ValueError(f"bag = {self.path}: topic {info.name} is both {known.type} and {info.type}: split it")
            counts[info.name] += count
        if self._recording.damage and not infos:
            first = self._recording.damage[0]
            raise ValueError(f"bag = {self.path}: holds no readable message ({first}): name another recording")
        return infos, dict(counts)


def _open(path: Path, metadata: Metadata) -> Recording:
    if path.is_dir():
        return _open_directory(path, metadata)
    if not path.exists():
        raise ValueError(f"bag = {path}: does not exist: name a rosbag2 directory or an .mcap file")
    if path.suffix == ".mcap":
        return McapRecording([path])
    if path.suffix == ".db3":
        return ForeignRecording([path])
    hints = {
        ".zstd": "name its directory",
        ".bag": "convert it with rosbags-convert",
        ".csv": "make one of a log by import_csv",
    }
    hint = hints.get(path.suffix.lower(), "name a rosbag2 directory or an .mcap file")
    raise ValueError(f"bag = {path}: is no recording of ROS 2: {hint}")


def _open_directory(path: Path, metadata: Metadata) -> Recording:
    """Open what is there: the metadata is only asked for what the files cannot tell."""
    if metadata.compressed:
        return ForeignRecording([path])
    recording: Recording
    if mcaps := _numbered(path, ".mcap"):
        recording = McapRecording(mcaps)
    elif databases := _numbered(path, ".db3"):
        recording = ForeignRecording(databases)
    elif compressed := sorted(path.glob("*.zstd")):
        files = " ".join(str(file) for file in compressed)
        raise ValueError(
            f"bag = {path}: is compressed and has no readable metadata.yaml: decompress it: zstd -d {files}"
        )
    else:
        inner = sorted(file.parent for ending in ("mcap", "db3") for file in path.glob(f"*/*.{ending}"))
        hint = f", as {inner[0]}" if inner else ""
        raise ValueError(f"bag = {path}: holds no .mcap or .db3 file: name the directory of a recording{hint}")
    if not (metadata.readable or recording.damage):
        recording.damage.append(f"{path} has no readable metadata.yaml: its recording was interrupted")
    recording.damage += [f"{path / name} is missing" for name in metadata.files if not (path / name).exists()]
    return recording


def _numbered(path: Path, suffix: str) -> list[Path]:
    """Return the files of a split recording in their order: x_2 before x_10."""
    return sorted(path.glob(f"*{suffix}"), key=lambda file: (len(file.name), file.name))
