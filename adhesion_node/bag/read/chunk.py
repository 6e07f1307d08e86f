# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a record of an MCAP file holds, decompressed no further than a chunk may be long."""

from io import BytesIO
from struct import Struct
from typing import NamedTuple
from zlib import crc32

from lz4.frame import LZ4FrameDecompressor
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema
from zstandard import ZstdDecompressor

from ..metadata import LATEST_NS
from .records import HEAD

MAX_CHUNK_BYTES = 32 * 2**20
"""Length of a chunk when decompressed. Writers end theirs at 64 kB to 4 MB, or with one longer message; a few bytes
can stand for any number of them. Of the shortest messages so many make some 400 MB of objects."""

_MESSAGE = Struct("<H4xQ8x")
"""Channel and log time of a message, its number and time of publishing passed over; its data follow."""

_NAME_LENGTH = Struct("<28xI")
"""How long the name of a chunk's compression is, in its body."""

_LENGTH = Struct("<Q")

Message = tuple[int, int, bytes]
"""What is used of a message: its channel, its log time in ns, its data."""


class Content(NamedTuple):
    """What a block holds, in the order it was written."""

    messages: list[Message]
    declared: list[Schema | Channel]
    beyond: int
    """How many messages are left out, whose log time is later than any that a recording may hold."""


def unpack(opcode: int, body: bytes, *, cut: bool = False) -> Content:
    """Return what a chunk holds, or where it is cut off the records before that; another record stands for itself.

    The library makes several objects of every number, which takes twice as long.
    Raises ValueError, or what the libraries raise, when the bytes are not what they seem.
    """
    content = HEAD.pack(opcode, len(body)) + body
    if opcode == Opcode.CHUNK:
        chunk = Chunk.read(ReadDataStream(BytesIO(_ended(body) if cut else body)))
        content = _content(chunk)
        if cut:
            content = _whole_records(content)
        elif len(content) != chunk.uncompressed_size:
            raise ValueError(f"chunk of {chunk.uncompressed_size} bytes, as it says: it holds another number")
        elif chunk.uncompressed_crc and crc32(content) != chunk.uncompressed_crc:
            raise ValueError(f"chunk of {len(content)} bytes: its checksum is another")
    messages, declared, beyond, offset = list[Message](), list[Schema | Channel](), 0, 0
    while offset < len(content):
        kind, length = HEAD.unpack_from(content, offset)
        offset, end = offset + HEAD.size, offset + HEAD.size + length
        if end > len(content):
            raise ValueError(f"record of {length} bytes: ends behind its chunk")
        if kind == Opcode.MESSAGE:
            if length < _MESSAGE.size:
                raise ValueError(f"message of {length} bytes: shorter than its head")
            channel_id, log_ns = _MESSAGE.unpack_from(content, offset)
            if log_ns > LATEST_NS:
                beyond += 1
            else:
                messages.append((channel_id, log_ns, content[offset + _MESSAGE.size : end]))
        elif kind in (Opcode.SCHEMA, Opcode.CHANNEL):
            read = Schema.read if kind == Opcode.SCHEMA else Channel.read
            declared.append(read(ReadDataStream(BytesIO(content[offset:end]))))
        offset = end
    return Content(messages, declared, beyond)


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
    return bytes(content)


def _ended(body: bytes) -> bytes:
    """A chunk that is cut off, as if it were no longer than it is: the length of its content stands before that."""
    (letters,) = _NAME_LENGTH.unpack_from(body)
    at = _NAME_LENGTH.size + letters + _LENGTH.size
    return body[: at - _LENGTH.size] + _LENGTH.pack(len(body) - at) + body[at:]


def _whole_records(content: bytes) -> bytes:
    """The records before the one that is cut off."""
    end = following = 0
    while following <= len(content) - HEAD.size:
        end = following
        following += HEAD.size + HEAD.unpack_from(content, end)[1]
    return content[: following if following <= len(content) else end]
