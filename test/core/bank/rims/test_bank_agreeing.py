# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.


"""Twelve wheels that all turn alike under the brake roll, however badly positions tell how fast the train is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from banks import FULL_PA, S

from adhesion_node.core.bank.following import followed, met
from adhesion_node.core.bank.gear.radii import Radii
from adhesion_node.core.bank.gear.wheels import AGREE_NS, WheelsSeen
from adhesion_node.core.bank.layout import SPEED
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import Measurement, WheelSample

CONFIG = Config(method="bank")
RAIL = Rail(0.05, 0.04, 0.02)
AXLES, NOISE, BRAKED = 12, 0.003, 200
"""Rims, their relative noise, and the tick of 0.1 s at which the full brake begins to act."""


def driven(seed: int, lost_mps: float) -> tuple[Memory, float]:
    """The train followed from 30 m/s on, for 6 s under the full brake, where no position comes.

    For 4 s from the begin of the brake on its speed is made to seem so much higher, and known to 0.8 m/s.
    """
    rng, speed, place = np.random.default_rng(seed), 30.0, 0.0
    memory: Memory | None = None
    for tick in range(BRAKED + 60):
        t_ns, applied = S + tick * S // 10, min(max(0.1 * (tick - BRAKED), 0.0), 1.0)
        rates = speed * (1.0 + NOISE * rng.standard_normal(AXLES)) / CONFIG.train.wheel_radius_m
        seen, variance = place + 0.1 * rng.standard_normal(), 1.0 if tick < BRAKED else math.inf
        wheels = (WheelSample(t_ns, tuple(rates.tolist())),)
        measured = Measurement(t_ns, seen, variance, FULL_PA * applied, wheels=wheels)
        memory = met(CONFIG, measured) if memory is None else followed(CONFIG, memory, measured, lambda: RAIL)
        if BRAKED <= tick <= BRAKED + 40:
            lost = memory.bank.with_fresh(SPEED, np.full(memory.bank.kind.size, speed + lost_mps), 0.8)
            memory = memory._replace(bank=lost)
        place, speed = place + 0.1 * speed, speed - 0.1 * 0.93 * applied
    assert memory is not None
    return memory, speed


@pytest.mark.parametrize("seed", range(4))
def test_a_speed_that_is_too_badly_known_to_tell_of_any_axle_is_that_of_wheels_which_agree(seed: int) -> None:
    """In a tunnel, 2 s behind: it was off by 0.6 m/s still, and known to 0.7 m/s."""
    memory, speed = driven(seed, 0.7)
    assert memory.bank.std_of(SPEED) < 0.25
    assert memory.bank.mean_of(SPEED) == pytest.approx(speed, abs=0.35)


@pytest.mark.parametrize(("noise", "spread", "agree"), [(0.0, 0.009, True), (0.0, 0.015, False), (1e-5, 0.015, True)])
def test_rims_agree_that_differ_by_no_more_than_their_noise(noise: float, spread: float, agree: bool) -> None:
    wheels, rims = WheelsSeen(Radii(noise=noise)), [20.0, *(20.0 * (1.0 - spread),) * (AXLES - 1)]
    for t_ns in (0, AGREE_NS):
        wheels = wheels.agreeing(rims, 15.0, t_ns)
    assert wheels.agree(AGREE_NS) is agree
