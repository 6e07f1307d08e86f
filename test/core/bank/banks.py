# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Banks made by hand, and a simulated train: what the tests of the bank share."""

from __future__ import annotations

import numpy as np
from oracles import specific_resistance
from scipy.signal import lfilter

from adhesion_node.core.bank.findings.ahead import Ahead
from adhesion_node.core.bank.gear.brake import BrakeSeen
from adhesion_node.core.bank.labels.kinds import KINDS
from adhesion_node.core.bank.layout import (
    BIAS,
    BRAKE,
    GRADE,
    MU,
    OFFSET,
    PITCH,
    POSITION,
    RADIUS,
    ROUGH,
    SCALE,
    SIZE,
    SPEED,
    Bank,
)
from adhesion_node.core.bank.memory import Memory
from adhesion_node.core.bank.motion import Braking
from adhesion_node.core.belief.rail import Rail
from adhesion_node.core.config import Config
from adhesion_node.core.intake.samples import Measurement, PressureSample
from adhesion_node.core.physics.train import CRH3, Array

CONFIG = Config(
    method="bank",
    law_probability=0.9,
    grade_std=0.0,
    mass_std=0.0,
    brake_std=0.0,
    rotating_mass_std=0.0,
)
"""A train and a track that are known well, whatever the defaults are."""

S = 1_000_000_000
FULL_PA = 410e3
FULL = 500_183 / (536e3 * 9.8)
"""B/(M g) of the full brake (model.md)."""

SMOOTH = [kind.name for kind in KINDS].index("smooth")
SPEEDS = np.linspace(0.0, 60.0, 13)
NOTHING = Rail(0.05, 0.04, 0.02)
"""What is known of any rail."""

MEAN = {POSITION: 500.0, SPEED: 40.0, MU: 0.05, ROUGH: 0.02, BRAKE: 1.03, GRADE: 0.002}
MEAN |= {OFFSET: 1.5, BIAS: 0.001, PITCH: 0.08, SCALE: 0.004, RADIUS: -0.01}
STD = {POSITION: 2.0, SPEED: 0.4, MU: 0.01, ROUGH: 0.05, BRAKE: 0.05, GRADE: 0.003}
STD |= {OFFSET: 1.0, BIAS: 0.003, PITCH: 0.05, SCALE: 0.005, RADIUS: 0.006}


def bank_of(
    kinds: list[int], laws: list[int] | None = None, noises: list[int] | None = None, seed: int = 0, spread: float = 0.3
) -> Bank:
    """Hypotheses of these labels about one mean, with full covariances and unequal weights."""
    rng, count = np.random.default_rng(seed), len(kinds)
    std = np.array([STD[each] for each in range(SIZE)])
    mean = np.array([MEAN[each] for each in range(SIZE)]) + spread * std * rng.standard_normal((count, SIZE))
    root = rng.standard_normal((count, SIZE, SIZE)) / np.sqrt(SIZE)
    shape = root @ root.transpose(0, 2, 1) + 0.2 * np.eye(SIZE)
    bank = Bank(
        mean,
        std[:, None] * shape * std,
        rng.uniform(-3.0, 0.0, count),
        np.array(noises or [0] * count, dtype=np.intp),
        np.array(laws or [0] * count, dtype=np.intp),
        np.array(kinds, dtype=np.intp),
        np.zeros(count),
        np.zeros(count),
    )
    return bank.normalised()


def ahead_bank(mu: float, speed: float, kinds: list[int] | None = None) -> Bank:
    """Hypotheses of these kinds that say the same of adhesion and speed."""
    bank = bank_of(kinds or [2, 3, 4, 5], spread=0.0)
    for component, value in ((MU, mu), (SPEED, speed), (ROUGH, 0.0), (GRADE, 0.0)):
        bank = bank.with_fresh(component, value, 0.05 * abs(value))
    return bank


def counted(ahead: Ahead, speeds: Array = SPEEDS) -> Array:
    """Adhesion that is counted on ahead of the train of these tests on the level, at some speeds."""
    return ahead.against(CRH3, CRH3.specific_resistance(speeds))(speeds)


def memory_of(bank: Bank, braking: Braking, seen: int) -> Memory:
    """The bank of a braking train, of whose rail nothing is known, under the full pressure."""
    pressed = BrakeSeen((PressureSample(10 * S, FULL_PA),), FULL_PA, FULL_PA, None, 10 * S)
    return Memory(bank, 10 * S, 1.0, brake=pressed, braking=braking, seen=seen, known=NOTHING)


def braked_run(
    mu: float,
    seed: int,
    seconds: float,
    dt_s: float = 0.1,
    speed_mps: float = 70.0,
    std_m: float = 0.3,
    growth: float = 0.0,
    *,
    swing: float = 0.0,
) -> tuple[Array, Array, Array]:
    """Times, true (s, v) and measured positions of a train that begins to brake at 5 s.

    It runs before that under the traction that holds its speed. The adhesion `mu` grows from then on by the share
    `growth` a second, and swings by the share `swing` with a correlation time of 0.7 s.
    """
    rng, fine = np.random.default_rng(seed), 10
    count, lasts = round(seconds / dt_s), np.exp(-dt_s / 0.7)
    drawn = np.random.default_rng(seed + 50).standard_normal(count)
    swings = swing * lfilter([np.sqrt(1.0 - lasts**2)], [1.0, -lasts], drawn)
    truth = np.zeros((count, 2))
    s, v, h = 0.0, speed_mps, dt_s / fine
    for index in range(count):
        truth[index] = s, v
        for step in range(fine):
            since_s = index * dt_s + step * h - 5.0
            braked, gives = since_s >= 0.0, mu * float(np.exp(growth * since_s)) * (1.0 + swings[index])
            slowing = 9.8 * (min(gives, FULL) + float(specific_resistance(np.array(v)))) if braked else 0.0
            s, v = s + h * v - 0.5 * h * h * slowing, v - h * slowing
    times = dt_s * np.arange(count, dtype=np.float64)
    return times, truth, np.asarray(truth[:, 0] + std_m * rng.standard_normal(count))


def measurements(times: Array, positions: Array, std_m: float, pressure_pa: float = FULL_PA) -> list[Measurement]:
    """What is measured of such a run."""
    result = []
    for time, position in zip(times, positions, strict=True):
        t_ns = S + round(float(time) * 1e9)
        pressure = pressure_pa if time >= 5.0 else 0.0
        result.append(
            Measurement(t_ns, float(position), std_m**2, pressure, pressures=(PressureSample(t_ns, pressure),))
        )
    return result
