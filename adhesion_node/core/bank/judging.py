# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""When a braking opens and closes, what has changed since, and whether the positions can be believed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..belief.rail import Rail
from .blind import forwards, led_again, misled
from .branching import branched, opened, pruned
from .free import closed, held, mixed
from .kernels import weighing
from .labels.kinds import HELD, OTHER, PASSING, SLIDES
from .layout import MU, ROUGH, SPEED, Bank
from .memory import Memory, S
from .motion import SLOWED, Braking, resistance, use
from .seeing import wheels_seen

if TYPE_CHECKING:
    from ..config import Config

PAST_NS = 4 * S
"""How far back it can go."""

DOUBTED, PASSED, CERTAIN, CHANGED = 0.1, 0.5, 0.99, 0.2
"""Probabilities from which a change of the rail is in doubt, up to which it still goes on, and from which it is told,
and by how much it must have changed."""

SURELY = 2.0
"""Standard deviations of what is used that leave no doubt: of a change, else it is waited, or of a brake at work."""

SETTLING_S = 6.0
"""For so long, and the brake's build-up, behind its opening a braking tells no change."""

SLID = 0.9
"""Probability from which axles slid."""

LIKELY = 0.5
"""Probability of another brake from which a braking goes on that no gauge shows any more."""

FORGOTTEN = 0.002
"""Least probability of a hypothesis while no brake is applied: sensors change."""


def judged(config: Config, memory: Memory, rail: Callable[[], Rail]) -> Memory:
    """Open or close a braking, ask what has changed, weigh what wheels and slide protection tell."""
    bank, now_s = memory.bank, memory.t_ns / S
    pressed = memory.is_pressed(config)
    if memory.misled or (memory.aside and not (pressed or memory.braked)):
        return memory._replace(bank=forwards(bank)) if pressed else led_again(memory)
    before = memory.braked
    braked = (pressed or (before and _goes_on(memory))) and bank.mean_of(SPEED) >= config.slowest_mps
    if braked and not before:
        known = rail()
        told_s = now_s + SETTLING_S + config.brake_build_up_s
        bank = opened(config, bank, known, memory.braking.alone)
        return memory._replace(bank=bank, since_s=0.0, seen=1, told_s=told_s, known=known)
    if before and not braked:
        return memory._replace(bank=closed(bank), seen=0)
    if not before:
        return _coasted(memory._replace(bank=held(bank)) if pressed else memory)
    if memory.asks:
        errors = memory.declared_m, memory.coarse.std_m, memory.is_rolled
        if memory.course.is_impossible(config, bank, *errors, memory.braking.applied):
            return misled(config, memory)
        if memory.braking.told:
            bank = wheels_seen(config, bank, memory.braking, memory.since_s).normalised()
        bank = branched(config, bank, memory.braking, now_s, memory.since_s)
        kept = tuple(each for each in memory.past if memory.t_ns - each[0] <= PAST_NS)
        memory = memory._replace(since_s=0.0, past=(*kept, (memory.t_ns, bank)))
    return _with_changes(config, memory, pruned(bank))


def _goes_on(memory: Memory) -> bool:
    """Whether another brake is likely to slow the train, now that the gauge shows none any more."""
    if not memory.braking.alone:
        return False
    bank = memory.bank
    least = bank.mean[:, MU] - SURELY * np.sqrt(bank.covariance[:, MU, MU])
    return float(bank.weight @ ((bank.kind == OTHER) & (least > SLOWED))) > LIKELY


def _coasted(memory: Memory) -> Memory:
    """No brake is applied: nothing is forgotten, and twice a second it is asked whether traction is steady."""
    memory = memory._replace(bank=memory.bank.normalised(math.log(FORGOTTEN)))
    if not memory.asks:
        return memory
    course = memory.course.rolled(memory.bank.mean_of(SPEED)) if memory.course.recent else memory.course
    return memory._replace(bank=mixed(memory.bank, memory.since_s), since_s=0.0, course=course)


def _with_changes(config: Config, memory: Memory, bank: Bank) -> Memory:
    """Tell a change of the rail once it is certain and passed, and the adhesion used another than before any doubt.

    While that may be or not be, by `SURELY`, it is waited. That axles roll, where they slid before, is one, too. While
    the brake may still build up, or the border of the last one lies under the train, none is told.
    """
    now_s, held, seen = memory.t_ns / S, HELD if memory.slid else PASSING, memory.seen + 1
    changed, passing, sliding = weighing.changing(
        bank.log_weight, bank.changed_s, bank.kind, SLIDES, memory.told_s + 1e-6, PASSING, held
    )
    settling = now_s < memory.told_s
    if not settling and (DOUBTED <= changed < CERTAIN or passing > PASSED):
        return memory._replace(bank=bank, seen=seen)
    steady, slid = (bank, memory.braking), sliding > SLID
    if settling or changed < DOUBTED:
        return memory._replace(bank=bank, seen=seen, steady=steady, slid=slid)
    (used, std), before = _used(config, *steady), 0.0 if memory.steady is None else _used(config, *memory.steady)[0]
    by, least = abs(used - before), CHANGED * before
    if SURELY * std > max(by, least):
        return memory._replace(bank=bank, seen=seen)
    changes = memory.changes + (by > least)
    passed_s = now_s + config.train.length_m / max(bank.mean_of(SPEED), config.slowest_mps)
    return memory._replace(bank=bank, seen=seen, told_s=passed_s, changes=changes, steady=steady, slid=slid)


def _used(config: Config, bank: Bank, braking: Braking) -> tuple[float, float]:
    """Mean and standard deviation of the adhesion that is used, but for roughness and swing, over all hypotheses."""
    used, weight = use(config, bank, braking, resistance(config, bank)), bank.weight
    smooth = used.value - used.slope[:, ROUGH] * bank.mean[:, ROUGH]
    mean = float(weight @ smooth)
    return mean, math.sqrt(float(weight @ (np.square(smooth - mean) + np.square(used.std(config, bank)))))
