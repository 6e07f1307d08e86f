# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Something turns out to be wrong under the brake: the train is followed anew without it, from before the brake acted.

It is an accelerometer that lies, or positions that are an axle's, beside which wheels tell how fast the train is. The
one may turn out behind the other, or only as the train is followed anew without the other.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..belief.rail import Rail
from ..intake.samples import Measurement
from .following import followed
from .layout import RADIUS, SIZE, SPEED, Bank
from .memory import Memory
from .sensors.odometer import SCALE

if TYPE_CHECKING:
    from ..config import Config

FEWEST = 2
"""Wheels that lead: of a single one nothing tells whether it slides."""

MOST = 500
"""Measurements that are held; where a braking lasts longer, it is gone back no farther than to behind them."""


class Anew(NamedTuple):
    """What to go back to while a braking is open."""

    before: Memory | None = None
    """What was believed before the brake acted, without what has turned out to be wrong since, ..."""
    known: Rail = Rail(0.0, 1.0, 0.0)
    """... the rail as it was known when the braking began, ..."""
    since: tuple[Measurement, ...] = ()
    """... and what was measured since."""

    def after(
        self, config: Config, before: Memory, memory: Memory, measurement: Measurement, axles_own: bool
    ) -> tuple[Memory, Anew]:
        """The train followed up to a measurement, anew where something turns out to be wrong.

        `axles_own` is whether positions are known to be those of an axle.
        """
        return self._with(before, memory, measurement)._followed(config, memory, axles_own)

    def _with(self, before: Memory, memory: Memory, measurement: Measurement) -> Anew:
        """With a measurement; from here on where the brake begins to act, or what is held would become too much."""
        if not memory.braked and (before.misled or not memory.misled):
            return Anew()
        opens = memory.braked and not before.braked
        if not opens and self.before is not None and len(self.since) < MOST:
            return self._replace(since=(*self.since, measurement))
        unproved = bool(measurement.imu) and before.pointing.forward is None
        return Anew(before, memory.known, (measurement,)) if unproved or _leads(before) else Anew()

    def _followed(self, config: Config, memory: Memory, axles_own: bool) -> tuple[Memory, Anew]:
        before = self.before
        begun = before and (unfelt(before, memory) or by_wheels(before, memory, axles_own))
        if begun is None:
            return memory, self
        again = begun
        for each in self.since:
            heard = each._replace(variance_m2=math.inf) if begun.aside else each
            again = followed(config, again, heard, lambda: self.known)
        told = again._replace(changes=max(again.changes, memory.changes))  # no fewer than were told already
        return self._replace(before=begun)._followed(config, told, axles_own)


def unfelt(before: Memory, memory: Memory) -> Memory | None:
    """With what to begin where the first braking that proves an accelerometer shows that it lies: it is left out."""
    lies = memory.pointing.forward is False and before.pointing.forward is None
    return before._replace(pointing=memory.pointing) if lies else None


def by_wheels(before: Memory, memory: Memory, axles_own: bool) -> Memory | None:
    """With what to begin where positions turn out to be an axle's, or a sliding wheel's: they are left out.

    Wheels must be learnt, and so many that some roll. What the accelerometer has shown by now stays known.
    """
    if before.aside or not (axles_own or memory.misled) or not _leads(before):
        return None
    course = before.course.forgotten()
    return before._replace(bank=unscaled(before.bank), pointing=memory.pointing, course=course, aside=True)


def _leads(before: Memory) -> bool:
    """Whether wheels may tell how fast the train is."""
    return before.wheels.radii.is_learnt and len(before.wheels.radii.own) >= FEWEST


def unscaled(bank: Bank) -> Bank:
    """Where the speed was an odometer's: it is off by as much as radii, which were learnt beside, the other way."""
    off = np.zeros((bank.kind.size, SIZE))
    off[:, SPEED], off[:, RADIUS] = bank.mean[:, SPEED], -(1.0 + bank.mean[:, RADIUS])
    return bank._replace(covariance=bank.covariance + SCALE**2 * off[:, :, None] * off[:, None, :])
