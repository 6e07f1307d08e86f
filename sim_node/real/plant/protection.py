# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Wheel-slide protection and brake cylinders: valves with a dead time that dump, hold and apply.

The protection knows the wheels alone. Its reference speed is the fastest wheel's, and falls little faster than it did
lately while no wheel holds it. A group whose sliding speed, with a little lead, passes the upper threshold is dumped
until its wheels speed up again, held until they roll, and then applied in pulses; one above the lower threshold is
held. Where all groups are under control, one after the other is emptied to look for the train's speed.

These are the parts of the devices that EN 15595 and UIC 541-05 approve; thresholds are not published. They were
chosen for what such devices reach: creep of 4 to 20 %, 0.5 to 3 cycles a second, 83 to 92 % of the available adhesion.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .journey import PERIOD_S, Array
from .train import Nominal, Train

DEAD_S = 0.07
"""From the command to the moving valve."""

RELEASE_S = 1.0
"""Time constant of a brake that is released by the driver."""

FALL_MPS2 = 0.3, 1.8
"""Least and greatest rate at which the reference speed may fall while no wheel holds it."""

FALL_GROWTH_MPS2, FALL_MEMORY_S = 0.3, 1.0
"""It may fall by so much faster than it did lately."""

LOW = (0.6, 0.05)
HIGH = (1.0, 0.09)
"""Thresholds of the sliding speed, m/s: the first plus the second times the reference speed."""

ROLLING = (0.3, 0.02)
"""A dumped group's brake is applied again once its wheels slide less than this: the same two numbers."""

LEAD_S = 0.1
"""The sliding speed is judged as it will be so much later."""

CONTROL_S = 3.0
"""So long after its sliding speed passed the lower threshold a group is under control."""

PULSES = 4, 8
"""Under control the valve applies in the first of these numbers of periods out of the second."""

REGAINED_MPS2 = 1.0
"""Wheels that speed up by more than this regain the train's speed."""

TURN_S, LISTEN_S = 2.0, 0.3
"""Where all groups are under control it is the next one's turn to be emptied; at least for so long."""

CUT_OFF_MPS = 1.0
"""Below this reference speed the protection is off."""

APPLY, HOLD, DUMP = 0, 1, 2
Valves = NDArray[np.intp]


class Control(NamedTuple):
    """What the protection remembers; shapes (R, A), of the reference speed (R, 1)."""

    reference_mps: Array
    fall_mps2: Array
    """Rate at which the reference speed fell lately."""
    rim_mps: Array
    """Of the period before."""
    acceleration_mps2: Array
    """Of the rims, smoothed over some periods."""
    dumping: NDArray[np.bool_]
    regaining: NDArray[np.bool_]
    since_slide_s: Array
    period: int = 0


def start(rim_mps: Array) -> Control:
    """Begin with wheels that roll."""
    still, reference = np.zeros_like(rim_mps), rim_mps.max(axis=1, keepdims=True)
    return Control(reference, np.zeros_like(reference), rim_mps, still, still > 0.0, still > 0.0, still + 1e3)


def command(control: Control, rim_mps: Array) -> tuple[Control, Valves]:
    """Return what the valves are told after this period's look at the wheels."""
    before, fall, last, smooth, dumping, regaining, since, period = control
    limit = np.clip(fall + FALL_GROWTH_MPS2, *FALL_MPS2)
    reference = np.maximum(rim_mps.max(axis=1, keepdims=True), before - limit * PERIOD_S)
    fall = fall + ((before - reference) / PERIOD_S - fall) * (PERIOD_S / FALL_MEMORY_S)
    smooth = 0.5 * smooth + 0.5 * (rim_mps - last) / PERIOD_S
    sliding = reference - rim_mps
    expected = sliding - LEAD_S * smooth
    low, high = (fixed + share * reference for fixed, share in (LOW, HIGH))
    active = reference > CUT_OFF_MPS
    dump = active & (sliding > 0.5 * low) & ((expected > high) | (dumping & (smooth < REGAINED_MPS2)))
    regaining = dump | (regaining & active & (sliding > ROLLING[0] + ROLLING[1] * reference))
    since = np.where(active & (expected > low), 0.0, since + PERIOD_S)
    controlled = active & (since < CONTROL_S)
    groups = np.arange(rim_mps.shape[1])
    turn, within = divmod(period * PERIOD_S, TURN_S)
    listening = controlled.all(axis=1, keepdims=True) & (groups == turn % groups.size)
    dump = dump | (listening & ((within < LISTEN_S) | (smooth > REGAINED_MPS2)))
    pulse = (period + groups) % PULSES[1] < PULSES[0]
    hold = regaining | (active & (expected > low)) | (controlled & ~pulse)
    valves = np.where(dump, DUMP, np.where(hold, HOLD, APPLY))
    return Control(reference, fall, rim_mps, smooth, dump, regaining, since, period + 1), valves


class Cylinders:
    """Cylinders of R x A groups, moved in steps of `step_s`."""

    def __init__(self, nominal: Nominal, train: Train, step_s: float) -> None:
        self.pressure_pa = np.zeros(np.broadcast_shapes(train.dump_s.shape, train.build_up_s.shape))
        self.supply_pa = self.pressure_pa
        self._fill = nominal.full_pa / train.build_up_s * step_s
        self._empty = np.exp(-step_s / train.dump_s)
        self._rise = train.rise_pa_per_s * step_s
        self._released = -np.expm1(-step_s / RELEASE_S)

    def step(self, demanded_pa: Array, valves: Valves) -> Array:
        """Move the pressures by one step and return them; the demand is what has reached the groups, shape (A,)."""
        missing = demanded_pa - self.supply_pa
        self.supply_pa = self.supply_pa + np.where(
            missing > 0.0, np.minimum(missing, self._fill), missing * self._released
        )
        pressure = self.pressure_pa
        applied = np.minimum(self.supply_pa, pressure + self._rise)
        held = np.minimum(pressure, self.supply_pa)
        self.pressure_pa = np.where(valves == DUMP, pressure * self._empty, np.where(valves == HOLD, held, applied))
        return self.pressure_pa
