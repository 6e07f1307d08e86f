# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Rims that surely roll, or stand, under the brake, however badly the train's speed is known: their course tells it.

What slides uses less than cylinders press with, and the rest slows wheels down far faster than a train: at a rotating
mass of a twentieth a hundredth of the weight by 2 m/s^2. What slides and slows down no faster is held by its
protection, which presses with less.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

S = 1_000_000_000

FEWEST, ALIKE = 3, 0.01
"""How many rims must be heard, and be as fast as the fastest, beside most of them; and by how much these may differ."""

LOST, WITHIN_NS, EVERY_NS = 0.3, 60 * S, 2 * S // 5
"""Part of their speed that they must have lost, as protection lets all slide at once by less before it acts, within
which time at most, and how often it is looked at."""

LEAST, MOST = 0.7, 1.1
"""Parts of what the cylinders ask for, by what is known of the brake, between which rims lose speed that roll: a brake
fades, or presses a heavier train; rims that are slowed down by more begin to slide."""

SILENT_NS = 2 * S
"""Rims that were silent for longer may have locked meanwhile: they are followed anew."""

FROM_MPS, TO_MPS, AGAIN = 5.0, 0.5, 2.0
"""The fastest rim of a train that stops is slowed down from here to there no faster than by the full brake. What is
faster than that again by such a factor has not stopped, or runs on."""


class Seen(NamedTuple):
    """The fastest rim at a time, and by how much the cylinders would have slowed the train since the brake's begin."""

    t_ns: int
    speed_mps: float
    asked_mps: float

    def slows_to(self, later: Seen) -> bool:
        """Whether it has slowed down until later as a train does of which the cylinders ask so much."""
        lost, asked = self.speed_mps - later.speed_mps, later.asked_mps - self.asked_mps
        return LEAST * asked < lost < MOST * asked


class Together(NamedTuple):
    """How rims have slowed down under the brake."""

    newest: Seen | None = None
    alike: tuple[Seen, ...] = ()
    """While most of them are as fast as the fastest."""
    above: Seen | None = None
    """When the fastest was last faster than `FROM_MPS`, ..."""
    below: Seen | None = None
    """... and since when it has not been faster than `TO_MPS`."""

    def after(self, rims: Sequence[float], t_ns: int, asked_mps2: float) -> Together:
        """Take in the speeds of the rims; what presses would slow the train down so if all rolled.

        They are followed anew where too few are heard, or were silent for long.
        """
        if len(rims) < FEWEST:
            return Together()
        if self.newest is not None and t_ns - self.newest.t_ns > SILENT_NS:
            return Together().after(rims, t_ns, asked_mps2)
        fastest, before = max(rims), self.newest
        asked = 0.0 if before is None else before.asked_mps + asked_mps2 * (t_ns - before.t_ns) / S
        now = Seen(t_ns, fastest, asked)
        above = self.above if self.below is None or fastest < AGAIN * TO_MPS else None
        above = now if fastest > FROM_MPS else above
        below = (self.below or now) if fastest <= TO_MPS else None
        alike, count = self.alike, sum(rim >= (1.0 - ALIKE) * fastest for rim in rims)
        if count < FEWEST or 2 * count <= len(rims):
            alike = ()
        elif not alike or t_ns - alike[-1].t_ns >= EVERY_NS:
            alike = (*(each for each in alike if t_ns - each.t_ns < WITHIN_NS), now)
            while len(alike) > 2 and fastest < (1.0 - LOST) * alike[1].speed_mps:
                alike = alike[1:]
        return Together(now, alike, above, below)

    @property
    def roll(self) -> bool:
        """Whether most of them have now slowed down as the cylinders ask for, in both halves of the time.

        In the mean of it rims may have that slid at once, and slow down less since.
        """
        if not self.alike or self.alike[-1] != self.newest:
            return False
        first, last = self.alike[0], self.alike[-1]
        middle = self.alike[len(self.alike) // 2]
        return last.speed_mps < (1.0 - LOST) * first.speed_mps and first.slows_to(middle) and middle.slows_to(last)

    def stand(self, full_mps2: float) -> bool:
        """Whether the train stands: all rims do, and have come down as it does, no faster than by the full brake."""
        if self.above is None or self.below is None:
            return False
        asked, lasted_s = self.below.asked_mps - self.above.asked_mps, (self.below.t_ns - self.above.t_ns) / S
        return min(asked / LEAST, full_mps2 * lasted_s) > self.above.speed_mps - TO_MPS
