# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Rims under the brake: the train is no slower than the fastest, and mostly as fast."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..gear.slides import ROLLING, UNSURE
from ..gear.wander import Errors, Wander
from ..layout import RADIUS, SPEED, Bank
from ..memory import Memory, S
from ..motion import slowing
from ..seeing import fall_seen
from .rim import FASTEST_SHARE, FEW, as_fast, not_slower, rim_speed, rolled_of, slides_of
from .stopping import halting, standing, stands

if TYPE_CHECKING:
    from ...config import Config

LAGS, HELD = 0.01, 0.12
"""By how much the fastest rim may creep when axles begin to slide, at least and at most, relative: slide protection may
hold all of them at some creep, and none shows it. One that is farther behind slides, and comes back."""

HIDDEN = 1e-6
"""Density of what the fastest rim shows where it slides, times its error, while every axle is seen to roll: all of them
hardly slide alike, but a brake may change that no gauge shows."""

TRUSTED_NS = 450_000_000
"""How often the fastest rim is taken for the train's speed, as its errors last."""


def beside_fastest(config: Config, memory: Memory, rims: list[float], t_ns: int) -> Memory:
    """Take in under the brake how fast the fastest rim was at a time, from which on it has slowed as the train has."""
    bank = memory.bank
    rim_mps = memory.wheels.radii.fastest(rims) - slowing(config, bank, memory.braking) * (memory.t_ns - t_ns) / S
    memory = halting(config, memory, rims, t_ns)
    if stands(config, memory):
        return standing(memory)
    if rim_mps <= config.slowest_mps:
        return memory
    bank, wheels = not_slower(bank, rim_mps, FASTEST_SHARE * rim_mps), memory.wheels
    fastest = wheels.fastest.after(rim_mps, wheels.radii.noise, memory.t_ns)
    if fastest.fall_mps2 > wheels.fastest.fall_mps2:
        bank = fall_seen(config, bank.normalised(), memory.braking, fastest.fall_mps2)
    if memory.t_ns >= fastest.trusted_ns:
        wander, errors = fastest.wander.after(memory.t_ns, rim_mps), Errors()
        if memory.braking.told > 0.0:
            bank, wander, errors = _creeping(bank, wander, rim_mps)
        roll = memory.braking.told < 0.0 or (_tells_of_none(config, memory) and wheels.all_roll(t_ns))
        slides = HIDDEN if roll and len(rims) >= FEW else slides_of(len(rims))
        bank = as_fast(bank, rim_mps, errors.quick * rim_mps, slides)
        fastest = fastest._replace(trusted_ns=memory.t_ns + TRUSTED_NS, wander=wander)
    return memory._replace(wheels=wheels._replace(fastest=fastest), bank=bank.normalised())


def _tells_of_none(config: Config, memory: Memory) -> bool:
    """Whether the speed is known too badly to tell of any axle whether it slides: such as do would differ."""
    mean, std = memory.bank.mean_of(SPEED), memory.bank.std_of(SPEED)
    return memory.braking.told == 0.0 and UNSURE * std > ROLLING * config.sliding_creep * mean


def _creeping(bank: Bank, wander: Wander, rim_mps: float) -> tuple[Bank, Wander, Errors]:
    """Axles slide, so the fastest rim may creep: it is as if all radii were others, by what wanders, and how it errs.

    At first it may creep by all that it is behind.
    """
    errors, covariance = wander.errors(bank.mean_of(RADIUS)), bank.covariance.copy()
    variance, behind = errors.lasting * TRUSTED_NS / S, 1.0 - rim_mps / max(rim_speed(bank)[0], rim_mps)
    if wander.rolled is None and behind < HELD:
        wander = wander._replace(rolled=rolled_of(bank))
        variance = LAGS**2 + behind**2
    covariance[:, RADIUS, RADIUS] += variance
    return bank._replace(covariance=covariance), wander, errors
