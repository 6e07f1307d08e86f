# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A train whose positions are those of a wheel that slides: it is followed without them until the brake is released."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..intake.samples import MAX_VARIANCE_M2
from .free import by_noise, closed
from .labels.kinds import STEADY
from .layout import MU, POSITION, ROUGH, SPEED, Bank
from .memory import Memory, steps

if TYPE_CHECKING:
    from ..config import Config

REACH = 2.5
"""Standard deviations to either end of what a brake may do: it gives nothing, or all that is demanded."""

STANDS_MPS = 0.1
"""A brake drives no train backwards: one that is foreseen to be slower stands."""

LEAST_STD = 1e-3
"""What a brake does is known no better, over g."""


def misled(config: Config, memory: Memory) -> Memory:
    """The positions were those of a sliding wheel: go back to before, and on without them, whatever the brake does."""
    t_ns, bank = memory.past[0] if memory.past else (memory.t_ns, memory.bank)
    half, bank = 0.5 * config.train.specific_brake(memory.brake.demanded_pa), by_noise(bank)
    bank = bank._replace(kind=np.full_like(bank.kind, STEADY)).with_fresh(ROUGH, 0.0, 0.0)
    ahead = memory._replace(bank=bank.with_fresh(MU, half, half / REACH), t_ns=t_ns, seen=0, past=())
    for until_ns in steps(t_ns, memory.t_ns):
        ahead = ahead._replace(bank=forwards(ahead.bank_at(config, until_ns)), t_ns=until_ns)
    return ahead._replace(misled=True, since_s=0.0)


def led_again(memory: Memory) -> Memory:
    """The brake is released, no wheel slides any more: positions count again, wherever they say that the train is."""
    bank = closed(memory.bank)
    bank = bank.with_fresh(POSITION, bank.mean[:, POSITION], math.sqrt(MAX_VARIANCE_M2))
    return memory._replace(bank=bank, misled=False, aside=False, course=memory.course.forgotten())


def forwards(bank: Bank) -> Bank:
    """With no speed below a standstill, and no brake that drives the train on, as wheels that roll again make it seem.

    Where either is foreseen the train stands, or nothing slows it; what it may be beyond stays as it was.
    """
    mean, covariance = bank.mean.copy(), bank.covariance.copy()
    for part, floor, least_std in ((SPEED, STANDS_MPS, STANDS_MPS), (MU, 0.0, LEAST_STD)):
        std, below = np.sqrt(covariance[:, part, part]), np.maximum(floor - mean[:, part], 0.0)
        narrower = np.maximum(1.0 - below / (REACH * np.maximum(std, least_std)), 0.0)
        mean[:, part] += below
        covariance[:, part, :] *= narrower[:, None]
        covariance[:, :, part] *= narrower[:, None]
    return bank._replace(mean=mean, covariance=covariance)
