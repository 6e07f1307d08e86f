# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the bank remembers from measurement to measurement."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from ..belief.rail import Rail
from ..belief.regime import Regime
from ..intake.outcome import Event
from ..intake.samples import MAX_VARIANCE_M2, SpeedSample
from ..quick import quick
from .gear.axles import Axles
from .gear.brake import BrakeSeen
from .gear.repeating import Repeating
from .gear.wheels import WheelsSeen
from .kernels import weighing
from .layout import POSITION, SCALE, Bank
from .motion import Braking, moved
from .seeing import Observation, considered, corrected
from .sensors.coarse import Coarse
from .sensors.leaping import Leaping
from .sensors.plausible import Course
from .sensors.pointing import Pointing
from .sensors.scatter import LASTING, Coloured, Scatter

if TYPE_CHECKING:
    from ..config import Config

S = 1_000_000_000

DARK_NS = 5 * S
"""So long behind a position the speed goes on by others."""

HALF_LOG_2PI = 0.5 * math.log(2.0 * math.pi)

STEP_S = 0.2
"""Longest step in time."""

ASKED_S = 0.5
"""How often it is asked what has changed: the rail, what limits, traction, a train that hardly moves."""


@quick
class Memory(NamedTuple):
    """What the bank remembers."""

    bank: Bank
    t_ns: int
    declared_m: float
    """Standard deviation that the last position declared."""
    brake: BrakeSeen = BrakeSeen()
    axles: Axles = Axles()
    wheels: WheelsSeen = WheelsSeen()
    braking: Braking = Braking(0.0)
    untold: bool = False
    """Whether nothing tells if a brake is applied: wheels may slide."""
    since_s: float = 0.0
    """Since it was last asked what has changed."""
    known: Rail = Rail(0.0, 1.0, 0.0)
    """The rail as it was known when the braking began; where it has limited since, no better than the bounds told."""
    told_s: float = 0.0
    """Until when no change is told: the brake builds up, or the border of the last one lies under the train."""
    changes: int = 0
    """Changes of the rail told."""
    steady: tuple[Bank, Braking] | None = None
    """What was believed when none was in doubt, ..."""
    slid: bool = False
    """... and whether axles slid then."""
    course: Course = Course()
    past: tuple[tuple[int, Bank], ...] = ()
    """Beliefs of some seconds ago, to go back to where positions turn out to be wrong."""
    misled: bool = False
    """Whether the positions are those of a sliding wheel: they are left out until the brake is released."""
    aside: bool = False
    """Whether they are left out so, and the train is followed by its wheels meanwhile."""
    seen: int = 0
    """Measurements of the present braking; 0 while there is none."""
    slowed_mps: float = 0.0
    """By how much the train was foreseen to slow under the brake, of all brakings."""
    repeating: Repeating = Repeating()
    leaping: Leaping = Leaping()
    pointing: Pointing = Pointing()
    places: Scatter = Scatter()
    placed_ns: int = -S
    """Stamp of the last position that was taken in."""
    coarse: Coarse = Coarse()
    speeds: Coloured = Coloured(LASTING)
    shaking: Coloured = Coloured()
    left_out: tuple[Event, ...] = ()
    """Of the newest measurement, with the reason."""
    fixes: int = 0
    """Positions taken in; a speed counts as two, as it takes two positions to tell one."""
    log_likelihood: float = 0.0
    """Sum of ln p of what positions, speeds and accelerometer told since the last estimate, in m, m/s and g."""

    @property
    def braked(self) -> bool:
        """Whether a braking is open."""
        return self.seen > 0

    @property
    def asks(self) -> bool:
        """Whether it is time to ask again what has changed."""
        return self.since_s >= ASKED_S - 1e-6

    @property
    def is_placed(self) -> bool:
        """Whether any position has said where the train is."""
        return bool(self.bank.covariance[0, POSITION, POSITION] < 0.5 * MAX_VARIANCE_M2)

    @property
    def is_rolled(self) -> bool:
        """Whether the positions are a wheel's: they hardly wander, hardly scatter, or come in its pulses."""
        return self.course.wandering.is_rolled or self.course.rolling.is_known or self.coarse.are_pulses

    @property
    def is_dark(self) -> bool:
        """Whether no position tells how fast the train is: then nothing tells what the scale of its speed is off by.

        But where that has leapt it is the train that tells.
        """
        placed = self.is_placed and self.t_ns - self.placed_ns < DARK_NS and not self.misled
        return not placed and self.leaping.by_mps == 0.0

    def told(self, seen: Observation, fixes: int = 0) -> Memory:
        """Take in an observation."""
        bank = corrected(self.bank, seen)
        bank = considered(self.bank, bank, SCALE) if self.is_dark else bank
        total = weighing.total(bank.log_weight)
        return self._replace(
            bank=bank.believing(bank.mean, bank.covariance, bank.log_weight - total),
            fixes=self.fixes + fixes,
            log_likelihood=self.log_likelihood + total - HALF_LOG_2PI,
        )

    def having_told(self, regime: Regime, rail: Rail) -> Memory:
        """An estimate is told: where the rail limits, no more than its bound counts as known of it in this braking."""
        limits = regime is Regime.ADHESION_LIMITED
        known = self.known._replace(lower=min(self.known.lower, rail.lower)) if limits else self.known
        return self._replace(log_likelihood=0.0, known=known)

    def leaving_out(self, event: Event) -> Memory:
        """Leave a sample out that is not to be believed."""
        return self._replace(left_out=(*self.left_out, event))

    def is_pressed(self, config: Config) -> bool:
        """Whether a brake is applied."""
        return self.brake.demanded_pa >= config.least_pressure_pa

    def bank_at(self, config: Config, until_ns: int) -> Bank:
        """The bank moved on to a time, if that is later."""
        if until_ns <= self.t_ns:
            return self.bank
        return moved(config, self.bank, (until_ns - self.t_ns) / S, self.braking, self.declared_m)


def steps(from_ns: int, to_ns: int, speeds: Sequence[SpeedSample] = ()) -> Sequence[int]:
    """Ends of the steps up to a time: at those of the speeds that lie on the way, and no step too long."""
    if not speeds and to_ns - from_ns <= STEP_S * S:
        return (to_ns,)
    ends: list[int] = []
    for until_ns in (*sorted({each.t_ns for each in speeds if from_ns < each.t_ns < to_ns}), to_ns):
        count = max(math.ceil((until_ns - from_ns) / (STEP_S * S)), 1)
        ends += [from_ns + (until_ns - from_ns) * index // count for index in range(1, count + 1)]
        from_ns = until_ns
    return ends
