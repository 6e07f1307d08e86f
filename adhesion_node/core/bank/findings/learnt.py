# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a journey teaches of train and sensors beside the adhesion, as numbers by name: what an operator may look at."""

from __future__ import annotations

import math
from typing import NamedTuple

from ...physics.train import GRAVITY
from ..labels.kinds import KINDS
from ..layout import BIAS, BRAKE, GRADE, OFFSET, PITCH, RADIUS, SCALE
from ..memory import Memory


class Quantity(NamedTuple):
    """A component of the belief, told with its standard deviation."""

    name: str
    component: int
    unit: str
    meaning: str
    factor: float = 1.0
    """From the component to the unit."""


QUANTITIES = (
    Quantity("brake_factor", BRAKE, "", "true over expected brake force"),
    Quantity("grade_residual", GRADE, "", "grade that the profile leaves open, with the error of the resistance"),
    Quantity("position_error", OFFSET, "m", "slow error of the positions"),
    Quantity("speed_scale_error", SCALE, "", "scale error of the measured speeds"),
    Quantity("rim_speed_error", RADIUS, "", "by how much the rims are too fast, as the wheels' radii are not known"),
    Quantity("acceleration_bias", BIAS, "m/s^2", "bias of the accelerometer", GRAVITY),
    Quantity("acceleration_pitch", PITCH, "", "what the accelerometer feels too much, over the deceleration"),
)

SCATTERS = (
    ("position_scatter", "m", "standard deviation by which measured positions scatter from one to the next"),
    ("speed_scatter", "m/s", "the same of measured speeds"),
    ("acceleration_scatter", "m/s^2", "the same of the accelerometer, of its means over a step of time"),
)
"""Name, unit and meaning; told once they are known. They count where a sensor tells much less."""

KIND, WHEEL = "probability.", "wheel_radius."
"""Beginnings of the names of the kinds' probabilities, and of the axles' true over expected radii."""


def learnt(memory: Memory) -> dict[str, float]:
    """Every quantity with its standard deviation as NAME_std, the kinds' probabilities, what of sensors is known."""
    mean, covariance = memory.bank.moments()
    found = dict[str, float]()
    for name, component, _, _, factor in QUANTITIES:
        found[name] = factor * float(mean[component])
        found[f"{name}_std"] = factor * math.sqrt(max(float(covariance[component, component]), 0.0))
    scatters = memory.places, memory.speeds.quick, memory.shaking.quick
    for (name, *_), scatter in zip(SCATTERS, scatters, strict=True):
        if scatter.is_known:
            found[name] = math.sqrt(max(scatter.variance, 0.0))
    weight = memory.bank.weight
    found |= {f"{KIND}{kind.name}": float(weight[memory.bank.kind == k].sum()) for k, kind in enumerate(KINDS)}
    return found | {f"{WHEEL}{axle}": own / (1.0 + mean[RADIUS]) for axle, own in enumerate(memory.wheels.radii.own)}
