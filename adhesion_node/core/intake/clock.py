# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The clock of a receiver: where its stamps step away from those of the other sensors they are put back.

There are receivers whose stamps are off by a second for minutes. A train then seems to jump, and under the brake its
speed is told of another moment. That it is the clock which has stepped shows: the stamps leave their rhythm, but the
train has run no farther than in one period. Such samples are set aside until three agree: a driver that stalls, and
then sends all that has come together, has no rhythm. Which time is right the stamps of the other sensors tell: nothing
is put back but towards them, and no longer than it serves that. Samples decide in the order of their coming.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from statistics import median, median_low
from types import MappingProxyType
from typing import Any, NamedTuple

from .outcome import Event, Outcome
from .samples import PositionSample

S = 1_000_000_000

LEAST_NS, MOST_NS = 3 * S // 10, 3 * S
"""Stamps that step by less are jittered; beyond the other, once or in all, they are those of another time."""

LONG_NS = 2 * MOST_NS
"""What is set aside waits no longer for the next one: stamps that are behind by the most, and as much again."""

RHYTHM, AGREEING = 8, 3
"""Samples that show period and speed, or that stamps are right again; and such as must agree that they have stepped."""

ALIVE = 30
"""Another sensor tells the time until so many positions have come since it was heard."""

UNEVEN = 0.5
"""Part of the period by which samples may come early or late: so balises do of a train that runs slower or faster."""

NEAR, NEAR_M = 0.4, 2.0
"""By what part of what the train runs in the time of the step, or by so little, its way may differ from that of one
period."""


class Read(NamedTuple):
    """What became of a sample."""

    clock: Clock
    samples: tuple[PositionSample, ...]
    """Those that may be used now, with stamps put right."""
    events: tuple[Event, ...] = ()


class Clock(NamedTuple):
    """How the stamps of the positions run. Immutable."""

    ahead_ns: int = 0
    """By how much they are ahead."""
    recent: tuple[PositionSample, ...] = ()
    """The last ones, with stamps put right, in the order of their coming."""
    doubted: tuple[PositionSample, ...] = ()
    """Those set aside behind them."""
    others: Mapping[type[Any], tuple[int, int]] = MappingProxyType({})
    """Stamp of the last sample of each other sensor, ns, and how many of these had come before it."""
    come: int = 0
    """How many of these have come."""
    right: int = 0
    """Samples in a row whose stamps were right, those put back not."""

    def beside(self, sample: Any) -> Read:
        """Note a sample of another sensor; what by its stamp was set aside long ago is so no more."""
        clock = self._replace(others=MappingProxyType({**self.others, type(sample): (sample.t_ns, self.come)}))
        long = clock.doubted and sample.t_ns > clock.doubted[-1].t_ns + LONG_NS
        return clock.settled() if long else Read(clock, ())

    def read(self, sample: PositionSample) -> Read:
        """Take the next one."""
        right = self.right + 1 if self.ahead_ns and self._agrees(sample.t_ns, 0, self.ahead_ns) else 0
        clock = self._replace(doubted=(*self.doubted, sample), come=self.come + 1, right=right)
        step_ns = -self.ahead_ns if right == RHYTHM else clock._step_ns()
        if not (step_ns and self._agrees(sample.t_ns, self.ahead_ns + step_ns, self.ahead_ns)):
            return clock.settled()
        if right < RHYTHM and len(clock.doubted) < AGREEING:
            return Read(clock, ())
        read = clock._replace(ahead_ns=self.ahead_ns + step_ns, right=0).settled()
        said = f"stamp of the position went on by {step_ns / S:+.3g} s, now {read.clock.ahead_ns / S:+.3g} s"
        return read._replace(events=(Event(Outcome.SHIFTED, said),))

    def settled(self) -> Read:
        """Nothing is set aside any more."""
        samples = tuple(each._replace(t_ns=each.t_ns - self.ahead_ns) for each in self.doubted)
        return Read(self._replace(recent=(*self.recent, *samples)[-RHYTHM:], doubted=()), samples)

    def unsure(self) -> Clock:
        """A step of what comes next is meant."""
        return self._replace(recent=())

    def _agrees(self, t_ns: int, ahead_ns: int, other_ns: int) -> bool:
        """Whether a stamp agrees with the other sensors' plainly better if it is ahead by the one than by the other."""
        period_ns = round(median(self._intervals() or (0,)))
        ages = ((t_ns, self.come - before) for t_ns, before in self.others.values())
        now_ns = [t_ns + age * period_ns for t_ns, age in ages if age <= ALIVE]
        if not now_ns:
            return False
        right_ns = median_low(now_ns)
        return abs(t_ns - ahead_ns - right_ns) + LEAST_NS // 2 < abs(t_ns - other_ns - right_ns)

    def _intervals(self) -> list[int]:
        return [later.t_ns - earlier.t_ns for earlier, later in pairwise(self.recent)]

    def _step_ns(self) -> int:
        """By how much the stamps have stepped before those that are set aside; 0: not, or they do not agree."""
        if len(self.recent) < RHYTHM:
            return 0
        intervals = self._intervals()
        period_ns, first, before = round(median(intervals)), self.doubted[0], self.recent[-1]
        near_ns = UNEVEN * period_ns
        if not all(interval > 0 and abs(interval - period_ns) <= near_ns for interval in intervals):
            return 0
        step_ns = first.t_ns - self.ahead_ns - before.t_ns - period_ns
        if not max(LEAST_NS, near_ns) <= abs(step_ns) <= MOST_NS or abs(self.ahead_ns + step_ns) > MOST_NS:
            return 0
        period_m = (before.position_m - self.recent[0].position_m) / (RHYTHM - 1)
        way_m = abs(period_m * step_ns / period_ns)
        near_m = max(NEAR * way_m, NEAR_M)
        runs = all(
            abs(each.t_ns - first.t_ns - k * period_ns) <= near_ns
            and abs(each.position_m - before.position_m - (k + 1) * period_m) <= near_m
            for k, each in enumerate(self.doubted)
        )
        return step_ns if runs else 0
