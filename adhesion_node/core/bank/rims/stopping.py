# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A train that its wheels show to stop under the brake, however badly its speed is known."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...physics.train import GRAVITY
from ..layout import RADIUS
from ..memory import Memory, S
from ..motion import resistance, rolling_use
from ..seeing import corrected, speed_seen

if TYPE_CHECKING:
    from ...config import Config

LOCKED_MPS = 1.0
"""Error of a standstill that wheels show under the brake: below some 2 m/s slide protection lets them lock."""

DARK_NS = 3 * S
"""So long behind the last position, or measured speed, wheels alone may tell that the train stands: those that seem to
stop it while it says otherwise lock."""


def halting(config: Config, memory: Memory, rims: list[float], t_ns: int) -> Memory:
    """Note how fast the rims were at a time under the brake."""
    fastest = memory.wheels.fastest
    fastest = fastest._replace(halting=fastest.halting.after(rims, t_ns, _asked(config, memory)))
    return memory._replace(wheels=memory.wheels._replace(fastest=fastest))


def stands(config: Config, memory: Memory) -> bool:
    """Whether wheels show that the train stands, and neither a position nor a speed that is no axle's is heard."""
    speeds = memory.speeds.quick.before if config.speed_source != "axle" else ()
    dark_ns = memory.t_ns - max([memory.placed_ns, *(t_ns for t_ns, _ in speeds)])
    return dark_ns > DARK_NS and memory.wheels.fastest.halting.stands(GRAVITY * config.train.full_brake)


def _asked(config: Config, memory: Memory) -> float:
    """By how much the pressure of the cylinders slows the train down if all axles roll, m/s^2.

    Where they are let go of that is less than what is demanded; 0: none is measured, so that nobody knows.
    """
    bank, brake = memory.bank, memory.brake
    if config.pressure_kind == "demanded" or not brake.gauged:
        return 0.0
    braking = memory.braking._replace(applied=config.train.specific_brake(min(brake.applied_pa, brake.pressure_pa)))
    return GRAVITY * float(bank.weight @ (rolling_use(config, bank, braking) + resistance(config, bank)))


def standing(memory: Memory) -> Memory:
    """Take in, twice a second, that the train stands: its brake is pressed still."""
    if not memory.asks:
        return memory
    seen = speed_seen(memory.bank, 0.0, LOCKED_MPS**2, RADIUS)
    return memory._replace(bank=corrected(memory.bank, seen).normalised())
