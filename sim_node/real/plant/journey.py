# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What the plant hands out: the truth of one run."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

GRAVITY = 9.80665
"""Standard gravity, m/s^2."""

PERIOD_S = 0.02
"""The truth is kept every 20 ms; the slide protection reads its wheels as often."""


class Journey(NamedTuple):
    """Truth of one run: T samples every `PERIOD_S` from time 0, A axle groups."""

    seed: int
    time_s: Array
    """Shape (T,)."""
    position_m: Array
    """Of the train's front, along the track from 0; shape (T,)."""
    speed_mps: Array
    """Shape (T,)."""
    acceleration_mps2: Array
    """dv/dt, mean over the last period, negative under the brake; shape (T,)."""
    grade: Array
    """Rise over run, mean under the train; shape (T,)."""
    used: Array
    """Sum of the wheel-rail forces that brake, over M g, mean over the last period; shape (T,)."""
    available: Array
    """Mean over the axle groups of the peak of each one's creep curve at its place and speed; shape (T,)."""
    sliding: Array
    """Share of the axle groups whose creep is beyond the peak of their curve; shape (T,)."""
    demanded_pa: Array
    """Gauge pressure that the driver's handle or the train control asks for; shape (T,)."""
    cylinder_pa: Array
    """Gauge pressure in the brake cylinders; shape (T, A)."""
    wheel_radps: Array
    """Shape (T, A)."""
    pitch_rad: Array
    """Of the body that carries the sensors, positive nose down; shape (T,)."""
    full_from_s: float
    """From then on the full brake is demanded, to the end."""
    radius_m: Array
    """True radii of the wheels, shape (A,)."""
