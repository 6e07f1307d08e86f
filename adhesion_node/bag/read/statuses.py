# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Diagnostics with the values of an entry as one dict: a day's recording tells two million, else objects each."""

from struct import Struct, error
from types import SimpleNamespace

TYPE = "diagnostic_msgs/msg/DiagnosticArray"

_STAMP, _LENGTH = Struct("<iI"), Struct("<I")


def statuses(cdr: bytes) -> SimpleNamespace | None:
    """Decode a DiagnosticArray, `values` being texts by key; None where the library has to say what is wrong."""
    try:
        return _decoded(cdr) if cdr[:2] == b"\0\1" else None
    except (error, ValueError, IndexError):
        return None


def _decoded(cdr: bytes) -> SimpleNamespace:
    sec, nanosec = _STAMP.unpack_from(cdr, 4)
    frame_id, at = _text(cdr, 12)
    count, at = _number(cdr, at)
    entries = []
    for _ in range(count):
        level = cdr[at]
        name, at = _text(cdr, at + 1)
        message, at = _text(cdr, at)
        hardware_id, at = _text(cdr, at)
        pairs, at = _number(cdr, at)
        values = {}
        for _ in range(pairs):
            key, at = _text(cdr, at)
            values[key], at = _text(cdr, at)
        entries.append(SimpleNamespace(level=level, name=name, message=message, hardware_id=hardware_id, values=values))
    header = SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec), frame_id=frame_id)
    return SimpleNamespace(header=header, status=entries)


def _number(cdr: bytes, at: int) -> tuple[int, int]:
    """A length and where it ends; CDR aligns it at its size."""
    at += -at % 4
    (number,) = _LENGTH.unpack_from(cdr, at)
    return number, at + 4


def _text(cdr: bytes, at: int) -> tuple[str, int]:
    """A text and where it ends."""
    at += -at % 4
    (size,) = _LENGTH.unpack_from(cdr, at)
    end = at + 4 + size
    if size < 1 or cdr[end - 1]:
        raise ValueError("a text without its end")
    return cdr[at + 4 : end - 1].decode(), end
