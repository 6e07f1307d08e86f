# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""One MCAP file while it is written: cut into chunks, with room set aside on the disk for all that has to follow.

A chunk is complete on the disk or not there at all, so what a killed process leaves is a row of complete chunks. The
room is set aside before a message is taken: the disk may fill up at any time, the file can still be ended properly.
"""

import json
import os
import sys
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer

from ..metadata import File, Topic
from ..qos import profiles
from ..types import Definition

CHUNK_BYTES = 64 * 1024
"""Size before compression from which a chunk is ended."""

STEP_BYTES = 256 * 1024
"""Room is set aside in steps: a call of the operating system for hundreds of chunks."""

MARGIN_BYTES = 64 * 1024
"""Room that the file itself never takes: on a full disk its end leaves this much for metadata.yaml."""


class Part:
    """A file of a recording. Its chunks end by size, or when a message is `span_ns` away from the chunk's first.

    Where the chunks end depends on the messages alone, save for `flush`. Raises OSError when the disk is full; then
    the message at hand is not taken, and `finish` still works.
    """

    def __init__(self, path: Path, span_ns: float) -> None:
        self.count = 0
        self.unsaved = 0
        """Messages in the chunk that has not ended."""
        self.first_ns = self.last_ns = 0
        self._path = path
        self._span_ns = span_ns
        self._channels: dict[str, int] = {}
        self._schemas: dict[tuple[str, Definition], int] = {}
        self._chunk_start_ns: int | None = None
        self._chunk_bytes = 0
        self._summary_bytes = 4096
        self._set_aside_bytes = 0
        # "+": where a file system cannot set room aside, glibc reads and writes instead.
        self._stream = path.open("x+b")
        try:
            self._set_aside(0)
        except OSError:
            self._stream.close()
            path.unlink()
            raise
        # Any: mcap annotates its writer only in part. Its own chunk size never applies.
        self._writer: Any = Writer(self._stream, chunk_size=sys.maxsize, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library="adhesion_node")
        self._stream.flush()

    def declare(self, topic: Topic, definition: Definition) -> None:
        """Declare a topic before its first message; declaring it again changes nothing."""
        if topic.name in self._channels:
            return
        # JSON is YAML as well, and rosbag2 wants YAML here.
        qos = {"offered_qos_profiles": json.dumps(profiles(topic.offered)), "topic_type_hash": topic.type_hash}
        size = 256 + len(definition.text.encode()) + len(str(qos)) + 4 * len(topic.name + topic.type)
        self._set_aside(2 * size)
        self._chunk_bytes += size
        self._summary_bytes += size
        kind = topic.type, definition
        if kind not in self._schemas:
            schema = self._writer.register_schema(topic.type, definition.encoding, definition.text.encode())
            self._schemas[kind] = schema
        self._channels[topic.name] = self._writer.register_channel(topic.name, "cdr", self._schemas[kind], qos)

    def write(self, topic: str, cdr: bytes, log_ns: int) -> None:
        """Append a message of a declared topic."""
        self.advance(log_ns)
        size = message_bound(cdr)
        self._set_aside(size)
        self._writer.add_message(self._channels[topic], log_time=log_ns, data=cdr, publish_time=log_ns)
        self._chunk_bytes += size
        self.unsaved += 1
        if self._chunk_start_ns is None:
            self._chunk_start_ns = log_ns
        self.first_ns = log_ns if not self.count else min(self.first_ns, log_ns)
        self.last_ns = max(self.last_ns, log_ns)
        self.count += 1

    @property
    def size(self) -> int:
        """Bytes that the operating system has; what is `unsaved` is not among them."""
        return self._stream.tell()

    def bound(self) -> int:
        """Return what the finished file will not exceed, in bytes."""
        return self.size + self._chunk_bytes + self._summary_bytes

    def advance(self, log_ns: int) -> None:
        """End the chunk where a message of this time would not belong into it any more."""
        start_ns = self._chunk_start_ns
        if start_ns is not None and (self._chunk_bytes >= CHUNK_BYTES or abs(log_ns - start_ns) >= self._span_ns):
            self.flush()

    def flush(self) -> None:
        """End the chunk and hand it to the operating system: it survives the death of this process."""
        self._writer.flush()
        if self.unsaved:
            self.unsaved = 0
            self._chunk_start_ns = None
            self._chunk_bytes = 0
            self._summary_bytes += 96 + 10 * len(self._channels)

    def finish(self) -> File:
        """Write the index, give back the room that is left and close; return what metadata.yaml says of the file."""
        self._writer.finish()
        self._stream.truncate()
        self.close()
        return File(self._path.name, self.first_ns, self.last_ns - self.first_ns, self.count)

    def close(self) -> None:
        """Close the file, finished or not."""
        self._stream.close()

    def _set_aside(self, size: int) -> None:
        needed = self.bound() + size + MARGIN_BYTES
        if needed > self._set_aside_bytes:
            try:
                os.posix_fallocate(self._stream.fileno(), 0, needed + STEP_BYTES)
            except OSError as error:
                reason = f"{error.strerror}: the recording ends here, make room for another"
                raise OSError(error.errno, reason, str(self._path)) from error
            self._set_aside_bytes = needed + STEP_BYTES


def message_bound(cdr: bytes) -> int:
    """Return what a message takes at most, in bytes: record and place in the index, incompressible as it may be."""
    return len(cdr) + len(cdr) // 128 + 64
