# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Series gathered while the messages of a recording are read: of numbers, of texts, of what diagnostics tell by key."""

from __future__ import annotations

import math
import sys
from array import array
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ...bag import BagReader
from ...wire.messages.results import Status
from ...wire.topic import Topic
from .messages import Sample, read_topics, with_key
from .numbers import number
from .series import NONE, Series


def _itself(read: Any) -> Any:
    return read


class Numbers:
    """`value` of all that is read of a topic, NaN where a message was refused."""

    def __init__(self, value: Callable[[Any], Any] = _itself) -> None:
        self._value = value
        self._t_ns, self._values = array("q"), array("d")

    def take(self, sample: Sample) -> None:
        """Take a sample, of one message or of many."""
        value = math.nan if sample.read is None else self._value(sample.read)
        if isinstance(sample.t_ns, np.ndarray):
            self._t_ns.frombytes(sample.t_ns.tobytes())
            self._values.frombytes(np.broadcast_to(np.float64(value), sample.t_ns.shape).tobytes())
        else:
            self.add(sample.t_ns, value)

    def add(self, t_ns: int, value: float) -> None:
        """Take a value."""
        self._t_ns.append(t_ns)
        self._values.append(value)

    @property
    def series(self) -> Series:
        """The values by their stamps, which may have come late: log times do not tell."""
        t_ns = np.frombuffer(self._t_ns, dtype=np.int64)
        order = np.argsort(t_ns, kind="stable")
        return Series(t_ns[order], np.frombuffer(self._values)[order])


class Logged(Numbers):
    """The same with the log times of the messages, by which those without a stamp find one."""

    def __init__(self, value: Callable[[Any], Any] = _itself) -> None:
        super().__init__(value)
        self._log_ns = array("q")

    def take(self, sample: Sample) -> None:
        """Take a sample, of one message or of many."""
        super().take(sample)
        self._log_ns.frombytes(np.asarray(sample.log_ns, dtype=np.int64).tobytes())

    def stamped_by(self, *beside: Logged) -> Series:
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
            numbers.add(t_ns, number(status.values.get(key, "")))

    @property
    def series(self) -> dict[str, Series]:
        """The numbers by key."""
        return {key: numbers.series for key, numbers in self._numbers.items()}


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


def read_status(reader: BagReader, topic: Topic, key: str) -> Series:
    """Read the value of `key` in a topic of diagnostics, as texts."""
    texts = Texts()
    read_topics(reader, [(topic, with_key(key, lambda t_ns, status: texts.add(t_ns, status.values[key])))])
    return texts.series
