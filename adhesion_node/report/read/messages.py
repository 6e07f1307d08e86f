# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The messages of a recording in one pass, decoded once and many together, handed to those who take them."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...bag import BagReader, Record
from ...bag.metadata import LATEST_NS
from ...bag.read.together import MOST_TOGETHER, together
from ...wire.line import NOMINAL, Line
from ...wire.messages.parts import stamp_ns, stamps_ns
from ...wire.messages.refused import Rejected
from ...wire.messages.results import Status
from ...wire.topic import Frame, Topic
from .numbers import number


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
        samples = [_sample(topic.together, stamps_ns, message, log_ns, line)]
    for sample in samples:
        for take in takes:
            take(sample)


def sample_of(topic: Topic, message: Any, log_ns: int, line: Line) -> Sample:
    """Read a message."""
    return _sample(topic.read, stamp_ns, message, log_ns, line)


def _sample(
    read: Callable[[Any, Line], Any], stamped: Callable[[Any], Any], message: Any, log_ns: Any, line: Line
) -> Sample:
    """Read one message, or many that stand as one."""
    header = getattr(message, "header", None)
    t_ns = log_ns if header is None else stamped(header)
    try:
        return Sample(log_ns, t_ns, read(message, line))
    except Rejected:
        return Sample(log_ns, t_ns, None)


def with_key(key: str, take: Callable[[int, Status], None]) -> Take:
    """Hand over the statuses that have `key`, at the stamp of the estimate of which they tell, else at their own."""

    def taken(sample: Sample) -> None:
        for status in sample.read.entries:
            stamp = str(status.values.get("stamp_ns", sample.t_ns))
            is_one = stamp.removeprefix("-").isdecimal() and abs(number(stamp)) <= LATEST_NS  # "none": of no estimate
            if key in status.values and is_one:
                take(int(stamp), status)

    return taken
