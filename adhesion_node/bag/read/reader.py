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
from ..definitions import difference
from ..metadata import read_metadata
from ..types import same_name
from .mcap_file import TopicInfo
from .opened import open_recording
from .recordings import Record
from .statuses import TYPE as DIAGNOSTICS
from .statuses import statuses
from .unpacked import unpacked


class BagReader:
    """An open recording; a context manager.

    `topics` are the types and `counts` the numbers of messages by topic name, for topics that hold messages.
    `complete` is False when something of the recording is lost or was never written; `damage` then says what, a
    sentence each, and `lost` how many messages of which topic, where the metadata tells. What is there can be read all
    the same. `unread` says of topics why they are not read: of another encoding, of two types, or of a type that is
    defined otherwise. Raises ValueError when there is no such recording or nothing in it is readable.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        metadata = read_metadata(self.path)
        self._recording = open_recording(self.path, metadata)
        try:
            self.infos, self.counts, self.unread = self._survey()
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

        Names match with or without the leading slash; a topic that is not there, or is not read, yields nothing. Of all
        topics come those that are defined otherwise, too, and what is of the type and the definition of the first.
        """
        chosen = set(self.topics) if names is None else {self.resolve(name) for name in names}
        return unpacked(
            self._recording.records(lambda info: info.name in chosen and _is_alike(info, self.infos[info.name]))
        )

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

    @property
    def left_out(self) -> list[str]:
        """A sentence for each topic that is not read."""
        return [f"{why}: {self.counts[name]} messages are left out" for name, why in self.unread.items()]

    def resolve(self, name: str) -> str | None:
        """Return the name under which a topic is recorded, or None when it is not there, or is not read."""
        whole = name if name.startswith("/") else f"{self.namespace}/{name}"
        return next((one for one in self.topics if same_name(one, whole) and one not in self.unread), None)

    def close(self) -> None:
        """Close the files."""
        self._recording.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _survey(self) -> tuple[dict[str, TopicInfo], dict[str, int], dict[str, str]]:
        infos: dict[str, TopicInfo] = {}
        counts: Counter[str] = Counter()
        unread: dict[str, str] = {}
        # What is CDR comes first: a topic is what can be read of it.
        for info, count in sorted(self._recording.infos(), key=lambda each: not each[0].is_cdr):
            if not count:
                continue
            known = infos.setdefault(info.name, info)
            counts[info.name] += count
            if (why := _why_unread(info, known)) is not None:
                unread.setdefault(info.name, f"topic {info.name}: {why}")
        lacking = [*self._recording.damage, *unread.values()]
        if lacking and not any(info.is_cdr for info in infos.values()):
            raise ValueError(f"bag = {self.path}: holds no readable message ({lacking[0]}): name another recording")
        return infos, dict(counts), unread


def _is_alike(info: TopicInfo, known: TopicInfo) -> bool:
    """Whether a topic is read as `known`: a later file may define it otherwise."""
    differences = (difference(one.type, one.definition) for one in (info, known))
    return info.is_cdr and info.type == known.type and len(set(differences)) == 1


def _why_unread(info: TopicInfo, known: TopicInfo) -> str | None:
    """Say what keeps a topic, `known` as another one of its name, from being read; None where nothing does."""
    if not info.is_cdr:
        return f"encoding = {info.encoding!r}: only CDR (ROS 2) is read"
    if info.type != known.type:
        return f"recorded as {known.type} and as {info.type}"
    return difference(info.type, info.definition)
