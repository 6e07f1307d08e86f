# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the benchmarks run on: a window of braking for the smoothers, and a long journey for the estimator.

Drawn from the estimator's own model, which all contenders share.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..core.belief.gaussian import Gaussian
from ..core.belief.window import Window
from ..core.config import Config
from ..core.intake.samples import PositionSample, PressureSample
from ..core.methods.kernels import expecting, maximising
from ..core.methods.kernels.filtering import Particles
from ..core.methods.particle_em.particles import given
from ..core.physics.adhesion import WET
from ..core.physics.motion import Motion
from ..core.physics.train import GRAVITY, KMH, Array, Train

SIGMA_M = 0.5
MU = 0.0726
"""Adhesion in the window."""

FASTEST_MPS, SLOWEST_MPS = 300 * KMH, 140 * KMH
"""Between these speeds the journey brakes, on a wet rail, always limited by the adhesion."""

CRUISE_S = 20.0
ACCELERATION_MPS2 = 1.0


class Scene(NamedTuple):
    """A window of braking and what its smoothers are given."""

    motion: Motion
    prior: Gaussian
    window: Window


class Update(NamedTuple):
    """What a contender finds in a window."""

    mu: float
    speed_mps: Array
    """Smoothed means, shape (K + 1,)."""
    iterations: int = 1


def maximised(scene: Scene, states: Array, marginal: Array, mu: float) -> float:
    """M-step with what a peer smoothed at `mu`: particles, (2, K + 1, N), and their weights, (K + 1, N)."""
    states, window = np.ascontiguousarray(states), scene.window
    stepped = scene.motion.advance(states[0, :-1], states[1, :-1], window.dt_s[:, None], window.brake[:, None], mu)
    particles = Particles(states, np.array(stepped), np.zeros(marginal.shape))
    statistics = expecting.reduced(given(*scene), mu, particles, np.ascontiguousarray(marginal))
    return maximising.maximised(statistics, 0.0)[0]


def braking_window(steps: int, rng: np.random.Generator) -> Scene:
    """So many steps of 0.1 s at the nominal noise, behind a prior as earlier windows leave it."""
    motion = Config().motion
    full = np.ones(steps)
    dt, brake = 0.1 * full, motion.train.full_brake * full
    prior = Gaussian(np.array([0.0, FASTEST_MPS]), np.array([[0.015, 0.002], [0.002, 0.0017]]))
    noise = np.sqrt(np.stack(motion.noise(dt))) * rng.standard_normal((2, steps))
    state = prior.mean + np.linalg.cholesky(prior.covariance) @ rng.standard_normal(2)
    positions = np.empty(steps)
    for k in range(steps):
        state = np.stack(motion.advance(state[0], state[1], dt[k], brake[k], MU)) + noise[:, k]
        positions[k] = state[0]
    measured = positions + SIGMA_M * rng.standard_normal(steps)
    return Scene(motion, prior, Window(dt, brake, measured, SIGMA_M**2 * full, 0.0 * full, math.inf * full))


def journey(rate_hz: float, rng: np.random.Generator) -> Iterator[tuple[PressureSample, PositionSample]]:
    """What the sensors give at each time while the train cruises, brakes and accelerates, over and over."""
    train, period_s, position = Config().train, 1.0 / rate_hz, 0.0
    for k, (braked, speed, change) in enumerate(_speeds(train, period_s)):
        t_ns = round(k * period_s * 1e9)
        yield (
            PressureSample(t_ns, train.full_pressure_pa if braked else 0.0),
            PositionSample(t_ns, position + SIGMA_M * float(rng.standard_normal()), SIGMA_M**2),
        )
        position += period_s * (speed + 0.5 * period_s * change)


def _speeds(train: Train, period_s: float) -> Iterator[tuple[bool, float, float]]:
    """Whether the train is braked, its speed, m/s, and the acceleration, m/s^2, from each time on."""
    speed = FASTEST_MPS
    while True:
        for _ in range(round(CRUISE_S / period_s)):
            yield False, speed, 0.0
        while speed > SLOWEST_MPS:
            resistance = float(train.specific_resistance(np.asarray(speed)))
            slowing = GRAVITY * (float(WET(np.asarray(speed))) + resistance)
            yield True, speed, -slowing
            speed -= period_s * slowing
        while speed < FASTEST_MPS:
            yield False, speed, ACCELERATION_MPS2
            speed += period_s * ACCELERATION_MPS2
