# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The clock of a receiver: where its stamps step against the motion of the train they are put back.

There are receivers whose stamps are off by a second for minutes. A train then seems to jump, and under the brake its
speed is told of another moment. That it is the clock which has stepped shows: the stamps leave their rhythm, but the
train has run no farther than in one period. Such samples are set aside until three agree: a driver that stalls, and
then sends all that has come together, has no rhythm. The positions alone decide, in the order of their coming.
"""

from __future__ import annotations

from itertools import pairwise
from statistics import median
from typing import NamedTuple

from .outcome import Event, Outcome
from .samples import PositionSample

S = 1_000_000_000

LEAST_NS, MOST_NS = 3 * S // 10, 3 * S
"""Stamps that step by less are jittered; beyond the other, once or in all, they are those of another time."""

RHYTHM, AGREEING = 8, 3
"""Samples that show period and speed, and such as must agree that the stamps have stepped."""

UNEVEN = 0.5
"""Part of the period by which samples may come early or late."""

PLAIN_M, NEAR, NEAR_M = 10.0, 0.4, 2.0
"""What the train runs in the time of the step, at least, unless the stamps return to what they were; by what part of
that, or so little, its way may differ from that of one period."""


class Read(NamedTuple):
    """What became of a sample."""

    clock: Clock
    samples: tuple[PositionSample, ...]
    """Those that may be used now, with stamps put right."""
    events: tuple[Event, ...] = ()


class Clock(NamedTuple):
    """How the stamps of the positions run. Immutable."""

    ahead_ns: int = 0
    """By how much they are ahead of what they were in the beginning."""
    recent: tuple[PositionSample, ...] = ()
    """The last ones, with stamps put right, in the order of their coming."""
    doubted: tuple[PositionSample, ...] = ()
    """Those set aside behind them."""

    def read(self, sample: PositionSample) -> Read:
        """Take the next one."""
        clock = self._replace(doubted=(*self.doubted, sample))
        step_ns = clock.step_ns()
        if step_ns and len(clock.doubted) < AGREEING:
            return Read(clock, ())
        read = clock._replace(ahead_ns=self.ahead_ns + step_ns).settled()
        if not step_ns:
            return read
        said = f"stamp of the position went on by {step_ns / S:+.3g} s, now {read.clock.ahead_ns / S:+.3g} s"
        return read._replace(events=(Event(Outcome.SHIFTED, said),))

    def settled(self) -> Read:
        """Nothing is set aside any more."""
        samples = tuple(each._replace(t_ns=each.t_ns - self.ahead_ns) for each in self.doubted)
        return Read(Clock(self.ahead_ns, (*self.recent, *samples)[-RHYTHM:]), samples)

    def step_ns(self) -> int:
        """By how much the stamps have stepped before those that are set aside; 0: not, or they do not agree."""
        if len(self.recent) < RHYTHM:
            return 0
        intervals = [later.t_ns - earlier.t_ns for earlier, later in pairwise(self.recent)]
        period_ns, first, before = round(median(intervals)), self.doubted[0], self.recent[-1]
        near_ns = UNEVEN * period_ns
        if not all(interval > 0 and abs(interval - period_ns) <= near_ns for interval in intervals):
            return 0
        step_ns = first.t_ns - self.ahead_ns - before.t_ns - period_ns
        if not LEAST_NS <= abs(step_ns) <= MOST_NS or abs(self.ahead_ns + step_ns) > MOST_NS:
            return 0
        period_m = (before.position_m - self.recent[0].position_m) / (RHYTHM - 1)
        way_m = abs(period_m * step_ns / period_ns)
        near_m = max(NEAR * way_m, NEAR_M)
        if way_m < PLAIN_M and abs(self.ahead_ns + step_ns) > near_ns:
            return 0
        runs = all(
            abs(each.t_ns - first.t_ns - k * period_ns) <= near_ns
            and abs(each.position_m - before.position_m - (k + 1) * period_m) <= near_m
            for k, each in enumerate(self.doubted)
        )
        return step_ns if runs else 0
