# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Rims while no brake is applied: they roll, but for such as may slide still, or spin as the train is pulled."""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING

from ..gear.fastest import UNISON_S
from ..gear.radii import UNEQUAL
from ..layout import RADIUS
from ..memory import Memory, S
from ..seeing import considered
from . import rim
from .rim import FASTEST_SHARE, ROLLING_SHARE, as_fast, as_rolled, not_slower, slides_of

if TYPE_CHECKING:
    from ...config import Config

SLOW_MPS = 0.5
"""Error of a rim that turns slowly or stands, as sensors tell little of it."""

TURNS = 0.5
"""Share of the middle rim's speed from which an axle turns with the others, and is not dead."""


def waiting(config: Config, memory: Memory, rims: list[float], t_ns: int, least_mps: float) -> Memory:
    """No braking is open: the fastest rim will not be believed before all might have slid, radii are what they were.

    A spin that ends leaves rims as fast as the train, by what is known of it `least_mps`; a slide that begins does not.
    """
    wheels, trusted_ns = memory.wheels, memory.t_ns + round((config.brake_build_up_s + UNISON_S) * S)
    fastest, radii = wheels.fastest, wheels.radii
    if rims and radii.is_learnt and (median(rims) < least_mps or not wheels.may_spin(t_ns)):
        fastest = fastest.after(median(rims), radii.noise, t_ns)
    bank = as_rolled(memory.bank, wheels.fastest.wander.rolled)
    return memory._replace(bank=bank, wheels=wheels._replace(fastest=fastest.waiting(trusted_ns)))


def rolls(rims: list[float], pulled: bool) -> float:
    """Speed of a rim while no brake is applied: the middle one, as some may be dead; NaN: none is heard.

    While a train is `pulled` driven axles may spin, half of all or more: the slowest that turns with the others, but
    none that is slower than all of them, as it may drag, or lose pulses. Such as count backwards tell nothing.
    """
    middle = median(rims) if rims else math.nan
    if not (pulled and middle > 0.0):
        return middle
    slowest, *others = sorted(rim for rim in rims if rim >= TURNS * middle)
    return others[0] if len(others) > 1 and slowest < (1.0 - UNEQUAL) * others[0] else slowest


def rolling(memory: Memory, rim_mps: float, pressed: bool) -> Memory:
    """Take in how fast a rim is that rolls; where it may slide, the train is not slower than that.

    While nothing is learnt of them it may lie between such as turn and such as are dead.
    """
    if not memory.wheels.radii.is_learnt:
        return memory
    bank = memory.bank
    bank = not_slower(bank, rim_mps, FASTEST_SHARE * rim_mps) if pressed else rim.rolling(bank, rim_mps)
    return memory._replace(bank=bank.normalised(), fixes=memory.fixes + 1)


def spinning(memory: Memory, rim_mps: float, count: int) -> Memory:
    """Take in how fast the slowest of so many rims is while the train is pulled: as the train, or it spins, too.

    Of radii that tells nothing.
    """
    if not memory.wheels.radii.is_learnt:
        return memory
    bank = as_fast(memory.bank, rim_mps, ROLLING_SHARE * rim_mps, slides_of(count)).normalised()
    return memory._replace(bank=considered(memory.bank, bank, RADIUS), fixes=memory.fixes + 1)


def slow(memory: Memory, rim_mps: float, back: bool) -> Memory:
    """Take in how slow a rim is: as the train, or it is locked, or dead. Unless it runs back the train is no slower.

    Of radii that tells nothing.
    """
    bank = memory.bank if back else not_slower(memory.bank, rim_mps, SLOW_MPS)
    return memory._replace(bank=considered(memory.bank, as_fast(bank, rim_mps, SLOW_MPS).normalised(), RADIUS))
