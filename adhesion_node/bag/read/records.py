# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Where the records of an MCAP file are, behind a torn one, too: a chunk tells its length twice."""

from struct import Struct
from typing import BinaryIO, NamedTuple

from mcap.opcode import Opcode

HEAD = Struct("<BQ")
"""Opcode and length of a record."""

_CHUNK = Struct("<BQ28xI")
"""Head of a chunk, its times, size and checksum passed over, and how long the name of its compression is."""

_LENGTH = Struct("<Q")
_MAX_NAME = 8
"""Letters of a compression: `zstd`, `lz4` or none."""

_LONGEST = _CHUNK.size + _MAX_NAME + _LENGTH.size
_STRIDE = 2**20


class Record(NamedTuple):
    """A record: what it is, where its body begins, and how long that is."""

    opcode: int
    offset: int
    length: int
    agrees: bool
    """Whether a chunk's two lengths do."""

    @property
    def end(self) -> int:
        """Where the next one begins."""
        return self.offset + self.length


def record_at(stream: BinaryIO, position: int, size: int) -> Record | None:
    """Return the record there; None where none lies in the stream as a whole."""
    stream.seek(position)
    head = stream.read(_LONGEST)
    if len(head) < HEAD.size:
        return None
    opcode, length = HEAD.unpack_from(head)
    record = Record(opcode, position + HEAD.size, length, opcode != Opcode.CHUNK or _is_chunk(head, 0))
    return None if opcode == 0 or record.end > size else record


def begun_chunk(stream: BinaryIO, position: int, size: int) -> Record | None:
    """Return what is left of a chunk that begins there and that the end of the stream cuts off; None without one."""
    stream.seek(position)
    head = stream.read(_LONGEST)
    if not head.startswith(bytes([Opcode.CHUNK])) or not _is_chunk(head, 0):
        return None
    return Record(Opcode.CHUNK, position + HEAD.size, size - position - HEAD.size, True)


def next_chunk(stream: BinaryIO, position: int, size: int) -> int | None:
    """Return where the next chunk begins, at a place or behind it, that ends within the stream; None without one."""
    for start in range(position, size, _STRIDE):
        stream.seek(start)
        read = stream.read(_STRIDE + _LONGEST)
        at = read.find(Opcode.CHUNK)
        while 0 <= at < _STRIDE:
            if _is_chunk(read, at) and record_at(stream, start + at, size) is not None:
                return start + at
            at = read.find(Opcode.CHUNK, at + 1)
    return None


def _is_chunk(read: bytes, at: int) -> bool:
    """Whether the length of what would be a chunk is that of its parts."""
    if len(read) < at + _CHUNK.size:
        return False
    _, length, letters = _CHUNK.unpack_from(read, at)
    name_end = at + _CHUNK.size + letters
    if letters > _MAX_NAME or len(read) < name_end + _LENGTH.size:
        return False
    (content,) = _LENGTH.unpack_from(read, name_end)
    return bool(HEAD.size + length == name_end + _LENGTH.size - at + content)
