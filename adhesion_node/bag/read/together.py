# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Many messages of one type as one, whose numbers are arrays: a day's recording holds a million that differ in no text.

Where the numbers stand follows from the type and from the texts before them, so equal texts make equal places.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice, repeat
from struct import error, unpack_from
from types import SimpleNamespace
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype

from ...wire.line import Line
from ...wire.messages.refused import Rejected
from ...wire.topic import Topic
from ..types import deserialize, typestore
from .recordings import Record

MOST_TOGETHER = 512
"""Messages that are read together: what is theirs stays in the processor's cache."""

_HEAD_BYTES = 4
"""Before the body, from which CDR counts its alignment."""

_FORMATS = {"bool": "<?", **{f"{sign}int{8 * n}": f"<{sign[:1] or 'i'}{n}" for n in (1, 2, 4, 8) for sign in ("", "u")}}
_FORMATS |= {"float32": "<f4", "float64": "<f8", "byte": "<u1"}

TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"

_NAMES = ("positions", "position", "velocities", "velocity", "accelerations", "acceleration", "efforts", "sec")
_POINT: np.dtype[np.void] = np.dtype(
    {
        "names": [*_NAMES, "nanosec"],
        "formats": ["<u4", "<f8", "<u4", "<f8", "<u4", "<f8", "<u4", "<i4", "<u4"],
        "offsets": [0, 4, 12, 20, 28, 36, 44, 48, 52],
        "itemsize": 56,
    }
)
"""A point of one joint; before every sequence stands its length."""


def together(cdrs: Sequence[bytes], type_name: str) -> Any | None:
    """Decode k messages as one of the type's fields: a number as an array of (k,), an array of n of them as (n, k).

    The points of a trajectory of one joint are an array of (k, n, 4): position, velocity, acceleration, seconds. None
    where texts or lengths differ: then they are to be decoded one by one.
    """
    first = cdrs[0]
    if set(map(len, cdrs)) != {len(first)} or any(cdr[:2] != b"\0\1" for cdr in cdrs):
        return None
    try:
        deserialize(first, type_name)
        layout = _Layout(np.frombuffer(b"".join(cdrs), np.uint8).reshape(len(cdrs), -1), first)
        return layout.trajectory() if type_name == TRAJECTORY else layout.message(type_name)
    except (error, ValueError):
        return None


def read_together(
    records: Iterable[Record], topics: Mapping[str, Topic], line: Line
) -> Iterator[tuple[Record, Any | None]]:
    """Yield the records, each with what its topic reads of it.

    None where it is of none of the `topics`, by recorded name, or has to be read by itself, if only to be refused.
    """
    every = iter(records)
    while some := list(islice(every, MOST_TOGETHER)):
        kinds = [(record.topic, len(record.cdr)) for record in some]
        alike = defaultdict[tuple[str, int], list[bytes]](list)
        for kind, record in zip(kinds, some, strict=True):
            alike[kind].append(record.cdr)
        read = {kind: iter(_read(topics.get(kind[0]), cdrs, line)) for kind, cdrs in alike.items()}
        yield from zip(some, map(next, map(read.__getitem__, kinds)), strict=True)


def _read(topic: Topic | None, cdrs: Sequence[bytes], line: Line) -> Iterable[Any | None]:
    """Read messages of one length."""
    message = together(cdrs, topic.type) if topic and topic.codec and topic.codec.together else None
    try:
        columns = message and topic and topic.together(message, line)
    except Rejected:
        columns = None
    if columns is None:
        return repeat(None)
    known, rows = ~np.isnan(columns[-1]), zip(*(column.tolist() for column in columns), strict=True)
    return (type(columns)(*row) if each else None for each, row in zip(known.tolist(), rows, strict=True))


class _Layout:
    """The place that has been reached in the messages."""

    def __init__(self, rows: Any, first: bytes) -> None:
        self._rows, self._first, self._at = rows, first, _HEAD_BYTES

    def message(self, kind: str) -> SimpleNamespace:
        return SimpleNamespace(**{name: self._value(*what) for name, what in typestore().fielddefs[kind][1]})

    def trajectory(self) -> SimpleNamespace:
        """Points of one position, velocity and acceleration each, and no effort."""
        header = self.message("std_msgs/msg/Header")
        names = [self._text() for _ in range(self._same_number())]
        count, at = self._same_number(), self._at
        lengths = [self._numbers("uint32", 1)[0]] if count else []
        # CDR aligns a number at its size: what is of 8 bytes stands 4 behind the first length, or 8
        start, shape = at if (at - _HEAD_BYTES) % 8 else at + 4, (len(self._rows), count)
        points: Any = np.ndarray(shape, _POINT, self._rows, start, (self._rows.shape[1], _POINT.itemsize))
        lengths += [points["positions"][:, 1:], points["velocities"], points["accelerations"], points["efforts"] + 1]
        if any((length != 1).any() for length in lengths):
            raise ValueError("points with other than one value of each kind")
        seconds = points["sec"] + points["nanosec"] / 1e9
        columns = np.stack([points["position"], points["velocity"], points["acceleration"], seconds])
        return SimpleNamespace(header=header, joint_names=names, points=np.moveaxis(columns, 0, -1))

    def _same_number(self) -> int:
        """A length that all messages have."""
        lengths = self._numbers("uint32", 1)[0]
        if (lengths != lengths[0]).any():
            raise ValueError("another length")
        return int(lengths[0])

    def _value(self, node: Nodetype, what: Any) -> Any:
        readers: dict[Nodetype, Callable[[Any], Any]] = {
            Nodetype.NAME: self.message,
            Nodetype.BASE: lambda base: self._text() if base[0] == "string" else self._numbers(base[0], 1)[0],
            Nodetype.ARRAY: lambda array: self._numbers(array[0][1][0], array[1]),
        }
        if node not in readers:
            raise ValueError("a sequence: its length may differ")
        return readers[node](what)

    def _numbers(self, base: str, count: int) -> Any:
        if base not in _FORMATS:
            raise ValueError(f"{base}: of no fixed length")
        kind = np.dtype(_FORMATS[base])
        at = self._aligned(kind.itemsize)
        self._at = at + count * kind.itemsize
        return np.ascontiguousarray(self._rows[:, at : self._at]).view(kind).T

    def _text(self) -> str:
        at = self._aligned(4)
        (size,) = unpack_from("<I", self._first, at)
        self._at = at + 4 + size
        if (self._rows[:, at : self._at] != self._rows[0, at : self._at]).any():
            raise ValueError("another text")
        return self._first[at + 4 : self._at - 1].decode()

    def _aligned(self, size: int) -> int:
        return self._at + (_HEAD_BYTES - self._at) % size
