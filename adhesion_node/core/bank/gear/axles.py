# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Which axles' speeds are believed: not of one that stands while the train runs, nor one that repeats itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ...intake.standing import Standing
from .repeating import BY_CHANCE, Repeating

FASTEST_FALL_MPS2 = 100.0
"""No brake stops a wheel faster, at the rim."""

ROLLS = 0.006
"""Error of a rim's speed under the brake where it rolls, relative."""


class Axles(NamedTuple):
    """What the sensors of the axles have shown."""

    repeating: tuple[Repeating, ...] = ()
    standing: tuple[Standing, ...] = ()

    def after(self, rims_mps: Sequence[float], t_ns: int, slowed_mps: float, runs: bool) -> Axles:
        """Note the speeds of the rims; NaN: not known.

        `slowed_mps` is by how much the train has slowed under the brake in all; a train that `runs` has no brake
        applied, and every wheel turns.
        """
        count = len(rims_mps)
        before = self if len(self.standing) == count else Axles((Repeating(),) * count, (Standing(),) * count)
        repeating = (one.after(rim, slowed_mps) for one, rim in zip(before.repeating, rims_mps, strict=True))
        standing = (
            one.after(t_ns, rim, one.fallen_mps(t_ns, FASTEST_FALL_MPS2), runs)
            for one, rim in zip(before.standing, rims_mps, strict=True)
        )
        return Axles(tuple(repeating), tuple(standing))

    def hanging(self, slowed_mps: float) -> tuple[int, ...]:
        """Those that are not believed, and such as have come again so often that they may not be soon."""
        again = (axle for axle, one in enumerate(self.repeating) if one.again > BY_CHANCE)
        return tuple(sorted({*again, *self.lying(slowed_mps)}))

    def lying(self, slowed_mps: float) -> tuple[int, ...]:
        """Those that are not believed, counted from 0."""
        both = enumerate(zip(self.repeating, self.standing, strict=True))
        return tuple(
            axle
            for axle, (one, stands) in both
            if stands.silent or one.is_stuck(slowed_mps, (ROLLS * one.speed_mps) ** 2)
        )
