# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Wheels that turn otherwise than positions run while no brake is applied: the one or the other is in another unit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from .outcome import Event, Outcome
from .plausibility import PACE_NS, RUNS_MPS, RUNS_SPANS
from .samples import Measurement

UNLIKE, ALIKE = (0.7, 1.4), (0.8, 1.25)
"""How fast rims of wheels that roll may be over how fast positions run, and from when on they are believed again. A
worn wheel is 7 % smaller than a new one; rpm are 9.5 times rad/s, km/h on a wheel of 0.46 m 1.7 times, m/s half."""

CRAWLING = 20.0
"""Times by which rims are faster than positions that are in km or miles: the wheels of no train spin so for long."""


class Turning(NamedTuple):
    """How fast rims are over how fast positions run, over the last spans of these without a brake."""

    since_ns: int | None = None
    position_m: float = 0.0
    shown: tuple[float, int] = (0.0, 0)
    """Sum and number of the speeds of rims of this span."""
    unlike: int = 0
    """Spans, one after the other, over which they were unlike."""
    ratio: float = 1.0
    crawling: int = 0
    """Spans, one after the other, over which positions hardly ran while rims did."""

    @property
    def crawls(self) -> bool:
        """Whether the positions surely are not in m."""
        return self.crawling >= RUNS_SPANS

    @property
    def lies(self) -> bool:
        """Whether the wheels surely tell something else than rad/s of their radius."""
        return self.unlike >= RUNS_SPANS

    def after(self, measurement: Measurement, shown_mps: Sequence[float], braked: bool) -> Turning:
        """Note the next position, if there is one, and the rims that turned with it; under a brake none."""
        if braked:
            return self if self.since_ns is None else self._replace(since_ns=None)
        shown = self.shown[0] + sum(shown_mps), self.shown[1] + len(shown_mps)
        t_ns, position_m = measurement[:2]
        if not measurement.has_position:
            return self._replace(shown=shown) if shown_mps else self
        kept = self._replace(since_ns=t_ns, position_m=position_m, shown=(0.0, 0))
        if self.since_ns is None or t_ns < self.since_ns:
            return kept
        if t_ns - self.since_ns < PACE_NS:
            return self._replace(shown=shown) if shown_mps else self
        running_mps = abs(position_m - self.position_m) / ((t_ns - self.since_ns) * 1e-9)
        return kept._judged(running_mps, shown[0] / max(shown[1], 1))

    def _judged(self, running_mps: float, rims_mps: float) -> Turning:
        """After a span over which positions ran and rims turned so fast; 0: not, or they say the same to the bit."""
        if 0.0 < CRAWLING * running_mps < rims_mps and rims_mps > RUNS_MPS:
            return self._replace(crawling=self.crawling + 1)
        if not rims_mps or running_mps < RUNS_MPS:
            return self if self.crawls else self._replace(crawling=0)
        ratio, (least, most) = rims_mps / running_mps, ALIKE if self.lies else UNLIKE
        return self._replace(unlike=0 if least < ratio < most else self.unlike + 1, ratio=ratio, crawling=0)

    def believed(self, measurement: Measurement) -> tuple[Measurement, tuple[Event, ...]]:
        """Without wheels or a position that lie, and what is to be told."""
        if self.crawls and measurement.has_position:
            told = Event(Outcome.POSITION_UNIT, f"position x = {measurement.position_m:.12g}, wheels turn")
            return measurement._replace(variance_m2=math.inf), (told,)
        if not (self.lies and measurement.wheels):
            return measurement, ()
        event = Event(Outcome.WHEEL_UNIT, f"wheel_speed: rims at {self.ratio:.2g} times the speed of the positions")
        return measurement._replace(wheels=()), (event,)
