# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Series over time out of a recording, whose messages are decoded once: what pictures and tables are made from."""

from __future__ import annotations

import math
import sys
from array import array
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..bag import BagReader, Record
from ..bag.together import together
from ..core.physics.train import Array
from ..wire.line import NOMINAL, Line
from ..wire.messages.parts import stamp_ns, stamps_ns
from ..wire.messages.refused import Rejected
from ..wire.messages.results import Status
from ..wire.topic import Frame, Topic

Times = NDArray[np.int64]

MOST_TOGETHER = 256
"""Messages that are read together: what is theirs stays in the processor's cache."""


class Series(NamedTuple):
    """Values at increasing times; both of shape (n,)."""

    t_ns: Times
    values: NDArray[Any]

    def at(self, t_ns: Times) -> Array:
        """Values interpolated at other times; held constant before the first and after the last."""
        return np.asarray(np.interp(t_ns, self.t_ns, self.values), dtype=np.float64)

    def exactly(self, t_ns: Times, absent: Any = np.nan) -> NDArray[Any]:
        """Values at those very times, the last of several; `absent` where there is none."""
        if not self.t_ns.size:
            return np.full(t_ns.shape, absent)
        found = np.searchsorted(self.t_ns, t_ns, side="right") - 1
        return np.where((found >= 0) & (self.t_ns[found] == t_ns), self.values[found], absent)

    def map(self, change: Callable[[Array], Any]) -> Series:
        """What `change` makes of the values, at the same times."""
        return self._replace(values=np.asarray(change(self.values)))

    def by_time(self) -> dict[int, Any]:
        """Values by time."""
        return dict(zip(self.t_ns.tolist(), self.values.tolist(), strict=True))


NONE = Series(np.array([], dtype=np.int64), np.array([]))
"""Of what was not recorded."""


class Sample(NamedTuple):
    """What was read of one message; None where it was refused. `t_ns` is its stamp, or the log time without one.

    Of a topic whose messages are read together, it is of many: the numbers are arrays, NaN where one was refused.
    """

    log_ns: Any
    t_ns: Any
    read: Any


Take = Callable[[Sample], None]
"""Takes what is read of a topic's messages, one after the other."""


def read_topics(reader: BagReader, takes: Iterable[tuple[Topic, Take]], line: Line = NOMINAL) -> None:
    """Hand over what is read of every message, whatever its frame, in one pass; one that does not decode is left out.

    A topic may be taken several times; one that the recording lacks is not. Messages that are read together come in
    their order where they are of one length.
    """
    taken: dict[str, tuple[Topic, list[Take]]] = {}
    for topic, take in takes:
        if (name := reader.resolve(topic.name)) is not None:
            taken.setdefault(name, (topic._replace(frame=Frame.ANY), []))[1].append(take)
    waiting: dict[tuple[str, int], list[Record]] = {}
    for record in reader.messages(taken):
        topic, each = taken[record.topic]
        if topic.codec is None or topic.codec.together is None:
            _hand_over(reader, topic, [record], line, each)
            continue
        alike = waiting.setdefault((record.topic, len(record.cdr)), [])
        alike.append(record)
        if len(alike) == MOST_TOGETHER:
            _hand_over(reader, topic, alike, line, each)
            alike.clear()
    for (name, _), alike in waiting.items():
        _hand_over(reader, taken[name][0], alike, line, taken[name][1])


def _hand_over(reader: BagReader, topic: Topic, records: Sequence[Record], line: Line, takes: Iterable[Take]) -> None:
    message = together([record.cdr for record in records], topic.type) if len(records) > 1 else None
    if message is None:
        samples = [sample_of(topic, one, record.log_ns, line) for record, one in reader.decoded(records)]
    else:
        log_ns = np.array([record.log_ns for record in records], dtype=np.int64)
        samples = [_samples_of(topic, message, log_ns, line)]
    for sample in samples:
        for take in takes:
            take(sample)


def sample_of(topic: Topic, message: Any, log_ns: int, line: Line) -> Sample:
    """Read a message."""
    header = getattr(message, "header", None)
    t_ns = log_ns if header is None else stamp_ns(header)
    try:
        return Sample(log_ns, t_ns, topic.read(message, line))
    except Rejected:
        return Sample(log_ns, t_ns, None)


def _samples_of(topic: Topic, message: Any, log_ns: Times, line: Line) -> Sample:
    """Read many messages that stand as one."""
    header = getattr(message, "header", None)
    t_ns = log_ns if header is None else stamps_ns(header)
    try:
        return Sample(log_ns, t_ns, topic.together(message, line))
    except Rejected:
        return Sample(log_ns, t_ns, None)


def _itself(read: Any) -> Any:
    return read


class Numbers:
    """`value` of all that is read of a topic, NaN where a message was refused."""

    def __init__(self, value: Callable[[Any], Any] = _itself) -> None:
        self._value = value
        self._t_ns, self._log_ns, self._values = array("q"), array("q"), array("d")

    def take(self, sample: Sample) -> None:
        """Take a sample, of one message or of many."""
        value = math.nan if sample.read is None else self._value(sample.read)
        if isinstance(sample.t_ns, np.ndarray):
            self._t_ns.frombytes(sample.t_ns.tobytes())
            self._log_ns.frombytes(sample.log_ns.tobytes())
            self._values.frombytes(np.broadcast_to(np.float64(value), sample.t_ns.shape).tobytes())
        else:
            self.add(sample.t_ns, value, sample.log_ns)

    def add(self, t_ns: int, value: float, log_ns: int = 0) -> None:
        """Take a value."""
        self._t_ns.append(t_ns)
        self._log_ns.append(log_ns)
        self._values.append(value)

    @property
    def series(self) -> Series:
        """The values by their stamps, which may have come late: log times do not tell."""
        t_ns = np.array(self._t_ns, dtype=np.int64)
        order = np.argsort(t_ns, kind="stable")
        return Series(t_ns[order], np.array(self._values)[order])

    def stamped_by(self, *beside: Numbers) -> Series:
        """The values of messages without a stamp: each takes that of the message of `beside` logged nearest to it.

        What is published together is logged together, so a lost message leaves a gap and moves no other one. Of several
        that would take one stamp the nearest in log time does. Empty when either is missing.
        """
        logged, stamps = (
            np.concatenate([np.array(column, dtype=np.int64) for column in columns])
            for columns in zip(*((one._log_ns, one._t_ns) for one in beside), strict=True)
        )
        values, log_ns = np.array(self._values), np.array(self._log_ns, dtype=np.int64)
        known = np.isfinite(values)
        if not (logged.size and known.any()):
            return NONE
        values, log_ns, by_log = values[known], log_ns[known], np.lexsort((stamps, logged))
        logged, stamps = logged[by_log], stamps[by_log]
        after = np.searchsorted(logged, log_ns)
        candidates = np.clip([after - 1, after], 0, logged.size - 1)
        distances = np.abs(logged[candidates] - log_ns)
        nearer = (distances[1] < distances[0]) | (
            (distances[1] == distances[0]) & (stamps[candidates[1]] < stamps[candidates[0]])
        )
        chosen, distance = np.where(nearer, candidates[1], candidates[0]), np.where(nearer, distances[1], distances[0])
        order = np.lexsort((distance, stamps[chosen]))
        t_ns, first = np.unique(stamps[chosen][order], return_index=True)
        return Series(t_ns, values[order][first])


class Keyed:
    """The numbers that statuses tell by their keys; NaN where one tells none."""

    def __init__(self, keys: Iterable[str]) -> None:
        self._numbers = {key: Numbers() for key in keys}

    def note(self, t_ns: int, status: Status) -> None:
        """Take a status."""
        for key, numbers in self._numbers.items():
            numbers.add(t_ns, _number(status.values.get(key, "")))

    @property
    def series(self) -> dict[str, Series]:
        """The numbers by key."""
        return {key: numbers.series for key, numbers in self._numbers.items()}


def _number(text: str) -> float:
    """A finite number; NaN for what is none."""
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


class Texts:
    """Texts at their times."""

    def __init__(self) -> None:
        self._t_ns, self._texts = array("q"), list[str]()

    def add(self, t_ns: int, text: str) -> None:
        """Take a text; most are said again and again."""
        self._t_ns.append(t_ns)
        self._texts.append(sys.intern(text))

    @property
    def series(self) -> Series:
        """The texts by their times."""
        t_ns, texts = np.array(self._t_ns, dtype=np.int64), np.array(self._texts, dtype=object)
        order = np.argsort(t_ns, kind="stable")
        return Series(t_ns[order], texts[order])


def with_key(key: str, take: Callable[[int, Status], None]) -> Take:
    """Hand over the statuses that have `key`, at the stamp of the estimate of which they tell, else at their own."""

    def taken(sample: Sample) -> None:
        for status in sample.read.entries:
            stamp = status.values.get("stamp_ns", sample.t_ns)
            if key in status.values and stamp != "none":  # of no estimate
                take(int(stamp), status)

    return taken


def read_series(reader: BagReader, topic: Topic, value: Callable[[Any], Any] = _itself, line: Line = NOMINAL) -> Series:
    """Take `value` of all that is read of a topic, by its stamp or log time. Empty when the recording lacks it."""
    numbers = Numbers(value)
    read_topics(reader, [(topic, numbers.take)], line)
    return numbers.series


def read_status(reader: BagReader, topic: Topic, key: str) -> Series:
    """Read the value of `key` in a topic of diagnostics, as texts."""
    texts = Texts()
    read_topics(reader, [(topic, with_key(key, lambda t_ns, status: texts.add(t_ns, status.values[key])))])
    return texts.series
