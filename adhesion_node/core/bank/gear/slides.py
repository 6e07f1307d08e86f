# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which axles slide under the brake, and what part of those of which it is known."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from .radii import UNEQUAL
from .seldom import apart_ns, at_least

if TYPE_CHECKING:
    from ...config import Config

S = 1_000_000_000

SLID_NS, FRESH_NS = 3 * S, S
"""An axle counts as sliding so long, as its protection lets it roll in between; so long may wheels not be heard."""

FILLED_NS = 15 * S
"""For so long behind a slide an axle that rolls uses no more than those that slide: its protection fills the cylinder
slowly, and lets go of it again."""

SLID_SAMPLES = 16
"""An axle counts as sliding for so many samples where they come seldom, as slides fall between them."""

UNSURE, ROLLING = 3.0, 2.0
"""Standard deviations of the train's speed within which creep may be none; times the creep that slides below which an
axle rolls for certain."""

BRAKE_BELOW = 0.05
"""Share of sliding axles below which the brake limits."""

SOME_SLIDE, TOLD, HINTED = 0.25, 4.0, 1.0
"""Share of sliding axles from which adhesion limits, and the log odds per second by which wheels tell which does, and
a single one that rolls: protection may hold just this one at a small creep, or keep its brake released."""

FALLS = 8.0
"""Log odds per second by which all axles slide once the fastest rim has fallen faster than a train can."""


class Slides(NamedTuple):
    """When the axles were seen to slide, and to roll."""

    slid_ns: tuple[int | None, ...] = ()
    """When each was last seen to slide."""
    rolled_ns: tuple[int | None, ...] = ()
    """When each was last seen to roll."""
    heard_ns: int | None = None
    """When they were last heard, ..."""
    every_ns: int = 0
    """... and how long behind the sample before."""

    def heard(self, t_ns: int) -> Slides:
        """Note that they are heard."""
        return self._replace(heard_ns=t_ns, every_ns=apart_ns(self.heard_ns, t_ns))

    def after(self, config: Config, rims: list[float], t_ns: int, speed_mps: float, std_mps: float) -> Slides:
        """Hold rims, each by its own radius, against the train's speed and the fastest of them; NaN: not known."""
        fastest = max((rim for rim in rims if not math.isnan(rim)), default=0.0)
        unsure = UNSURE * std_mps / speed_mps
        by_train, by_fastest = ([1.0 - rim / most for rim in rims] for most in (speed_mps, max(fastest, 1e-6)))
        slid, rolled = list(self.slid_ns), list(self.rolled_ns)
        for axle, (creep, behind) in enumerate(zip(by_train, by_fastest, strict=True)):  # never true of NaN
            if creep > config.sliding_creep + unsure or behind > config.sliding_creep + UNEQUAL:
                slid[axle] = t_ns
            elif creep + unsure < ROLLING * config.sliding_creep:
                rolled[axle] = t_ns
        return self._replace(slid_ns=tuple(slid), rolled_ns=tuple(rolled))

    def share(self, now_ns: int, late_ns: int = SLID_NS) -> float | None:
        """Share of the axles that have slid of late, of those of which it is known; None where it is of too few."""
        slid, rolled = self._seen(now_ns, late_ns)
        known = sum(one or other for one, other in zip(slid, rolled, strict=True))
        if not known or 2 * known < len(slid) or (known == 1 and not any(slid)):
            return None
        return sum(slid) / known

    def one_rolls(self, now_ns: int) -> bool:
        """Whether no more than one axle is known of, of one or two that are heard, and that has not slid of late."""
        slid, rolled = self._seen(now_ns, SLID_NS)
        return len(slid) <= 2 and sum(rolled) == 1 and not any(slid)

    def any_slid(self, now_ns: int, late_ns: int) -> bool:
        """Whether any has slid of late."""
        return any(self._seen(now_ns, late_ns)[0])

    def _seen(self, now_ns: int, late_ns: int) -> tuple[list[bool], list[bool]]:
        """Which axles have slid of late, and which roll."""
        counts_ns = at_least(late_ns, SLID_SAMPLES, self.every_ns)
        slid = [each is not None and now_ns - each < counts_ns for each in self.slid_ns]
        return slid, [each is not None and now_ns - each < FRESH_NS for each in self.rolled_ns]


def told(share: float | None, dumping: bool, fell: bool = False, one_rolls: bool = False) -> float:
    """Log odds per second by which axles are known to slide: wheels say it, else the dumps of the slide protection.

    >>> told(0.8, False), told(0.0, False), told(None, True), told(None, False), told(0.8, False, fell=True)
    (4.0, -4.0, 4.0, 0.0, 8.0)
    >>> told(None, True, one_rolls=True), told(None, False, one_rolls=True)
    (4.0, -1.0)
    """
    if fell:
        return FALLS
    if share is None:
        return TOLD if dumping else -HINTED if one_rolls else 0.0
    return TOLD if share >= SOME_SLIDE else -TOLD if share < BRAKE_BELOW else 0.0
