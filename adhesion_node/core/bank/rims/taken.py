# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the wheels tell of the train's speed: unbraked they roll, under the brake the fastest mostly does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...intake.outcome import Event, Outcome
from ...intake.samples import Measurement, WheelSample
from ..free import runs_back
from ..gear.fastest import UNTOLD_NS
from ..gear.radii import LEARNING_MPS
from ..gear.wheels import MANY
from ..layout import MU, SPEED, Bank
from ..memory import Memory
from ..motion import SLOWED
from . import unbraked
from .braked import beside_fastest
from .rim import as_rolled, rim_speed
from .unbraked import SLOW_MPS

if TYPE_CHECKING:
    from ...config import Config

PULLED = 0.004
"""Traction over the train's weight, beyond what holds its speed on the level, from which driven axles may spin."""


def with_wheels(config: Config, memory: Memory, measurement: Measurement) -> Memory:
    """Take in what the wheels told since the measurement before: which axles slide, and how fast the train is."""
    back = runs_back(memory.bank)
    if not measurement.wheels or (back and not _all_stand(config, measurement.wheels[-1])):
        return memory
    fastest = memory.wheels.fastest
    pressed = memory.is_pressed(config) or memory.braked or memory.untold or fastest.fell(memory.t_ns, UNTOLD_NS)
    pressed = pressed or _is_slowed(config, memory)
    axles, wheels, newest = memory.axles, memory.wheels, measurement.wheels[-1]
    pulled = _is_pulled(config, memory.bank)
    wheels, drives = wheels._replace(pulled_ns=memory.t_ns) if pulled else wheels, pulled and not pressed
    rim, std = rim_speed(as_rolled(memory.bank, fastest.wander.rolled))
    runs = not pressed and rim - MANY * std > LEARNING_MPS
    for sample in measurement.wheels:
        rims = [abs(each) * config.train.wheel_radius_m for each in sample.speeds_radps]
        axles = axles.after(rims, sample.t_ns, memory.slowed_mps, runs)
        newest = sample.without(axles.lying(memory.slowed_mps))
        wheels = wheels.after(config, newest, rim, std, pressed, drives)
    rims = wheels.radii.rims(config, newest)
    known = rims if wheels.radii.is_learnt else []
    wheels = wheels.agreeing(known, (1.0 - config.sliding_creep) * rim - MANY * std, newest.t_ns)
    memory = _telling(memory._replace(axles=axles, wheels=wheels))
    if memory.braked:
        return beside_fastest(config, memory, known, newest.t_ns) if known else memory
    memory, rolls = unbraked.waiting(config, memory, rims, newest.t_ns, rim - MANY * std), unbraked.rolls(rims, drives)
    if rolls > LEARNING_MPS and drives and MANY * std < rim:
        return unbraked.spinning(memory, rolls, len(rims))
    if rolls > LEARNING_MPS:
        return unbraked.rolling(memory, rolls, pressed)
    dark = memory.asks and not measurement.has_position and rims
    return unbraked.slow(memory, max(rims) if pressed else rolls, back) if dark else memory


def _is_pulled(config: Config, bank: Bank) -> bool:
    """Whether traction does more than hold the speed on the level, so that driven axles may spin."""
    return -bank.mean_of(MU) > PULLED + float(config.train.specific_resistance(bank.mean_of(SPEED)))


def _all_stand(config: Config, sample: WheelSample) -> bool:
    """Whether no wheel that is heard turns: that says the same of a train that runs back."""
    rims = [each * config.train.wheel_radius_m for each in sample.known_radps]
    return bool(rims) and max(map(abs, rims)) < SLOW_MPS


def _is_slowed(config: Config, memory: Memory) -> bool:
    """Whether wheels may slide though no brake is applied: it still lets go, or another one slows the train down."""
    used = memory.bank.mean_of(MU)
    slowed = used > SLOWED and memory.braking.alone and not memory.wheels.agree(memory.t_ns)  # else it is a grade
    return slowed or (used > -SLOWED and memory.brake.lingers(config, memory.t_ns))


def _telling(memory: Memory) -> Memory:
    lying = memory.axles.lying(memory.slowed_mps)
    names = ", ".join(str(axle + 1) for axle in lying)
    return memory.leaving_out(Event(Outcome.STUCK, f"wheel_speed of axle {names}")) if lying else memory
