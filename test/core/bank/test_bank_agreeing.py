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
from adhesion_node.core.bank.gear.wheels import AGREE_NS, WheelsSeen
from adhesion_node.core.bank.layout import SPEED
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import Measurement, WheelSample
from adhesion_node.core.physics.train import Array

CONFIG = Config(method="bank")
RAIL = Rail(0.05, 0.04, 0.02)
AXLES, NOISE, BRAKED = 12, 0.003, 200
"""Rims, their relative noise, and the tick of 0.1 s at which the full brake begins to act."""


def told(memory: Memory, speed: float) -> tuple[float, float]:
    """By how much the speed is off, m/s, and its standard deviation."""
    return memory.bank.mean_of(SPEED) - speed, memory.bank.std_of(SPEED)


def driven(seed: int, errors: Array, std_m: float = 1.0, lost_mps: float = 0.0) -> tuple[Memory, float]:
    """The train followed from 30 m/s on, while positions have such errors, in m; NaN: none comes.

    For 4 s from the begin of the brake on its speed is made to seem so much higher, and known to 0.8 m/s, where that
    is more than 0.
    """
    rng, speed, place = np.random.default_rng(seed), 30.0, 0.0
    memory: Memory | None = None
    for tick, error in enumerate(errors.tolist()):
        t_ns, applied = S + tick * S // 10, min(max(0.1 * (tick - BRAKED), 0.0), 1.0)
        rates = speed * (1.0 + NOISE * rng.standard_normal(AXLES)) / CONFIG.train.wheel_radius_m
        variance = math.inf if math.isnan(error) else std_m**2
        place_seen = place + (0.0 if math.isnan(error) else error) + 0.1 * rng.standard_normal()
        measured = Measurement(
            t_ns, place_seen, variance, FULL_PA * applied, wheels=(WheelSample(t_ns, tuple(rates.tolist())),)
        )
        memory = met(CONFIG, measured) if memory is None else followed(CONFIG, memory, measured, lambda: RAIL)
        if lost_mps > 0.0 and BRAKED <= tick <= BRAKED + 40:
            lost = memory.bank.with_fresh(SPEED, np.full(memory.bank.kind.size, speed + lost_mps), 0.8)
            memory = memory._replace(bank=lost)
        place, speed = place + 0.1 * speed, speed - 0.1 * 0.93 * applied
    assert memory is not None
    return memory, speed


@pytest.mark.parametrize("seed", range(4))
def test_a_speed_that_is_too_badly_known_to_tell_of_any_axle_is_that_of_wheels_which_agree(seed: int) -> None:
    """In a tunnel, 2 s behind: it was off by 0.6 m/s still, and known to 0.7 m/s."""
    memory, speed = driven(seed, np.where(np.arange(BRAKED + 60) < BRAKED, 0.0, math.nan), lost_mps=0.7)
    off, std = told(memory, speed)
    assert std < 0.25
    assert abs(off) < 0.35


@pytest.mark.parametrize("seed", [5, 9])
def test_positions_that_are_given_up_leave_the_speed_to_wheels_that_agree(seed: int) -> None:
    """They err by 2 m within 2 s, as those of a wheel that slides may; the speed told ran away by 2 m/s and more."""
    rng, errors = np.random.default_rng(100 + seed), [0.0]
    for _ in range(BRAKED + 99):
        errors.append(0.95 * errors[-1] + 2.0 * math.sqrt(1.0 - 0.95**2) * rng.standard_normal())
    memory, speed = driven(seed, np.array(errors), 2.0)
    assert abs(told(memory, speed)[0]) < 0.5


@pytest.mark.parametrize(("noise", "spread", "agree"), [(0.0, 0.009, True), (0.0, 0.015, False), (1e-5, 0.015, True)])
def test_rims_agree_that_differ_by_no_more_than_their_noise(noise: float, spread: float, agree: bool) -> None:
    wheels, rims = WheelsSeen(noise=noise), [20.0, *(20.0 * (1.0 - spread),) * (AXLES - 1)]
    for t_ns in (0, AGREE_NS):
        wheels = wheels.agreeing(rims, 15.0, t_ns)
    assert wheels.agree(AGREE_NS) is agree
