# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Messages of one time, each topic in its turn: as a node takes them that hears all topics at once."""

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import groupby

from .recordings import Record


def in_turn(records: Iterable[Record]) -> Iterator[Record]:
    """Yield records in order; of those of one log time the first of every topic, then the second of every topic.

    A telegram that bundles seconds of several sensors is recorded one topic behind the other.
    """
    for _, each in groupby(records, key=lambda record: record.log_ns):
        now, seen, turns = list(each), Counter[str](), list[int]()
        for record in now:
            seen[record.topic] += 1
            turns.append(seen[record.topic])
        yield from (now[at] for at in sorted(range(len(now)), key=turns.__getitem__))  # equals stay in their order
