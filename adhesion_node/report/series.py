# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Series over time out of a recording: what pictures and tables are made from."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..bag import BagReader
from ..core.physics.train import Array
from ..wire.codecs import NOMINAL, Line, Rejected, stamp_ns
from ..wire.results import Status, Statuses
from ..wire.topics import Frame, Topic

Times = NDArray[np.int64]


class Series(NamedTuple):
    """Values at increasing times; both of shape (n,)."""

    t_ns: Times
    values: NDArray[Any]

    def at(self, t_ns: Times) -> Array:
        """Values interpolated at other times; held constant before the first and after the last."""
        return np.asarray(np.interp(t_ns, self.t_ns, self.values), dtype=np.float64)

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


def read_topic(reader: BagReader, topic: Topic, line: Line = NOMINAL) -> Iterator[Sample]:
    """Yield what is read of every message of a topic, whatever its frame; one that does not decode is left out."""
    read = topic._replace(frame=Frame.ANY).read
    for record, message in reader.decoded([topic.name]):
        header = getattr(message, "header", None)
        t_ns = record.log_ns if header is None else stamp_ns(header)
        try:
            yield Sample(record.log_ns, t_ns, read(message, line))
        except Rejected:
            yield Sample(record.log_ns, t_ns, None)


def read_series(reader: BagReader, topic: Topic, value: Callable[[Any], Any], line: Line = NOMINAL) -> Series:
    """Take `value` of all that is read of a topic, by its stamp or log time; NaN where a message is refused.

    Empty when the recording lacks the topic.
    """
    samples = read_topic(reader, topic, line)
    rows = [(sample.t_ns, np.nan if sample.read is None else value(sample.read)) for sample in samples]
    rows.sort(key=lambda row: row[0])  # stamps may come late; log times do not tell
    return Series(np.array([t for t, _ in rows], dtype=np.int64), np.array([v for _, v in rows]))


def read_unstamped(reader: BagReader, topic: Topic, beside: Sequence[Topic]) -> Series:
    """Read a topic of Float64: each message takes the stamp of the message of `beside` that was logged nearest to it.

    What is published together is logged together, so a lost message leaves a gap and moves no other one. Of several
    that would take one stamp the nearest in log time does. Empty when either is missing.
    """
    anchors = sorted((sample.log_ns, sample.t_ns) for name in beside for sample in read_topic(reader, name))
    rows = [(sample.log_ns, sample.read) for sample in read_topic(reader, topic) if anchors and sample.read is not None]
    nearest: dict[int, tuple[int, Any]] = {}
    for log_ns, value in rows:
        after = bisect_left(anchors, (log_ns,))
        distance, stamp = min((abs(log - log_ns), stamp) for log, stamp in anchors[max(after - 1, 0) : after + 1])
        nearest[stamp] = min(nearest.get(stamp, (distance, value)), (distance, value), key=lambda row: row[0])
    stamps = sorted(nearest)
    return Series(np.array(stamps, dtype=np.int64), np.array([nearest[stamp][1] for stamp in stamps]))


def read_status(reader: BagReader, topic: Topic, key: str) -> Series:
    """Read the value of `key` in a topic of diagnostics, as texts."""
    return _texts((t_ns, status.values[key]) for t_ns, status in statuses(reader, topic, key))


def read_remarks(reader: BagReader, topic: Topic, key: str) -> Series:
    """Read what the statuses that have `key` say while they are not OK; "" while they are."""
    return _texts((t_ns, status.message if status.level else "") for t_ns, status in statuses(reader, topic, key))


def read_numbers(reader: BagReader, topic: Topic, key: str) -> tuple[tuple[int, dict[str, float]], ...]:
    """Read the numbers of the statuses that have `key`, at their times."""
    rows = ((t_ns, _numbers(status.values)) for t_ns, status in statuses(reader, topic, key))
    return tuple(sorted(rows, key=lambda row: row[0]))


def _numbers(values: Mapping[str, str]) -> dict[str, float]:
    found = {}
    for key, text in values.items():
        with suppress(ValueError):
            found[key] = float(text)
    return {key: value for key, value in found.items() if np.isfinite(value)}


def read_last_status(reader: BagReader, topic: Topic, key: str) -> dict[str, str]:
    """Read the last values, by their keys, of the status that has `key`; {} where there is none."""
    found = [status.values for sample in read_topic(reader, topic) for status in _with_key(sample.read, key)]
    return dict(found[-1]) if found else {}


def statuses(reader: BagReader, topic: Topic, key: str) -> Iterator[tuple[int, Status]]:
    """Yield the statuses that have `key`, at the stamp of the estimate of which they tell, else at their own."""
    for sample in read_topic(reader, topic):
        for status in _with_key(sample.read, key):
            stamp = status.values.get("stamp_ns", str(sample.t_ns))
            if stamp != "none":  # of no estimate
                yield int(stamp), status


def _texts(rows: Iterable[tuple[int, str]]) -> Series:
    ordered = sorted(rows, key=lambda row: row[0])
    return Series(np.array([t for t, _ in ordered], dtype=np.int64), np.array([text for _, text in ordered]))


def _with_key(read: Statuses, key: str) -> list[Status]:
    return [status for status in read.entries if key in status.values]
