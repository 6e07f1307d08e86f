# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The fastest rim under the brake: where it falls faster than a train can all axles slide, once risen it rolls."""

from __future__ import annotations

import math
from typing import NamedTuple

from ...intake.plausibility import STRONGEST_MPS2
from .halting import Halting
from .wander import Wander

S = 1_000_000_000

RISEN = 1.02
"""Times its lowest speed from which the fastest rim has risen, more than by noise."""

FALL_NS, FALL_SIGMA, FELL_NS, UNTOLD_NS = 2 * S // 5, 2.5, S, 120 * S
"""Time over which it is seen how fast the fastest rim falls or rises. Where it falls faster than any brake stops a
train, by so many standard deviations of its noise, all axles slide. They count so for the next time; where no pressure
tells of a brake, for the last one."""

DEEPER = 1.3
"""Times as fast as ever in a braking it must fall to tell anything anew: else it errs as it did before."""

UNISON_S = 1.5
"""For so long behind such a fall, and behind the brake's build-up, all axles may slide as one."""


class Fastest(NamedTuple):
    """The fastest rim, of late and in this braking."""

    trusted_ns: int = 0
    """From when on it may be taken for the train's speed."""
    lowest_mps: float = math.inf
    """Its speed at its lowest since the brake was applied."""
    risen: bool = False
    """Whether it has risen since, and rises no more: a train under the brake does not, so it slid and rolls again."""
    wander: Wander = Wander()
    """How it errs."""
    recent: tuple[tuple[int, float], ...] = ()
    """How fast it was of late, with stamps in ns, ..."""
    fell_ns: int | None = None
    """... when it last fell faster than a train can, ..."""
    fall_mps2: float = 0.0
    """... and how fast at most in this braking, to within `DEEPER`."""
    halting: Halting = Halting()
    """How it comes down under the brake."""

    def waiting(self, trusted_ns: int) -> Fastest:
        """No braking is open: it will not be trusted before, and of the last braking only a fall counts still."""
        return Fastest(trusted_ns, recent=self.recent, fell_ns=self.fell_ns)

    def after(self, fastest_mps: float, noise: float, now_ns: int) -> Fastest:
        """Note how fast it is, of such a variance, relative; it may be trusted once it has risen, until it falls."""
        recent = (*(each for each in self.recent if now_ns - each[0] <= FALL_NS), (now_ns, fastest_mps))
        then_ns, then_mps = recent[0]
        most = STRONGEST_MPS2 * (now_ns - then_ns) / S + FALL_SIGMA * math.sqrt(2.0 * noise) * then_mps
        if 2 * (now_ns - then_ns) >= FALL_NS and then_mps - fastest_mps > most:
            trusted_ns = max(self.trusted_ns, now_ns + round(UNISON_S * S))
            fall = S * (then_mps - fastest_mps) / (now_ns - then_ns)
            fall = fall if fall > DEEPER * self.fall_mps2 else self.fall_mps2
            fallen = self._replace(recent=recent, fell_ns=now_ns, fall_mps2=fall)
            return fallen._replace(trusted_ns=trusted_ns, lowest_mps=fastest_mps, risen=False)
        if self.risen:
            return self._replace(recent=recent)
        lowest = min(self.lowest_mps, fastest_mps)
        risen = RISEN * lowest < fastest_mps <= then_mps
        trusted_ns = min(self.trusted_ns, now_ns) if risen else self.trusted_ns
        return self._replace(recent=recent, trusted_ns=trusted_ns, lowest_mps=lowest, risen=risen)

    def fell(self, now_ns: int, within_ns: int = FELL_NS) -> bool:
        """Whether all axles slide, as the fastest rim has fallen faster than a train can."""
        return self.fell_ns is not None and now_ns - self.fell_ns < within_ns
