# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Everything that the estimator remembers from one sample to the next."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from .bank.anew import Anew
from .bank.layout import POSITION, SPEED
from .bank.memory import Memory
from .bank.sensors.odometer import Odometer
from .bank.steps import Stepping
from .belief.gaussian import Gaussian
from .estimate import Estimate, Knowledge
from .intake.clock import Clock
from .intake.outcome import NO_COUNTS, Event, Outcome, counted
from .intake.pairing import Gate, Inbox
from .intake.plausibility import Pace, Repeated
from .intake.samples import Measurement
from .intake.standing import Standing
from .intake.turning import Turning
from .intake.zero import Zero
from .methods.protocol import AnyMethod, MethodWindow
from .quick import quick


class Sure(NamedTuple):
    """What was known at some time. The numbers are not made before they are asked for, which is rare."""

    seen: Estimate
    """The last estimate."""
    memory: Memory | None

    @property
    def estimate(self) -> Estimate:
        """The last estimate; where the bank is, with position and speed as of the newest measurement."""
        memory = self.memory
        if memory is None or memory.fixes < 2:
            return self.seen
        belief = Gaussian(*memory.bank.moments(2))
        return self.seen._replace(
            t_ns=memory.t_ns,
            position_m=float(belief.mean[POSITION]),
            speed_mps=float(belief.mean[SPEED]),
            position_std_m=belief.position_std,
            speed_std_mps=belief.speed_std,
        )


@quick
class State(NamedTuple):
    """Everything the estimator remembers. Immutable: `step` returns a new one."""

    seed: int
    gate: Gate
    method: AnyMethod | None
    """How the adhesion is identified in a window; another value may be put here. None: by the bank."""
    counts: Mapping[Outcome, int] = NO_COUNTS
    events: tuple[Event, ...] = ()
    """What the sample that came last brought about, other than that samples were accepted."""
    inbox: Inbox = Inbox()
    """Samples that wait."""
    clock: Clock = Clock()
    """The receiver's."""
    zero: Zero = Zero()
    """Of the gauge that tells the brake pressure."""
    newest: Measurement | None = None
    """The newest measurement that was accepted."""
    belief: Gaussian | None = None
    """Of (s, v) at the newest accepted measurement, from the tracker."""
    window: MethodWindow | None = None
    """The present braking; None while coasting or while the speed is not known."""
    memory: Memory | None = None
    """The bank's, where that identifies the adhesion."""
    stepping: Stepping = Stepping()
    """Whether the positions have stepped, where the bank follows them."""
    odometer: Odometer = Odometer()
    """Whether the positions are an axle's, where wheels are heard beside them."""
    anew: Anew = Anew()
    """What the bank goes back to where something turns out to be wrong."""
    knowledge: Knowledge = Knowledge()
    outliers: int = 0
    """Outliers in a row."""
    since_estimate: int = 0
    """Measurements accepted since the last estimate."""
    seen: Estimate | None = None
    """The last estimate that positions have borne out."""
    repeated: Repeated[Sure] = Repeated(math.nan, 0, None)
    pace: Pace = Pace()
    standing: Standing = Standing()
    turning: Turning = Turning()
    unseen: int = 0
    """Measurements in a row of a position sensor that is stuck."""

    @property
    def outcome(self) -> Outcome:
        """What became of the sample that came last."""
        return self.events[-1].outcome if self.events else Outcome.ACCEPTED

    @property
    def stuck(self) -> bool:
        """Whether the position sensor repeats itself while the train moves."""
        return self.unseen > 0

    @property
    def followed_mps(self) -> float:
        """Speed that the train is believed to have, m/s; NaN where nothing is."""
        if self.memory is not None:
            return float(self.memory.bank.moments(2)[0][SPEED])
        return math.nan if self.belief is None else float(self.belief.mean[1])

    @property
    def sure(self) -> Sure | None:
        """What is known now."""
        return None if self.seen is None else Sure(self.seen, self.memory)

    def told(self, *events: Event) -> State:
        """The state after events, which are counted."""
        if not events:
            return self
        return self._replace(counts=counted(self.counts, *events), events=self.events + events)

    def forgotten(self) -> State:
        """All but counts, clock, gauge, what waits, and the number of windows, which keeps the random streams apart."""
        knowledge = Knowledge(windows=self.knowledge.windows)
        return State(*self[:8], knowledge=knowledge)
