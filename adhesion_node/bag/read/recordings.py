# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A recording of one or more files as one stream of records in the order of (log time, arrival)."""

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from itertools import zip_longest
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from ...wire.messages.refused import Reason, Rejected
from ..types import UnknownTypeError, deserialize
from .mcap_file import McapFile, TopicInfo


class Record(NamedTuple):
    """One recorded message."""

    topic: str
    type: str
    cdr: bytes
    log_ns: int

    @property
    def message(self) -> Any:
        """The decoded message, decoded anew at each access. Raises Rejected when the bytes do not fit the type."""
        try:
            return deserialize(self.cdr, self.type)
        except ValueError as error:
            raise Rejected(Reason.UNDECODABLE, f"{self.topic} at {self.log_ns} ns: {error}") from error

    @property
    def is_whole(self) -> bool:
        """Whether it decodes, or is of a type that only others know."""
        try:
            deserialize(self.cdr, self.type)
        except UnknownTypeError:
            return True
        except ValueError:
            return False
        return True


class Recording(Protocol):
    """What `BagReader` needs of a recording."""

    damage: list[str]

    def infos(self) -> Iterator[tuple[TopicInfo, int]]:
        """Yield the topics with their numbers of messages; a topic may come several times."""

    def records(self, wanted: Callable[[TopicInfo], bool]) -> Iterator[Record]:
        """Yield the records of the topics that are wanted."""

    def close(self) -> None:
        """Close the files."""


class McapRecording:
    """MCAP files, also unfinished and damaged ones."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._files = list[McapFile]()
        self.damage = list[str]()
        for path in paths:
            try:
                self._files.append(file := McapFile(path))
                self.damage += file.damage
            except ValueError as error:
                if len(paths) == 1:
                    raise
                self.damage.append(str(error))

    def infos(self) -> Iterator[tuple[TopicInfo, int]]:
        """Yield the topics of every file."""
        for file in self._files:
            for channel, info in file.topics.items():
                yield info, file.counts[channel]

    def records(self, wanted: Callable[[TopicInfo], bool]) -> Iterator[Record]:
        """Yield the records: a block is read once no earlier message can follow, so few are in memory at a time."""
        blocks = sorted(
            (block.start_ns, number, block.offset, block)
            for number, file in enumerate(self._files)
            for block in file.blocks
        )
        topics = [{at: info for at, info in file.topics.items() if wanted(info)} for file in self._files]
        pending: list[tuple[int, int, int, int, Record]] = []
        for (_, number, offset, block), following in zip_longest(blocks, blocks[1:]):
            of_channel = topics[number].get
            pending += [
                (log_ns, number, offset, index, Record(info.name, info.type, cdr, log_ns))
                for index, (channel, log_ns, cdr) in enumerate(self._files[number].messages(block))
                if (info := of_channel(channel)) is not None
            ]
            pending.sort()
            ready = bisect_left(pending, following[:1]) if following else len(pending)
            yield from map(itemgetter(4), pending[:ready])
            del pending[:ready]

    def close(self) -> None:
        """Nothing stays open."""
