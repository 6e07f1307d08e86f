# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Motion of R trains side by side, their wheels by a linearly implicit step.

    M dv = -(sum F + R) dt,    m du = (F - B) dt  per group,    F = Q mu(w, v),  w = v - u

u = r omega is the rim's speed, m = J/r^2, R the running resistance with that of the grade. A rolling wheel is stiff
(the slower the train the more), so every step takes F + (dF/dw)(dv - du) for F and solves for all du and dv at once:
the matrix is an arrowhead. A wheel that regains the train's speed within a step would shoot over it, as the slope where
it slides is not that where it rolls: it gets that of the chord, F/w. No sum runs across the trains, so none depends on
those beside it.
"""

from typing import NamedTuple

import numpy as np

from . import creep
from .compiled import formula
from .journey import GRAVITY, Array, Flags
from .train import Train

STICKING_MPS = 1e-3
"""A train this slow stands: its wheels stick to the rail, also on a grade."""


class Motion(NamedTuple):
    """Where R trains are: (R, 1), and how fast the rims of their wheels turn: (R, A)."""

    position_m: Array
    speed_mps: Array
    rim_mps: Array


def step(
    motion: Motion, train: Train, rail: creep.Contact, brake_n: Array, running_n: Array, step_s: float
) -> tuple[Motion, Array]:
    """Return the motion a step later, and the mean force at the rails of every train, N, (R, 1).

    A wheel that stands while its brake is stronger than the rail stays locked; a train that stops stays.
    """
    position, speed, rim = motion
    load = train.mass_kg * GRAVITY / rim.shape[1]
    sliding = speed - rim
    mu, slope = creep.adhesion(sliding, speed, rail)
    free, stiff, locked = _held(rim, sliding, load, mu, slope, brake_n, train.wheel_kg, step_s)
    held_n, stiffness = free.sum(axis=1, keepdims=True), stiff.sum(axis=1, keepdims=True)
    position, after, change, part = _train(position, speed, train.mass_kg, held_n, stiffness, running_n, step_s)
    force, rim = _wheel(rim, locked, free, stiff, change, after, brake_n, train.wheel_kg, step_s)
    return Motion(position, after, rim), force.sum(axis=1, keepdims=True) * part


@formula("dddddddd->dd?")
def _held(
    rim: float,
    sliding: float,
    load: float,
    mu: float,
    slope: float,
    brake: float,
    wheel_kg: float,
    dt: float,
    free: Array,
    stiff: Array,
    locked: Flags,
) -> None:
    """The force at the rail once the wheel has turned with it: what it is, and its slope, if the train goes on."""
    force, slope = load * mu, load * slope
    turning = dt * (force - brake) / (wheel_kg + dt * slope)
    if turning * np.sign(sliding) > abs(sliding):
        slope = force / (1.0 if sliding == 0.0 else sliding)  # the machine may divide before it has compared
    locked[0] = rim <= 0.0 and force < brake
    share = 1.0 if locked[0] else wheel_kg / (wheel_kg + dt * slope)
    free[0], stiff[0] = share * force + (1.0 - share) * brake, share * slope


@formula("ddddddd->dddd")
def _train(
    position: float,
    speed: float,
    mass_kg: float,
    held: float,
    stiffness: float,
    running: float,
    dt: float,
    place: Array,
    after: Array,
    change: Array,
    part: Array,
) -> None:
    """The train's position and speed after the step, the change of its speed, and the part of the step it moves in."""
    change[0] = -dt * (held + running) / (mass_kg + dt * stiffness)
    stops = speed + change[0] <= STICKING_MPS
    after[0] = 0.0 if stops else speed + change[0]
    part[0] = min(speed / max(-change[0], 1e-300), 1.0) if stops else 1.0
    if speed <= 0.0:
        part[0] = 0.0
    place[0] = position + 0.5 * (speed + after[0]) * part[0] * dt


@formula("d?ddddddd->dd")
def _wheel(
    rim: float,
    locked: bool,
    free: float,
    stiff: float,
    change: float,
    after: float,
    brake: float,
    wheel_kg: float,
    dt: float,
    force: Array,
    turned: Array,
) -> None:
    """The force at the rail, and how fast the rim turns after the step."""
    force[0] = free + stiff * change
    turned[0] = 0.0 if locked or after <= 0.0 else max(rim + dt * (force[0] - brake) / wheel_kg, 0.0)
