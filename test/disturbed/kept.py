# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What recordings hold of what was heard.

Of every life of a publisher a recording must hold all that was published from the first to the last message that it has
of it: what lies between and is not there is *lost*. What lies before came while the recorder did not know of the
publisher yet, which each subscriber finds out for itself; nobody can record that. What lies behind was not saved when
the recorder was killed. Both times are told, and bounded.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from adhesion_node.bag import BagReader
from adhesion_node.wire.messages.parts import stamp_ns

FOUND_S, UNSAVED_S = 30.0, 10.0
"""Longest times until a recorder has begun and found a publisher, and from what it saved last until it is killed. That
is a second where it is given the processor."""

Sent = dict[str, list[tuple[float, int]]]
"""What was heard: when it was published, and its stamp, by topic."""


class Recorded(NamedTuple):
    """A life of the recorder."""

    bag: Path
    begun_s: float
    until_s: float = math.inf


class Kept(NamedTuple):
    """What a recording holds of a life of a publisher."""

    topic: str
    bag: str
    asked: int
    """Messages that were heard and that it must hold."""
    lost_s: tuple[float, ...] = ()
    """When those were published that it lacks, before its last one."""
    found_s: float = 0.0
    """Until it held the first, from when the publisher was first heard and the recorder started."""
    unsaved_s: float = 0.0
    """From its last until the last that was heard of that life while the recorder lived."""

    @property
    def faults(self) -> list[str]:
        """What is wrong with it."""
        found = [f"lost: {self.topic}, {before_s:.2f} s before the last of {self.bag}" for before_s in self.lost_s]
        if self.found_s > FOUND_S:
            found.append(f"{self.topic}: {self.bag} began {self.found_s:.1f} s late")
        if self.unsaved_s > UNSAVED_S:
            found.append(f"{self.topic}: {self.bag} lacks the last {self.unsaved_s:.1f} s")
        return found


def kept(sent: Sent, lives: Mapping[str, Sequence[float]], recordings: Iterable[Recorded]) -> Iterator[Kept]:
    """Yield what the recordings hold of each life of the publishers, which began at `lives`, by topic."""
    for recorded in recordings:
        stamps: dict[str, set[int]] = defaultdict(set)
        with BagReader(recorded.bag) as bag:
            for record in bag.messages():
                if (name := record.topic.lstrip("/")) in sent:
                    stamps[name].add(stamp_ns(record.message.header))
        for name, began in lives.items():
            for from_s, to_s in pairwise([*began, math.inf]):
                heard = [one for one in sorted(sent[name]) if from_s <= one[0] < min(to_s, recorded.until_s)]
                if heard and heard[-1][0] > recorded.begun_s:
                    yield _kept(name, recorded, heard, stamps[name])


def _kept(name: str, recorded: Recorded, heard: Sequence[tuple[float, int]], stamps: set[int]) -> Kept:
    since_s, until_s = max(heard[0][0], recorded.begun_s), heard[-1][0]
    held_s = [at_s for at_s, stamp in heard if stamp in stamps]
    if not held_s:
        return Kept(name, recorded.bag.name, 0, (), until_s - since_s)
    first_s, last_s = held_s[0], held_s[-1]
    wanted = [one for one in heard if first_s <= one[0] <= last_s]
    lost_s = tuple(last_s - at_s for at_s, stamp in wanted if stamp not in stamps)
    return Kept(name, recorded.bag.name, len(wanted), lost_s, max(first_s - since_s, 0.0), until_s - last_s)
