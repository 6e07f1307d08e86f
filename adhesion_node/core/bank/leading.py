# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Positions that turn out to be an axle's: the train is followed anew by its wheels, from before the brake acted."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..belief.rail import Rail
from ..intake.samples import Measurement
from .following import followed
from .gear.wheels import FEWEST
from .layout import RADIUS, SIZE, SPEED, Bank
from .memory import Memory
from .sensors.odometer import SCALE, Odometer
from .sensors.plausible import Course

if TYPE_CHECKING:
    from ..config import Config

MOST = 500
"""Measurements after which it is too late to go back."""


class Leading(NamedTuple):
    """What was believed before the brake acted, and what was measured since, while positions lead."""

    odometer: Odometer = Odometer()
    before: Memory | None = None
    known: Rail = Rail(0.0, 1.0, 0.0)
    """The rail as it was known when the braking began."""
    since: tuple[Measurement, ...] = ()

    def heard(self, config: Config, memory: Memory, measurement: Measurement) -> Leading:
        """Hold a measurement, whether it is believed or not, against the wheels that do not seem to hang."""
        hanging = memory.axles.hanging(memory.slowed_mps)
        turning = tuple(sample.without(hanging) for sample in measurement.wheels)
        heard = measurement._replace(wheels=turning) if hanging else measurement
        return self._replace(odometer=self.odometer.after(config, memory.wheels, heard, memory.braked))

    def after(self, config: Config, before: Memory, memory: Memory, measurement: Measurement) -> tuple[Memory, Leading]:
        """The train followed up to a measurement, and anew by its wheels where positions turn out to be an axle's."""
        leading = self._with(before, memory, measurement)
        if leading.before is None or not (memory.misled or self.odometer.is_found):
            return memory, leading
        again = leading.before._replace(
            bank=unscaled(leading.before.bank),
            pointing=memory.pointing,
            course=Course(wandering=leading.before.course.wandering.unseen()),
            aside=True,
        )
        for each in leading.since:
            again = followed(config, again, each._replace(variance_m2=math.inf), lambda: leading.known)
        told = again._replace(changes=max(again.changes, memory.changes))  # no fewer than were told already
        return told, leading._replace(before=None, since=())

    def _with(self, before: Memory, memory: Memory, measurement: Measurement) -> Leading:
        """With a measurement; there is nothing to go back to without wheels, nor late in a braking."""
        opens = memory.braked and not before.braked
        led = not (memory.aside or before.misled) and (memory.braked or memory.misled)
        wheels = before.wheels
        if not led or not wheels.is_learnt or len(wheels.radius) < FEWEST or len(self.since) >= MOST:
            return self._replace(before=None, since=())
        if opens:
            return self._replace(before=before, known=memory.known, since=(measurement,))
        return self if self.before is None else self._replace(since=(*self.since, measurement))


def unscaled(bank: Bank) -> Bank:
    """Where the speed was an odometer's: it is off by as much as radii, which were learnt beside, the other way."""
    off = np.zeros((bank.kind.size, SIZE))
    off[:, SPEED], off[:, RADIUS] = bank.mean[:, SPEED], -(1.0 + bank.mean[:, RADIUS])
    return bank._replace(covariance=bank.covariance + SCALE**2 * off[:, :, None] * off[:, None, :])
