# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The samples of one sensor, sorted by their stamps, and the most that may come in a second. Immutable."""

from __future__ import annotations

from bisect import bisect_left
from typing import Any, NamedTuple

from .outcome import Outcome

INTERVAL_NS = 5_000_000
"""Least mean time between two samples of a sensor: 200 a second are more than an estimate needs."""

BURST_NS = 10 * INTERVAL_NS
"""By how much samples may run ahead of that mean: the jitter of a sensor of 200 Hz, and no flood."""

MOST = 12_000
"""Samples kept at most, 60 s of 200 Hz: stamps that scatter about one time let none go."""


class Stream(NamedTuple):
    """Samples of one sensor that may still be needed."""

    samples: tuple[Any, ...] = ()
    """Sorted by t_ns, which is the first of their fields, each stamp once."""
    newest_ns: int | None = None
    """Newest stamp that has come."""
    allowed_ns: int = 0
    """When the next sample would come if all had kept the mean (generic cell rate algorithm)."""
    spent_ns: int | None = None
    """Stamp up to which the samples have been used up, where each is given out once."""
    lag_ns: int = 0
    """How far behind the newest stamp of all sensors the samples have come of late, and a quarter more."""

    def refusal(self, t_ns: int) -> Outcome | None:
        """Why a sample of that stamp may not be added; None where it may."""
        if self.newest_ns is None:
            return None
        if t_ns > self.newest_ns:
            return Outcome.TOO_OFTEN if t_ns < self.allowed_ns - BURST_NS else None
        return Outcome.DUPLICATE if self.has_between(t_ns, t_ns) else None

    def added(self, sample: Any, first_ns: int | None = None) -> Stream:
        """The stream with one more sample, and without what is older than a time."""
        (samples, newest_ns, allowed_ns, spent_ns, lag_ns), t_ns = self, sample.t_ns
        if newest_ns is None or t_ns >= newest_ns:
            allowed_ns = (t_ns if newest_ns is None else max(t_ns, allowed_ns)) + INTERVAL_NS
            samples, newest_ns = (*samples, sample), t_ns
        else:
            samples = tuple(sorted((*samples, sample)))
        if first_ns is not None:
            samples = samples[_index(samples, first_ns) :]
        return Stream(samples, newest_ns, allowed_ns, spent_ns, lag_ns)

    def between(self, first_ns: int, last_ns: int) -> Stream:
        """What is stamped from the first to the last time, as the beginning of a stream."""
        kept = [sample for sample in self.samples if first_ns <= sample.t_ns <= last_ns]
        return Stream(tuple(kept), kept[-1].t_ns, kept[-1].t_ns + INTERVAL_NS) if kept else Stream()

    def delayed(self, behind_ns: int) -> Stream:
        """The stream after a sample so far behind the newest stamp of all; the next one forgets a fifth of that."""
        lag_ns = max(behind_ns * 5 // 4, self.lag_ns * 4 // 5)
        return self if lag_ns == self.lag_ns else Stream(*self[:4], lag_ns)

    def spent(self, t_ns: int) -> Stream:
        """The stream, its samples up to a stamp used up."""
        return Stream(self.samples, self.newest_ns, self.allowed_ns, t_ns, self.lag_ns)

    def after_first(self) -> Stream:
        """Without its first sample."""
        return Stream(self.samples[1:], *self[1:])

    @property
    def excess(self) -> int:
        """Samples beyond the most that are kept."""
        count = len(self.samples)
        return count - MOST if count > MOST else 0

    def has_between(self, first_ns: int, last_ns: int) -> bool:
        """Whether a kept sample is stamped from the first to the last time."""
        index = _index(self.samples, first_ns)
        return index < len(self.samples) and bool(self.samples[index].t_ns <= last_ns)

    def has_reached(self, t_ns: int) -> bool:
        """Whether a sample with this or a later stamp has come."""
        return self.newest_ns is not None and self.newest_ns >= t_ns

    def next_ns(self, t_ns: int) -> int | None:
        """The stamp of the first kept sample behind a time; None where there is none."""
        index = _index(self.samples, t_ns + 1)
        return self.samples[index].t_ns if index < len(self.samples) else None

    def latest(self, t_ns: int) -> Any | None:
        """The newest sample that is not later than a time; None where there is none."""
        index = _index(self.samples, t_ns + 1) - 1
        return None if index < 0 else self.samples[index]

    def unspent(self, first_ns: int, last_ns: int) -> tuple[Any, ...]:
        """The samples from the first to the last time that are not used up."""
        if self.spent_ns is not None:
            first_ns = max(first_ns, self.spent_ns + 1)
        return self.samples[_index(self.samples, first_ns) : _index(self.samples, last_ns + 1)]


def _index(samples: tuple[Any, ...], t_ns: int) -> int:
    """Where the samples from a time on begin; mostly that is one of the ends."""
    if not samples or t_ns <= samples[0].t_ns:
        return 0
    return len(samples) if t_ns > samples[-1].t_ns else bisect_left(samples, (t_ns,))
