# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What a record of an MCAP file holds, decompressed no further than a chunk may be long."""

from io import BytesIO
from struct import Struct

from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Chunk, McapRecord, Message
from mcap.stream_reader import breakup_chunk
from zstandard import ZstdDecompressor

from .metadata import LATEST_NS

HEAD = Struct("<BQ")
"""Opcode and length of a record."""

MAX_CHUNK_BYTES = 32 * 2**20
"""Length of a chunk when decompressed. Writers end theirs at 64 kB to 4 MB, or with one longer message; a few bytes
can stand for any number of them. Of the shortest messages so many make some 400 MB of objects."""


def unpack(opcode: int, body: bytes) -> list[McapRecord]:
    """Return the messages, schemas and channels of a chunk; another record stands for itself.

    Raises ValueError, or what the libraries raise, when the bytes are not what they seem.
    """
    if opcode == Opcode.CHUNK:
        chunk = Chunk.read(ReadDataStream(BytesIO(body)))
        chunk.data, chunk.compression = _content(chunk), ""
    else:
        chunk = Chunk("", HEAD.pack(opcode, len(body)) + body, 0, 0, 0, 0)
    records = breakup_chunk(chunk, validate_crc=True)
    for record in records:
        if isinstance(record, Message) and record.log_time > LATEST_NS:
            raise ValueError(f"log time = {record.log_time} ns: beyond what a recording may hold")
    return records


def _content(chunk: Chunk) -> bytes:
    """Decompress no more than the chunk says that it holds, and not that where it is too much."""
    size = chunk.uncompressed_size
    if size > MAX_CHUNK_BYTES:
        raise ValueError(f"chunk of {size} bytes: no more than {MAX_CHUNK_BYTES} are read")
    if chunk.compression == "zstd":
        with ZstdDecompressor(max_window_size=MAX_CHUNK_BYTES).stream_reader(chunk.data) as stream:
            content = stream.read(size + 1)
    elif chunk.compression == "lz4":
        content = LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    elif chunk.compression == "":
        content = chunk.data
    else:
        raise ValueError(f"chunk compression = {chunk.compression!r}: only zstd, lz4 and none are known")
    if len(content) != size:
        raise ValueError(f"chunk of {size} bytes, as it says: it holds another number")
    return bytes(content)
