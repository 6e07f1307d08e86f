# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.


"""Rims that show under the brake that the train stands, however badly its speed is known: their course tells it.

What slides uses less than cylinders press with, and the rest slows wheels down far faster than a train: at a rotating
mass of a twentieth a hundredth of the weight by 2 m/s^2. What slides and slows down no faster is held by its
protection, which presses with less.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

S = 1_000_000_000

FEWEST, LEAST = 3, 0.7
"""How many rims must be heard, and what part of what the cylinders ask for a train that stops loses at least: a brake
fades, or presses a heavier train."""

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


class Halting(NamedTuple):
    """How the fastest rim has come down under the brake."""

    newest: Seen | None = None
    above: Seen | None = None
    """When it was last faster than `FROM_MPS`, ..."""
    below: Seen | None = None
    """... and since when it has not been faster than `TO_MPS`."""

    def after(self, rims: Sequence[float], t_ns: int, asked_mps2: float) -> Halting:
        """Take in the speeds of the rims; what presses would slow the train down so if all rolled.

        They are followed anew where too few are heard, or were silent for long.
        """
        if len(rims) < FEWEST:
            return Halting()
        if self.newest is not None and t_ns - self.newest.t_ns > SILENT_NS:
            return Halting().after(rims, t_ns, asked_mps2)
        fastest, before = max(rims), self.newest
        asked = 0.0 if before is None else before.asked_mps + asked_mps2 * (t_ns - before.t_ns) / S
        now = Seen(t_ns, fastest, asked)
        above = self.above if self.below is None or fastest < AGAIN * TO_MPS else None
        return Halting(now, now if fastest > FROM_MPS else above, (self.below or now) if fastest <= TO_MPS else None)

    def stands(self, full_mps2: float) -> bool:
        """Whether the train stands: all rims do, and have come down as it does, no faster than by the full brake."""
        if self.above is None or self.below is None:
            return False
        asked, lasted_s = self.below.asked_mps - self.above.asked_mps, (self.below.t_ns - self.above.t_ns) / S
        return min(asked / LEAST, full_mps2 * lasted_s) > self.above.speed_mps - TO_MPS
