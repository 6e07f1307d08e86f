# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""Reads one MCAP file whether or not its recording was finished.

The index at the end of a file is missing when the recorder died, so it is not used at all: one pass over the file
finds the blocks (chunks, or single messages outside of chunks), the topics and the first place that is damaged.
Messages are then read block by block, one block at a time in memory.
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from struct import Struct, error
from typing import BinaryIO, NamedTuple

from lz4.frame import decompress as lz4_decompress
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema
from mcap.writer import MCAP0_MAGIC
from zstandard import ZstdError
from zstandard import decompress as zstd_decompress

from .metadata import LATEST_NS
from .types import Definition, is_latched

_HEAD = Struct("<BQ")
_MESSAGE = Struct("<HIQQ")
_CHUNK_TIMES = Struct("<QQ")

_UNREADABLE = (error, ValueError, OverflowError, MemoryError, McapError, ZstdError, RuntimeError)
"""What the decoders raise on bytes that are not what they seem."""


class Message(NamedTuple):
    """One message as it lies in the file."""

    log_ns: int
    channel: int
    cdr: bytes


class Block(NamedTuple):
    """A chunk or a lone message: the time of its first message and where its record is."""

    start_ns: int
    offset: int
    opcode: int
    length: int


class TopicInfo(NamedTuple):
    """What a recording says of a topic."""

    name: str
    type: str
    encoding: str
    definition: Definition
    latched: bool


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
        self._schemas: dict[int, Schema] = {}
        with path.open("rb") as stream:
            self._scan(stream)

    def messages(self, block: Block) -> Iterator[Message]:
        """Yield the messages of a block in the order they were written; those of nameless channels are left out."""
        with self.path.open("rb") as stream:
            stream.seek(block.offset)
            body = stream.read(block.length)
        for opcode, inner in _unpack(block.opcode, body):
            if opcode == Opcode.MESSAGE and (message := _message(inner)).channel in self.topics:
                yield message

    def _scan(self, stream: BinaryIO) -> None:
        if stream.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            empty = self.path.stat().st_size == 0
            raise ValueError(f"{self.path}: {'is empty' if empty else 'is not an MCAP file'}: name another recording")
        finished = False
        end = len(MCAP0_MAGIC)
        for opcode, offset, length in _records(stream):
            end = offset + length
            if opcode == Opcode.FOOTER:
                stream.seek(end)
                finished = stream.read() == MCAP0_MAGIC
            if opcode in (Opcode.CHUNK, Opcode.MESSAGE, Opcode.SCHEMA, Opcode.CHANNEL):
                self._take_block(opcode, offset, stream.read(length))
        if nameless := sum(count for channel, count in self.counts.items() if channel not in self.topics):
            self.damage.append(f"{self.path}: {nameless} messages are left out, the names of their topics are lost")
        if not finished:
            stream.seek(end)
            rest = f", the {extent} bytes there are left out" if (extent := _extent(stream)) else ""
            reason = "its recording was interrupted or the file was cut"
            self.damage.append(f"{self.path} breaks off at byte {end}: {reason}{rest}")

    def _take_block(self, opcode: int, offset: int, body: bytes) -> None:
        """Note a record of the data section; a damaged one is left out as a whole."""
        try:
            if opcode == Opcode.MESSAGE and self.blocks and self.blocks[-1].opcode == Opcode.CHUNK:
                raise ValueError("behind a chunk comes its index, which one wrong bit makes a message")
            messages = [_message(inner) for kind, inner in _unpack(opcode, body) if not self._declares(kind, inner)]
        except _UNREADABLE:
            self.damage.append(f"{self.path} is damaged at byte {offset}: the {len(body)} bytes there are left out")
            return
        if messages:
            self.blocks.append(Block(min(message.log_ns for message in messages), offset, opcode, len(body)))
            self.counts.update(message.channel for message in messages)

    def _declares(self, opcode: int, body: bytes) -> bool:
        """Take over a schema or channel record; False for a message.

        The end of a file repeats them without a checksum: what was said first, in a checked chunk, holds.
        """
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(ReadDataStream(BytesIO(body)))
            self._schemas.setdefault(schema.id, schema)
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(ReadDataStream(BytesIO(body)))
            schema = self._schemas.get(channel.schema_id) or Schema(id=0, data=b"", encoding="", name="")
            known_as = Definition(schema.encoding, schema.data.decode())
            latched = is_latched(channel.metadata.get("offered_qos_profiles", ""))
            info = TopicInfo(channel.topic, schema.name, channel.message_encoding, known_as, latched)
            self.topics.setdefault(channel.id, info)
        return opcode != Opcode.MESSAGE


def _records(stream: BinaryIO) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, offset and length of the body of every record that lies in the stream as a whole."""
    offset = stream.tell()
    size = stream.seek(0, 2)
    while offset + _HEAD.size <= size:
        stream.seek(offset)
        opcode, length = _HEAD.unpack(stream.read(_HEAD.size))
        offset += _HEAD.size
        if opcode == 0 or offset + length > size:
            return
        yield opcode, offset, length
        if opcode == Opcode.FOOTER:
            return
        offset += length


def _extent(stream: BinaryIO) -> int:
    """Return the number of bytes to the end, without the zeros in which room that was set aside is left."""
    extent = position = 0
    while block := stream.read(2**20):
        if used := len(block.rstrip(b"\0")):
            extent = position + used
        position += len(block)
    return extent


def _unpack(opcode: int, body: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield opcode and body of the records in a chunk; another record stands for itself."""
    if opcode != Opcode.CHUNK:
        yield opcode, body
        return
    stream = BytesIO(_decompress(Chunk.read(ReadDataStream(BytesIO(body)))))
    for inner, _, length in _records(stream):
        yield inner, stream.read(length)


def _decompress(chunk: Chunk) -> bytes:
    if chunk.compression == "zstd":
        data: bytes = zstd_decompress(chunk.data, chunk.uncompressed_size)
    elif chunk.compression == "lz4":
        data = lz4_decompress(chunk.data)
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise ValueError(f"chunk compression = {chunk.compression!r}: only zstd, lz4 and none are known")
    if len(data) != chunk.uncompressed_size or (chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc):
        raise ValueError("the checksum of the chunk does not fit")
    return data


def _message(body: bytes) -> Message:
    channel, _, log_ns, _ = _MESSAGE.unpack_from(body)
    if log_ns > LATEST_NS:
        raise ValueError(f"log time = {log_ns} ns: beyond what a recording may hold")
    return Message(log_ns, channel, body[_MESSAGE.size :])
