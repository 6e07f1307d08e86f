# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Writes a recording: a rosbag2 directory with one or several MCAP files and metadata.yaml beside them."""

import errno
import math
import shutil
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, Self

from rosbags.interfaces import Qos

from ..definitions import difference
from ..metadata import LATEST_NS, File, Topic, document
from ..qos import RELIABLE
from ..types import Definition, definition, type_hash
from .part import Part, message_bound

MB = 1_000_000

FALLEN = 50_000
"""Messages that a file holds at least before one ends it whose log time has fallen: time may go to and fro for ever."""


class Limits(NamedTuple):
    """What bounds a recording: its files, what an interruption costs, and the disk."""

    max_bytes: float = math.inf
    """Size of a file; the recording goes on in the next one. A single greater message is a file of its own."""
    max_duration_ns: float = math.inf
    """Log time from the first message of a file to the first of the next; before it, see `FALLEN`."""
    span_ns: float = math.inf
    """Log time after which messages are handed to the operating system. That comes with the next message or
    `BagWriter.advance`, and nothing but log time decides: equal messages still give equal files."""
    min_free_bytes: float = 0
    """The recording ends when less than this is free on its disk."""


class BagWriter:
    """Writes messages into a new directory; a context manager. Equal messages give equal files.

    Nothing but what is passed in is written, the clock is not read. Until `close` (or when the process dies) the last
    file has no index and the directory no metadata; `BagReader` reads it up to the last `flush`, full chunk or
    `Limits.span_ns`. Raises ValueError when the directory exists and OSError when the disk is full; `close` then still
    makes the recording complete up to there.
    """

    def __init__(self, path: Path | str, limits: Limits | None = None) -> None:
        self.path = Path(path)
        self._limits = limits or Limits()
        self._topics: dict[str, tuple[Topic, Definition]] = {}
        self._counts: Counter[str] = Counter()
        self._files: list[File] = []
        self._begun_ns = 0
        self._closed = False
        if self.path.exists():
            raise ValueError(f"output = {str(self.path)!r}: it exists already, give the name of a new directory")
        self.path.mkdir(parents=True)
        try:
            self._part = self._open(0)
        except OSError:
            self.path.rmdir()
            raise

    def add_topic(
        self, name: str, type_name: str, *, offered: Sequence[Qos] = (), known_as: Definition | None = None
    ) -> None:
        """Announce a topic; `write` does so itself where the defaults fit. Announcing again changes nothing.

        `offered` is the quality of service of its publishers, as far as known. `known_as` defines a type that is not
        part of ROS 2 Jazzy.
        Raises ValueError when the type is unknown.
        """
        if name not in self._topics:
            defined = known_as if known_as and known_as.text else definition(type_name)
            digest = "" if difference(type_name, defined) else type_hash(type_name)  # readers compare it
            self._topics[name] = Topic(name, type_name, digest, tuple(offered) or (RELIABLE,)), defined

    def write(self, topic_name: str, type_name: str, cdr: bytes, log_ns: int) -> None:
        """Append one message. Raises ValueError when the topic has another type or the time is out of range."""
        self.add_topic(topic_name, type_name)
        topic, defined = self._topics[topic_name]
        if topic.type != type_name:
            raise ValueError(f"topic {topic_name}: type = {type_name}: the recording holds it as {topic.type}")
        if not 0 <= log_ns <= LATEST_NS:
            raise ValueError(f"topic {topic_name}: log time = {log_ns} ns: give nanoseconds from 0 to 2^63 - 1")
        if self._is_full(cdr, log_ns):
            following = self._open(len(self._files) + 1)
            self._files.append(self._part.finish())
            self._part = following
        self._part.declare(topic, defined)
        if not self._part.count:
            self._begun_ns = log_ns
        self._part.write(topic_name, cdr, log_ns)
        self._counts[topic_name] += 1

    @property
    def counts(self) -> dict[str, int]:
        """Messages written so far by topic."""
        return {name: self._counts[name] for name in self._topics}

    @property
    def unsaved(self) -> int:
        """Messages that the death of this process would cost."""
        return self._part.unsaved

    @property
    def file(self) -> Path:
        """The file that is written at present."""
        return self.path / file_name(len(self._files))

    @property
    def size(self) -> int:
        """Bytes of the present file that the operating system has."""
        return self._part.size

    def advance(self, log_ns: int) -> None:
        """Tell that what follows is of this time or later: a chunk whose span is over is handed on at once."""
        self._part.advance(log_ns)

    def flush(self) -> None:
        """Hand everything written so far to the operating system: it survives the death of this process."""
        self._part.flush()

    def check_disk(self) -> None:
        """Raise OSError when less is free than is to stay free."""
        free = shutil.disk_usage(self.path).free
        if free < self._limits.min_free_bytes:
            least = self._limits.min_free_bytes / MB
            message = f"{free / MB:.0f} MB are free where {least:.0f} MB are to stay free: delete something"
            raise OSError(errno.ENOSPC, message, str(self.path))

    def close(self) -> None:
        """Write the index and metadata.yaml; closing again does nothing."""
        if self._closed:
            return
        self._closed = True
        self._files.append(self._part.finish())
        topics = [(topic, self._counts[topic.name]) for topic, _ in self._topics.values()]
        (self.path / "metadata.yaml").write_text(document(self._files, topics), encoding="utf-8")

    def discard(self) -> None:
        """Close and delete the directory: nothing of a failed conversion is left."""
        self._closed = True
        self._part.close()
        shutil.rmtree(self.path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _open(self, number: int) -> Part:
        self.check_disk()
        return Part(self.path / file_name(number), self._limits.span_ns)

    def _is_full(self, cdr: bytes, log_ns: int) -> bool:
        """Tell whether a message belongs into the next file."""
        if not self._part.count:
            return False
        passed_ns = log_ns - self._begun_ns
        late = (passed_ns if self._part.count < FALLEN else abs(passed_ns)) >= self._limits.max_duration_ns
        return late or self._part.bound() + message_bound(cdr) > self._limits.max_bytes


def file_name(number: int) -> str:
    """Return the name of a file of a recording, counted from 0.

    Not named after the directory: a recording may be renamed, and equal recordings are equal byte by byte.
    """
    return f"bag_{number}.mcap"
