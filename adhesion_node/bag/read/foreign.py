# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Recordings in rosbag2's other form, sqlite3, read through rosbags."""

import heapq
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinitionFormat, Qos
from rosbags.rosbag2 import Reader

from ..types import Definition
from .mcap_file import TopicInfo
from .recordings import Record

_ENCODINGS = {MessageDefinitionFormat.MSG: "ros2msg", MessageDefinitionFormat.IDL: "ros2idl"}


class ForeignRecording:
    """Files of a recording."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self.damage: list[str] = []
        self._paths = paths
        with ExitStack() as stack, self._translated():
            self._readers = [stack.enter_context(Reader(path)) for path in paths]
            self._stack = stack.pop_all()

    def infos(self) -> Iterator[tuple[TopicInfo, int]]:
        """Yield the topics of every file."""
        for reader in self._readers:
            for connection in reader.connections:
                yield _info(connection), connection.msgcount

    def records(self, wanted: Callable[[TopicInfo], bool]) -> Iterator[Record]:
        """Yield the records of all files merged; each file comes sorted from its database."""
        streams = []
        for reader in self._readers:
            # Without any connection rosbags would yield them all.
            if connections := [connection for connection in reader.connections if wanted(_info(connection))]:
                streams.append(reader.messages(connections))
        with self._translated():
            for connection, log_ns, cdr in heapq.merge(*streams, key=lambda entry: entry[1]):
                yield Record(connection.topic, connection.msgtype, bytes(cdr), log_ns)

    def close(self) -> None:
        """Close the files."""
        self._stack.close()

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except Exception as error:  # rosbags lets the exceptions of sqlite, zstd and YAML through
            names = ", ".join(str(path) for path in self._paths)
            raise ValueError(f"bag = {names}: unreadable ({error}): name another recording") from error


def _info(connection: Connection) -> TopicInfo:
    encoding = "cdr"
    offered: tuple[Qos, ...] = ()
    if isinstance(connection.ext, ConnectionExtRosbag2):
        encoding = connection.ext.serialization_format
        offered = tuple(connection.ext.offered_qos_profiles)
    known_as = Definition(_ENCODINGS.get(connection.msgdef.format, ""), connection.msgdef.data)
    return TopicInfo(connection.topic, connection.msgtype, encoding, known_as, offered)
