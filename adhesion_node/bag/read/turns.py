# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Messages of one log time, the topics side by side: a telegram may bundle seconds of several sensors."""

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import groupby

from .recordings import Record


def in_turn(records: Iterable[Record]) -> Iterator[Record]:
    """Yield records in order; those of one log time as if each topic had come at a rate of its own until then.

    They are recorded one topic behind the other, or as they came: that order stays.
    """
    for _, each in groupby(records, key=lambda record: record.log_ns):
        now = list(each)
        if len(now) == 1:
            yield from now
            continue
        counts, seen, parts = Counter(record.topic for record in now), Counter[str](), list[float]()
        for record in now:
            parts.append((seen[record.topic] + 0.5) / counts[record.topic])
            seen[record.topic] += 1
        yield from (now[at] for at in sorted(range(len(now)), key=parts.__getitem__))  # equals stay in their order
