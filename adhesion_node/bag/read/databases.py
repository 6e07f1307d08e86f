# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.


"""Databases of sqlite3 that end too early, are damaged or were not closed: their messages up to there.

sqlite3 opens a copy, which it may mend by what its writer has left beside it. Neither the index nor what counts on it
is used: where the messages are in time is found out anew.
"""

import heapq
import shutil
import sqlite3
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, suppress
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory

from ...command.written import naming
from ..qos import parse
from ..types import Definition
from .mcap_file import TopicInfo
from .recordings import Record

NONE = Definition("", "")

_BESIDE = ("-wal", "-journal")
"""How files end, behind a database's name, that hold what was not yet written into it, or what was there before."""


class DamagedDatabases:
    """Files of a recording that cannot be read as they are."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self.damage: list[str] = []
        with ExitStack() as stack:
            folder = Path(stack.enter_context(TemporaryDirectory(prefix="adhesion_node_")))
            with naming(f"{folder} (TMPDIR)"):
                copies = [_copied(path, folder) for path in paths]
            self._files = [stack.enter_context(closing(_Database(*each))) for each in zip(paths, copies, strict=True)]
            self._stack = stack.pop_all()
        for file in self._files:
            if file.why:
                read = f"{len(file.places)} messages before that are read"
                self.damage.append(f"{file.path} is cut off or damaged ({file.why}): {read}")

    def infos(self) -> Iterator[tuple[TopicInfo, int]]:
        """Yield the topics of every file."""
        for file in self._files:
            counts = Counter(topic for _, _, topic in file.places)
            for number, info in file.topics.items():
                yield info, counts[number]

    def records(self, wanted: Callable[[TopicInfo], bool]) -> Iterator[Record]:
        """Yield the records of all files merged."""
        return heapq.merge(*(file.records(wanted) for file in self._files), key=attrgetter("log_ns"))

    def close(self) -> None:
        """Close the files."""
        self._stack.close()


def has_more_beside(path: Path) -> bool:
    """Whether a writer that was killed has left something that belongs into the file."""
    beside = (path.with_name(path.name + ending) for ending in _BESIDE)
    return any(file.exists() and file.stat().st_size for file in beside)


def _copied(path: Path, folder: Path) -> Path:
    """Copy a file with what is beside it; of a page that is cut off sqlite3 would take the rest to be zeros."""
    copy = folder / path.name
    for ending in ("", *_BESIDE):
        source = path.with_name(path.name + ending)
        if source.exists():
            with source.open("rb") as read, copy.with_name(source.name).open("wb") as written:
                shutil.copyfileobj(read, written)
    with copy.open("r+b") as file:
        page_bytes = int.from_bytes(file.read(18)[16:], "big")
        page_bytes = 65_536 if page_bytes == 1 else page_bytes or 1
        file.truncate(file.seek(0, 2) // page_bytes * page_bytes)
    return copy


class _Database:
    """A file: its topics by number, and of every readable message its time, its number and its topic's, sorted."""

    def __init__(self, path: Path, copy: Path) -> None:
        self.path = path
        self.topics: dict[int, TopicInfo] = {}
        self.places: list[tuple[int, int, int]] = []
        self.why = ""
        """What ends reading before the file ends."""
        self._connection = sqlite3.connect(copy)
        self._connection.row_factory = sqlite3.Row
        try:
            # else a file that is shorter than it says is refused before anything is read
            self._connection.execute("PRAGMA writable_schema = ON")
            self._read()
        except sqlite3.DatabaseError as error:
            self.why = str(error)
        self.places.sort()

    def records(self, wanted: Callable[[TopicInfo], bool]) -> Iterator[Record]:
        """Yield the records in the order of time."""
        for log_ns, number, topic in self.places:
            if wanted(info := self.topics[topic]):
                (cdr,) = self._connection.execute("SELECT data FROM messages WHERE id = ?", (number,)).fetchone()
                yield Record(info.name, info.type, cdr, log_ns)

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def _read(self) -> None:
        """Read until a page is missing."""
        definitions = dict[str, Definition]()
        with suppress(sqlite3.OperationalError):  # older ones have none
            for row in self._connection.execute("SELECT * FROM message_definitions"):
                definitions[row["topic_type"]] = Definition(row["encoding"], row["encoded_message_definition"])
        for row in map(dict, self._connection.execute("SELECT * FROM topics")):
            known_as, offered = definitions.get(row["type"], NONE), parse(row.get("offered_qos_profiles", ""))
            self.topics[row["id"]] = TopicInfo(row["name"], row["type"], row["serialization_format"], known_as, offered)
        for row in self._connection.execute("SELECT * FROM messages NOT INDEXED ORDER BY id"):
            if row["topic_id"] in self.topics:
                self.places.append((row["timestamp"], row["id"], row["topic_id"]))
