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

from .compiled import formula
from .journey import PERIOD_S, Array, Flags
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
    dumping: Flags
    regaining: Flags
    since_slide_s: Array
    period: int = 0


def start(rim_mps: Array) -> Control:
    """Begin with wheels that roll."""
    still, reference = np.zeros_like(rim_mps), rim_mps.max(axis=1, keepdims=True)
    return Control(reference, np.zeros_like(reference), rim_mps, still, still > 0.0, still > 0.0, still + 1e3)


def command(control: Control, rim_mps: Array, creep: float = 1.0) -> tuple[Control, Valves]:
    """Return what the valves are told after this period's look at the wheels; `creep` is a factor on all thresholds."""
    before, fall, last, smooth, dumping, regaining, since, period = control
    reference, fall = _referred(before, fall, rim_mps.max(axis=1, keepdims=True), PERIOD_S)
    smooth, dump, regaining, since, controlled, slides = _watched(
        reference, rim_mps, last, smooth, dumping, regaining, since, PERIOD_S, creep
    )
    groups = np.arange(rim_mps.shape[1])
    turn, within = divmod(period * PERIOD_S, TURN_S)
    listening = controlled.all(axis=1, keepdims=True) & (groups == turn % groups.size)
    dump = dump | (listening & ((within < LISTEN_S) | (smooth > REGAINED_MPS2)))
    pulse = (period + groups) % PULSES[1] < PULSES[0]
    hold = regaining | slides | (controlled & ~pulse)
    valves = np.where(dump, DUMP, np.where(hold, HOLD, APPLY))
    return Control(reference, fall, rim_mps, smooth, dump, regaining, since, period + 1), valves


@formula("dddd->dd")
def _referred(before: float, fall: float, fastest: float, period_s: float, reference: Array, fell: Array) -> None:
    """The reference speed and how fast it fell lately."""
    limit = min(max(fall + FALL_GROWTH_MPS2, FALL_MPS2[0]), FALL_MPS2[1])
    reference[0] = max(fastest, before - limit * period_s)
    fell[0] = fall + ((before - reference[0]) / period_s - fall) * (period_s / FALL_MEMORY_S)


@formula("dddd??ddd->d??d??")
def _watched(
    reference: float,
    rim: float,
    last: float,
    smooth: float,
    dumping: bool,
    regaining: bool,
    since: float,
    period_s: float,
    creep: float,
    smoothed: Array,
    dump: Flags,
    regains: Flags,
    after: Array,
    controlled: Flags,
    slides: Flags,
) -> None:
    """What the wheels of one group show."""
    smoothed[0] = 0.5 * smooth + 0.5 * (rim - last) / period_s
    sliding = reference - rim
    expected = sliding - LEAD_S * smoothed[0]
    low, high = creep * (LOW[0] + LOW[1] * reference), creep * (HIGH[0] + HIGH[1] * reference)
    active = reference > CUT_OFF_MPS
    held = dumping and smoothed[0] < REGAINED_MPS2
    dump[0] = active and sliding > 0.5 * low and (expected > high or held)
    regains[0] = dump[0] or (regaining and active and sliding > creep * (ROLLING[0] + ROLLING[1] * reference))
    slides[0] = active and expected > low
    after[0] = 0.0 if slides[0] else since + period_s
    controlled[0] = active and after[0] < CONTROL_S


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
        self.supply_pa, self.pressure_pa = _filled(
            self.supply_pa, self.pressure_pa, demanded_pa, valves, self._fill, self._released, self._empty, self._rise
        )
        return self.pressure_pa


@formula("dddldddd->dd")
def _filled(
    supply: float,
    pressure: float,
    demanded: float,
    valve: int,
    fill: float,
    released: float,
    empty: float,
    rise: float,
    supplied: Array,
    filled: Array,
) -> None:
    missing = demanded - supply
    supplied[0] = supply + (min(missing, fill) if missing > 0.0 else missing * released)
    if valve == DUMP:
        filled[0] = pressure * empty
    else:
        filled[0] = min(pressure if valve == HOLD else pressure + rise, supplied[0])
