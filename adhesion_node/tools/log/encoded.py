# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The bytes of a log: whether they are text, in which encoding, and packed or not."""

import bz2
import codecs
import gzip
import lzma
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from typing import IO, Any

PACKED: dict[bytes, Callable[[Path, Any], Any]] = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ": lzma.open}
"""What unpacks a file that begins so."""

_BROKEN = (EOFError, zlib.error, lzma.LZMAError, OSError)

NO_TEXT = (
    (b"PK\x03\x04", "is a zip file or a workbook, no text: unpack it, or save it as CSV"),
    (b"\xd0\xcf\x11\xe0", "is a workbook, no text: unpack it, or save it as CSV"),
    *((begins, "is packed: unpack it, or pack it by gzip") for begins in (b"\x28\xb5\x2f\xfd", b"\x04\x22\x4d\x18")),
    (b"7z\xbc\xaf\x27\x1c", "is a 7z file, no text: unpack it"),
    *((begins, "is a recording, no log: replay --offline reads it") for begins in (b"\x89MCAP", b"SQLite format 3")),
    (b"#ROSBAG", "is a recording of ROS 1, no log: convert it with rosbags-convert, replay --offline reads it then"),
)
"""How files begin that are no text, and what to do with them."""

_UTF_16 = ((slice(1, 4, 2), slice(0, 4, 2), "utf-16-le"), (slice(0, 4, 2), slice(1, 4, 2), "utf-16-be"))
"""Where the zeros stand in Latin letters of 16 bits, and where the letters."""

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    *((mark, "utf-32") for mark in (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE)),
    *((mark, "utf-16") for mark in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)),
)
"""Byte order marks and what they say of the encoding; one of 32 bits begins as one of 16."""

_HEAD = 1024


def is_parquet(path: Path) -> bool:
    """Return whether a file is a Parquet file, by its name or as it begins."""
    return path.suffix.lower() in (".parquet", ".pq") or _begin(path).startswith(b"PAR1")


def lines(path: Path, encoding: str | None) -> Iterator[str]:
    """Yield the lines of a log, unpacked. A broken byte ends nothing: it becomes a character that no number has."""
    with _opened(path) as file, TextIOWrapper(file, encoding=encoding, errors="replace") as text:
        try:
            yield from text
        except UnicodeError as error:  # where a mark of the byte order is missing, or a whole letter
            raise ValueError(f"{path}: encoding = {encoding}: {error}: name another, or leave it out") from None


def encoding_of(path: Path) -> str:
    """Return that of the byte order mark; else UTF-8 where all of the file is, else that of Western Windows.

    Raises ValueError for what is no text.
    """
    decoder = codecs.getincrementaldecoder("utf-8")()
    with _opened(path) as file:
        piece = file.read(_HEAD)
        for mark, encoding in _MARKS:
            if piece.startswith(mark):
                return encoding
        for begins, why in NO_TEXT:
            if piece.startswith(begins):
                raise ValueError(f"{path}: {why}")
        for zeros, letters, encoding in _UTF_16:
            if piece[:4][zeros] == b"\0\0" and 0 not in piece[:4][letters]:
                return encoding
        if 0 in piece.partition(b"\n")[0]:  # further on they are of a recorder whose power failed
            raise ValueError(f"{path}: is no text: save it as CSV or as Parquet, or name its --encoding")
        try:
            while piece:
                decoder.decode(piece)
                piece = file.read(1 << 20)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            return "cp1252"
    return "utf-8"


@contextmanager
def _opened(path: Path) -> Iterator[IO[Any]]:
    begin = _begin(path)
    unpack = next((unpack for begins, unpack in PACKED.items() if begin.startswith(begins)), None)
    try:
        with path.open("rb") if unpack is None else unpack(path, "rb") as file:
            yield file
    except _BROKEN as error:
        if isinstance(error, OSError) and error.errno is not None:  # of the system; without a number it is the packer's
            raise
        raise ValueError(f"{path}: is packed, and cannot be unpacked ({error}): copy it anew, or unpack it") from None


def _begin(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(16)
