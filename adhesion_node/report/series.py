# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Series over time out of a recording, whose messages are decoded once: what pictures and tables are made from."""

from __future__ import annotations

import math
import sys
from array import array
from collections.abc import Callable, Iterable
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..bag import BagReader
from ..core.physics.train import Array
from ..wire.codecs import NOMINAL, Line, Rejected, stamp_ns
from ..wire.results import Status
from ..wire.topics import Frame, Topic

Times = NDArray[np.int64]


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
    """What was read of one message; None where it was refused. `t_ns` is its stamp, or the log time without one."""

    log_ns: int
    t_ns: int
    read: Any


Take = Callable[[Sample], None]
"""Takes what is read of a topic's messages, one after the other."""


def read_topics(reader: BagReader, takes: Iterable[tuple[Topic, Take]], line: Line = NOMINAL) -> None:
    """Hand over what is read of every message, whatever its frame, in one pass; one that does not decode is left out.

    A topic may be taken several times; one that the recording lacks is not.
    """
    taken: dict[str, tuple[Topic, list[Take]]] = {}
    for topic, take in takes:
        if (name := reader.resolve(topic.name)) is not None:
            taken.setdefault(name, (topic._replace(frame=Frame.ANY), []))[1].append(take)
    for record, message in reader.decoded(taken):
        topic, each = taken[record.topic]
        sample = sample_of(topic, message, record.log_ns, line)
        for take in each:
            take(sample)


def sample_of(topic: Topic, message: Any, log_ns: int, line: Line) -> Sample:
    """Read a message."""
    header = getattr(message, "header", None)
    t_ns = log_ns if header is None else stamp_ns(header)
    try:
        return Sample(log_ns, t_ns, topic.read(message, line))
    except Rejected:
        return Sample(log_ns, t_ns, None)


class Numbers:
    """`value` of all that is read of a topic, NaN where a message was refused."""

    def __init__(self, value: Callable[[Any], float] = float) -> None:
        self._value = value
        self._t_ns, self._log_ns, self._values = array("q"), array("q"), array("d")

    def take(self, sample: Sample) -> None:
        """Take a sample."""
        self.add(sample.t_ns, math.nan if sample.read is None else self._value(sample.read), sample.log_ns)

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
        anchors = sorted(chain.from_iterable(zip(one._log_ns, one._t_ns, strict=True) for one in beside))
        values, log_ns = np.array(self._values), np.array(self._log_ns, dtype=np.int64)
        known = np.isfinite(values)
        if not (anchors and known.any()):
            return NONE
        values, log_ns = values[known], log_ns[known]
        logged, stamps = np.array(anchors, dtype=np.int64).T
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
        self._rows: list[tuple[int, str]] = []

    def add(self, t_ns: int, text: str) -> None:
        """Take a text; most are said again and again."""
        self._rows.append((t_ns, sys.intern(text)))

    @property
    def series(self) -> Series:
        """The texts by their times."""
        ordered = sorted(self._rows, key=lambda row: row[0])
        return Series(np.array([t for t, _ in ordered], dtype=np.int64), np.array([text for _, text in ordered]))


def with_key(key: str, take: Callable[[int, Status], None]) -> Take:
    """Hand over the statuses that have `key`, at the stamp of the estimate of which they tell, else at their own."""

    def taken(sample: Sample) -> None:
        for status in sample.read.entries:
            stamp = status.values.get("stamp_ns", sample.t_ns)
            if key in status.values and stamp != "none":  # of no estimate
                take(int(stamp), status)

    return taken


def read_series(reader: BagReader, topic: Topic, value: Callable[[Any], float], line: Line = NOMINAL) -> Series:
    """Take `value` of all that is read of a topic, by its stamp or log time. Empty when the recording lacks it."""
    numbers = Numbers(value)
    read_topics(reader, [(topic, numbers.take)], line)
    return numbers.series


def read_status(reader: BagReader, topic: Topic, key: str) -> Series:
    """Read the value of `key` in a topic of diagnostics, as texts."""
    texts = Texts()
    read_topics(reader, [(topic, with_key(key, lambda t_ns, status: texts.add(t_ns, status.values[key])))])
    return texts.series
