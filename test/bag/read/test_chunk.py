# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The records of a chunk, and bytes that are not what they seem."""

from __future__ import annotations

from io import BytesIO
from struct import pack
from typing import Any
from zlib import crc32

import pytest
from mcap.opcode import Opcode
from mcap.writer import CompressionType, Writer

from adhesion_node.bag.read.chunk import unpack
from adhesion_node.bag.read.records import HEAD


def chunk_of(content: bytes, checksum: int | None = None) -> bytes:
    """The body of an uncompressed chunk."""
    wanted = crc32(content) if checksum is None else checksum
    return pack("<QQQIIQ", 0, 0, len(content), wanted, 0, len(content)) + content


def message(data: bytes, log_ns: int = 7) -> bytes:
    """A message's body on channel 3."""
    return pack("<HIQQ", 3, 1, log_ns, 0) + data


def record(opcode: int, body: bytes, length: int | None = None) -> bytes:
    """A record that says that it is so long."""
    return HEAD.pack(opcode, len(body) if length is None else length) + body


def test_a_chunk_holds_messages_and_declarations() -> None:
    """Those that the library writes; records of kinds that come in later versions are passed over."""
    stream = BytesIO()
    writer: Any = Writer(stream, compression=CompressionType.NONE)  # mcap annotates its writer only in part
    writer.start()
    schema = writer.register_schema("a/msg/A", "ros2msg", b"float64 x")
    channel = writer.register_channel("x", "cdr", schema)
    writer.add_message(channel, 5, b"one", 5)
    writer.add_message(channel, 4, b"", 4)
    writer.finish()
    written, at = stream.getvalue(), 8
    while written[at] != Opcode.CHUNK:
        at += HEAD.size + HEAD.unpack_from(written, at)[1]
    length = HEAD.unpack_from(written, at)[1]
    content = unpack(Opcode.CHUNK, written[at + HEAD.size : at + HEAD.size + length])
    assert content.messages == [(channel, 5, b"one"), (channel, 4, b"")]
    assert [type(each).__name__ for each in content.declared] == ["Schema", "Channel"]
    known = record(200, b"??") + record(Opcode.MESSAGE, message(b"xy"))
    assert unpack(Opcode.CHUNK, chunk_of(known)).messages == [(3, 7, b"xy")]
    assert unpack(Opcode.MESSAGE, message(b"xy")).messages == [(3, 7, b"xy")], "one outside of any chunk"


def test_a_message_of_no_possible_time_is_left_out_alone() -> None:
    """Its whole chunk was lost."""
    known = [record(Opcode.MESSAGE, message(b"xy", log_ns)) for log_ns in (2**63 - 1, 2**63, 2**64 - 1)]
    messages, _, beyond = unpack(Opcode.CHUNK, chunk_of(b"".join(known)))
    assert (messages, beyond) == ([(3, 2**63 - 1, b"xy")], 2)


@pytest.mark.parametrize(
    ("content", "checksum", "why"),
    [
        (record(Opcode.MESSAGE, message(b"xy"), 90), None, "ends behind its chunk"),
        (record(Opcode.MESSAGE, b"short"), None, "shorter than its head"),
        (record(Opcode.MESSAGE, message(b"xy")), 1, "its checksum is another"),
    ],
)
def test_a_chunk_that_is_not_what_it_seems_is_refused(content: bytes, checksum: int | None, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        unpack(Opcode.CHUNK, chunk_of(content, checksum))
    assert unpack(Opcode.CHUNK, chunk_of(record(Opcode.MESSAGE, message(b"xy")), 0)).messages, "0: no checksum"


def test_of_a_chunk_that_is_cut_off_the_records_before_that_are_read() -> None:
    """Wherever the cut is: it was left out as a whole."""
    content = b"".join(record(Opcode.MESSAGE, message(b"xy" * at, at)) for at in range(4))
    whole, begins = chunk_of(content), len(chunk_of(b""))
    for size in range(begins, len(whole)):
        messages, _, _ = unpack(Opcode.CHUNK, whole[:size], cut=True)
        assert messages == [(3, at, b"xy" * at) for at in range(len(messages))]
        left = len(whole) - size
        assert len(messages) == 3 - (left > 37) - (left > 37 + 35) - (left > 37 + 35 + 33)
