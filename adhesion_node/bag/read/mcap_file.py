# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Reads one MCAP file whether or not its recording was finished.

The index at the end of a file is missing when the recorder died, so it is not used at all: one pass over the file
finds the blocks (chunks, or single messages outside of chunks), the topics and the places that are damaged. Behind a
torn record it goes on with the next chunk. What the end repeats of topics and types is taken where the chunk that said
it first is lost.
Messages are then read block by block, one block at a time in memory.
"""

from collections import Counter
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from struct import error
from typing import BinaryIO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema, Statistics
from mcap.writer import MCAP0_MAGIC
from rosbags.interfaces import Qos
from zstandard import ZstdError

from ..qos import parse
from ..types import Definition
from .chunk import Message, unpack
from .records import Record, begun_chunk, next_chunk, record_at

_UNREADABLE = (error, ValueError, OverflowError, MemoryError, EOFError, McapError, ZstdError, RuntimeError)
"""What the decoders raise on bytes that are not what they seem."""


class Block(NamedTuple):
    """A chunk or a lone message: the time of its first message and where its record is."""

    start_ns: int
    offset: int
    opcode: int
    length: int
    cut: bool
    """Whether the file ends before the chunk does."""


class TopicInfo(NamedTuple):
    """What a recording says of a topic."""

    name: str
    type: str
    encoding: str
    definition: Definition
    offered: tuple[Qos, ...] = ()

    @property
    def is_cdr(self) -> bool:
        """Whether its messages are those of ROS 2."""
        return self.encoding == "cdr"


class McapFile:
    """An MCAP file: `topics` and message `counts` by channel, `blocks`, and `damage`: a sentence per loss.

    It is open only while it is scanned or a block is read: a recording may have more files than a process may open.
    Raises ValueError when it is not an MCAP file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[int, TopicInfo] = {}
        self.counts: Counter[int] = Counter()
        self.blocks: list[Block] = []
        self.damage: list[str] = []
        self._types: dict[int, tuple[str, Definition]] = {}
        self._channels: dict[int, Channel] = {}
        with path.open("rb") as stream:
            self._scan(stream)

    def messages(self, block: Block) -> list[Message]:
        """Return the messages of a block in the order they were written, those of nameless channels, too."""
        with self.path.open("rb") as stream:
            stream.seek(block.offset)
            body = stream.read(block.length)
        return unpack(block.opcode, body, cut=block.cut).messages

    def _scan(self, stream: BinaryIO) -> None:
        if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            empty = self.path.stat().st_size == 0
            raise ValueError(f"{self.path}: {'is empty' if empty else 'is not an MCAP file'}: name another recording")
        finished, counted = False, 0
        end = len(MCAP0_MAGIC)
        for record in self._records(stream):
            opcode, offset, length, _ = record
            end = record.end
            stream.seek(offset)
            if opcode == Opcode.FOOTER:
                stream.seek(end)
                finished = stream.read() == MCAP0_MAGIC
            if opcode == Opcode.STATISTICS:
                counted = _messages(stream.read(length))
            if opcode in (Opcode.CHUNK, Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL):
                self._take_block(opcode, offset, stream.read(length))
        begun = None if finished else self._take_begun(stream, end)
        self._name_topics()
        if nameless := sum(count for channel, count in self.counts.items() if channel not in self._channels):
            self.damage.append(f"{self.path}: {nameless} messages are left out, the names of their topics are lost")
        missing = counted - sum(self.counts.values())
        if missing > 0 and not self.damage:  # a chunk whose kind one wrong bit has changed looks like nothing at all
            self.damage.append(f"{self.path}: {missing} messages are lost, its end counts {counted}")
        if not finished:
            stream.seek(end)
            rest = f", the {extent} bytes there are left out" if (extent := _extent(stream)) else ""
            rest = f", {begun} messages of the chunk there are read" if begun else rest
            reason = "its recording was interrupted or the file was cut"
            self.damage.append(f"{self.path} breaks off at byte {end}: {reason}{rest}")

    def _records(self, stream: BinaryIO) -> Iterator[Record]:
        """Yield every record that lies in the stream as a whole; behind a torn one go on with the next chunk."""
        position = searched_from = len(MCAP0_MAGIC)
        size = stream.seek(0, 2)
        while (record := record_at(stream, position, size)) is None or record.opcode != Opcode.FOOTER:
            if record is None:
                if (chunk := next_chunk(stream, searched_from, size)) is None:
                    return
                left_out = f"the {chunk - searched_from} bytes there are left out"
                self.damage.append(f"{self.path} is damaged at byte {searched_from}: {left_out}")
                position = chunk
                continue
            yield record
            position = record.end if record.agrees else next_chunk(stream, record.offset, size) or record.end
            if record.opcode in (Opcode.CHUNK, Opcode.MESSAGE):
                searched_from = position
        yield record

    def _take_begun(self, stream: BinaryIO, end: int) -> int:
        """Take what is left of a chunk at which the file breaks off, and tell how many messages that is."""
        chunk, before = begun_chunk(stream, end, stream.seek(0, 2)), self.counts.total()
        if chunk is not None:
            stream.seek(chunk.offset)
            self._take_block(chunk.opcode, chunk.offset, stream.read(), cut=True)
        return self.counts.total() - before

    def _take_block(self, opcode: int, offset: int, body: bytes, *, cut: bool = False) -> None:
        """Note a record of the data section; a damaged one is left out as a whole."""
        try:
            if opcode == Opcode.MESSAGE and self.blocks and self.blocks[-1].opcode == Opcode.CHUNK:
                raise ValueError("behind a chunk comes its index, which one wrong bit makes a message")
            messages, declared, beyond = unpack(opcode, body, cut=cut)
            self._declare(declared)
        except _UNREADABLE:
            self.damage.append(f"{self.path} is damaged at byte {offset}: the {len(body)} bytes there are left out")
            return
        if beyond:
            later = f"{beyond} messages are left out, their log time is beyond 2^63 - 1 ns"
            self.damage.append(f"{self.path} is damaged at byte {offset}: {later}")
        if messages:
            self.blocks.append(Block(min(log_ns for _, log_ns, _ in messages), offset, opcode, len(body), cut))
            self.counts.update(channel for channel, _, _ in messages)

    def _declare(self, records: list[Schema | Channel]) -> None:
        """Take over the schemas and channels.

        The end of a file repeats them without a checksum: what was said first, in a checked chunk, holds.
        """
        for record in records:
            if isinstance(record, Schema):
                text = record.data.decode(errors="replace")  # that of a protobuf is none
                self._types.setdefault(record.id, (record.name, Definition(record.encoding, text)))
            else:
                self._channels.setdefault(record.id, record)

    def _name_topics(self) -> None:
        """Give the channels their types, which a damaged chunk took along where the end does not repeat them.

        JSON needs none.
        """
        for number, channel in self._channels.items():
            kind, known_as = self._types.get(channel.schema_id, ("", Definition("", "")))
            offered = parse(channel.metadata.get("offered_qos_profiles", ""))
            info = TopicInfo(channel.topic, kind, channel.message_encoding, known_as, offered)
            if kind or not info.is_cdr:
                self.topics[number] = info
            elif count := self.counts[number]:
                self.damage.append(f"{self.path}: {count} messages of {channel.topic} are left out, their type is lost")


def _messages(body: bytes) -> int:
    """Return the number of messages that the statistics at the end count; 0 where they are unreadable."""
    try:
        return int(Statistics.read(ReadDataStream(BytesIO(body))).message_count)
    except _UNREADABLE:
        return 0


def _extent(stream: BinaryIO) -> int:
    """Return the number of bytes to the end, without the zeros in which room that was set aside is left."""
    extent = position = 0
    while block := stream.read(2**20):
        if used := len(block.rstrip(b"\0")):
            extent = position + used
        position += len(block)
    return extent
