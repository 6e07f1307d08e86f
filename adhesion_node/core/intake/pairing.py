# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What waits at the gate, and what an anchor is paired with.

Whether a sensor is there its earlier stamps tell, never whether it happens to have arrived; so what an anchor is
paired with does not depend on the order of arrival.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from ..quick import quick
from ..setting import once
from .stream import Stream

S = 1_000_000_000
NOTHING = Stream()

PRESENT_NS = 3 * S
"""A sensor that has not been heard for so long is not waited for: three messages of the slowest, of 1 Hz."""

MOST_EACH = 400
"""Samples of a sensor that an anchor gets at most: 2 s of 200 Hz."""


class Source(NamedTuple):
    """A sensor beside the anchor, and how its samples are paired."""

    kind: type[Any]
    wait_ns: int
    """How long an anchor waits for it, by the stamps."""
    age_ns: int
    """Age up to which its newest sample counts."""
    each: bool = False
    """Whether an anchor gets every sample since the one before, each once, and such as came late and are no older
    than it by more than the age; else the last value holds."""
    leads: bool = False
    """Whether it is enough by itself, without any anchor."""


class Gate(NamedTuple):
    """What is paired, and how far stamps may be apart."""

    anchor: type[Any]
    sources: tuple[Source, ...]
    max_lag_ns: int
    """How late an anchor may come and still be sorted in."""
    far_ns: int
    """A stamp further ahead of all others is set aside until a second one agrees with it."""
    reset_ns: int
    """So is one further back. A jump of the time further than this, or back, begins anew."""
    late_run: int
    """So many late anchors in a row show that the time has gone back."""
    tick_ns: int = 0
    """Without an anchor for so long the other sensors are given out by themselves; 0: never."""
    tick_for_ns: int = 0
    """How long after the last anchor or sample of a source that `leads`."""


@once
def waits_of(gate: Gate) -> Mapping[type[Any], Mapping[int, tuple[tuple[int, Source], ...]]]:
    """Sources of each sensor by how long they are waited for, with their places among those of the gate."""
    waits: dict[type[Any], dict[int, tuple[tuple[int, Source], ...]]] = {}
    for place, source in enumerate(gate.sources):
        alike = waits.setdefault(source.kind, {})
        alike[source.wait_ns] = (*alike.get(source.wait_ns, ()), (place, source))
    return waits


@once
def missing_of(gate: Gate) -> tuple[Any, ...]:
    """What an anchor is paired with where no other sensor is there."""
    return tuple(() if source.each else None for source in gate.sources)


@once
def kept_ns(gate: Gate) -> int:
    """How long before the released anchors another sensor's samples may still be needed."""
    return max((PRESENT_NS, *(source.age_ns + source.wait_ns for source in gate.sources)))


@once
def longest_wait_ns(gate: Gate) -> int:
    """How long an anchor waits at most, for others of its own and for other sensors."""
    return gate.max_lag_ns + max((source.wait_ns for source in gate.sources), default=0)


class Tick(NamedTuple):
    """A time at which there is no anchor."""

    t_ns: int


class Matched(NamedTuple):
    """An anchor, or a `Tick`, and the samples of its time, in the order of `Gate.sources`."""

    anchor: Any
    values: tuple[Any, ...]
    """A sample, None where one measured nothing; of a source whose samples come `each`, a tuple of them."""


@quick
class Inbox(NamedTuple):
    """What waits. Immutable: `push` returns a new one."""

    now_ns: int | None = None
    """Newest stamp of any sensor that is believed."""
    begun_ns: int = 0
    """First anchor or tick, of all or after a gap."""
    released_ns: int | None = None
    """Newest anchor or tick that was released."""
    anchored_ns: int | None = None
    """Newest anchor that was released."""
    anchors: Stream = Stream()
    """Anchors that wait."""
    others: MappingProxyType[type[Any], Stream] = MappingProxyType({})
    suspects: tuple[Any, ...] = ()
    """Samples stamped far from all others, set aside: at most one of each sensor."""
    late: tuple[int, int] = (0, 0)
    """Late anchors in a row, those set aside among them, and the stamp of the last late one."""
    left_ns: int | None = None
    """By how much the time that was left, when all began anew, is ahead of the present one."""

    def stream(self, kind: type[Any]) -> Stream:
        """What another sensor has measured."""
        return self.others.get(kind, NOTHING)

    def with_stream(self, kind: type[Any], stream: Stream, now_ns: int) -> Inbox:
        """The inbox with another stream in place of that sensor's, and its newest stamp of any."""
        return self._replace(others=MappingProxyType(self.others | {kind: stream}), now_ns=now_ns)


def is_present(inbox: Inbox, wait_ns: int, stream: Stream | None, t_ns: int) -> bool:
    """Whether a sensor is there, of what it has measured: heard not long before, so by now, whatever came first.

    In the beginning each may still come.
    """
    if inbox.begun_ns <= t_ns <= inbox.begun_ns + wait_ns:
        return True
    return stream is not None and stream.has_between(t_ns - PRESENT_NS, t_ns - wait_ns)


def value_of(source: Source, stream: Stream, t_ns: int, known_ns: int) -> Any | None:
    """The newest sample of a sensor at a time, unless it is too old; what came behind `known_ns` was not waited for."""
    latest = stream.latest(known_ns)
    return None if latest is None or t_ns - latest.t_ns > source.age_ns else latest


def each_of(inbox: Inbox, source: Source, stream: Stream, t_ns: int, known_ns: int) -> tuple[Any, ...]:
    """The samples of a sensor up to `known_ns` that are not used up, the newest ones where they are too many."""
    before_ns = t_ns if inbox.released_ns is None else min(inbox.released_ns, t_ns)
    return stream.unspent(before_ns - source.age_ns, known_ns)[-MOST_EACH:]
