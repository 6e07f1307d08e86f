# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Samples that come seldom: a time in which something is looked for holds so many of them at least."""

from __future__ import annotations

S = 1_000_000_000

APART_NS = 2 * S
"""Samples count as so far apart at most: else none come."""


def apart_ns(before_ns: int | None, now_ns: int) -> int:
    """Time from the sample before to one, ns; 0 where it is the first.

    >>> apart_ns(None, 5 * S), apart_ns(4 * S, 5 * S), apart_ns(0, 5 * S)
    (0, 1000000000, 2000000000)
    """
    return 0 if before_ns is None else min(now_ns - before_ns, APART_NS)


def at_least(span_ns: int, samples: float, apart: int) -> int:
    """A time, ns, that holds so many samples.

    >>> at_least(S // 2, 1.5, S // 10), at_least(S // 2, 1.5, S)
    (500000000, 1500000000)
    """
    return max(span_ns, round(samples * apart))
