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
from .journey import GRAVITY, Array
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
    force, slope = load * mu, load * slope
    turning = step_s * (force - brake_n) / (train.wheel_kg + step_s * slope)
    slope = np.where(
        turning * np.sign(sliding) > np.abs(sliding), force / np.where(sliding == 0.0, 1.0, sliding), slope
    )
    locked = (rim <= 0.0) & (force < brake_n)
    share = np.where(locked, 1.0, train.wheel_kg / (train.wheel_kg + step_s * slope))
    free, stiff = share * force + (1.0 - share) * brake_n, share * slope
    mass = train.mass_kg + step_s * stiff.sum(axis=1, keepdims=True)
    change = -step_s * (free.sum(axis=1, keepdims=True) + running_n) / mass
    force = free + stiff * change
    turned = np.where(locked, 0.0, rim + step_s * (force - brake_n) / train.wheel_kg)
    stops = speed + change <= STICKING_MPS
    part = np.where(speed <= 0.0, 0.0, np.where(stops, np.minimum(speed / np.maximum(-change, 1e-300), 1.0), 1.0))
    after = np.where(stops, 0.0, speed + change)
    position = position + 0.5 * (speed + after) * part * step_s
    rim = np.where(stops, 0.0, np.maximum(turned, 0.0))
    return Motion(position, after, rim), force.sum(axis=1, keepdims=True) * part
