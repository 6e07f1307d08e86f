# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The sensors: position with Gaussian or heavy-tailed noise, outliers and dropouts; brake pressure; odometer.

The wheels of every axle group roll with micro-creep or slide under slip protection: w r = v (1 - c), with the radius r
and the creep c of braking, positive here.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from adhesion_node.core.setting import check_settings, setting
from adhesion_node.wire.line import FRAME
from adhesion_node.wire.messages.codec import New
from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION, SPEED, WHEEL_SPEED

from .plant import ADHESION_LIMITED, Truth

ATMOSPHERE_PA = 101325.0
"""Standard atmosphere: the sensor measures absolute pressure, the brake works by the pressure above this."""

GROUPS = 4
"""Axle groups whose brakes the slip protection controls one by one."""

ROLLING_SLOPE = 30.0
"""Adhesion per creep of a rolling wheel: the full brake of 0.095 takes 0.3 % of creep."""

SLIDING_LOW, SLIDING_HIGH = 0.05, 0.20
"""Creep between which the slip protection holds a sliding axle."""

CYCLE_S = 1.7
"""Time in which the slip protection releases an axle and lets it slide again; the groups take turns."""

RESTLESS = 0.2
"""Noise of the creep of a sliding axle, in parts of its range."""


@dataclass(frozen=True, slots=True)
class SensorSettings:
    """Noise of the sensors. Raises ValueError naming the setting that is out of range."""

    position_std_m: float = setting(0.5, "Noise of the position, or with student_dof the scale of t", "m", 1e-3, 100.0)
    student_dof: float = setting(0.0, "0, or degrees of freedom of Student-t position noise, from 1", "", 0.0, 100.0)
    outlier_fraction: float = setting(0.0, "Fraction of positions that are outliers, to either side", "", 0.0, 1.0)
    outlier_size_m: float = setting(20.0, "Size of an outlier", "m", 0.0, 1e4)
    dropout_fraction: float = setting(0.0, "Fraction of positions that are missing", "", 0.0, 1.0)
    pressure_std_pa: float = setting(0.0, "Noise of the brake pressure", "Pa", 0.0, 1e5)
    speed_std_mps: float = setting(0.0, "Noise of the speed; 0 = no odometer", "m/s", 0.0, 10.0)
    wheel_speed_std_radps: float = setting(0.0, "Noise of the wheel speeds; 0 = no such sensors", "rad/s", 0.0, 10.0)

    def __post_init__(self) -> None:
        check_settings(self, "sensor ")
        if 0 < self.student_dof < 1:
            raise ValueError(f"sensor student_dof = {self.student_dof!r}: give 0 (Gaussian) or at least 1")


class Reading(NamedTuple):
    """What the sensors show of one sample; a value that is None is not published."""

    t_ns: int
    position_m: float | None
    pressure_pa: float
    """Absolute."""
    speed_mps: float | None
    wheel_radps: tuple[float, ...] | None = None
    """Angular speed of each axle group."""


class SensorMessage(NamedTuple):
    """One message: `values` in SI units, one for every axle group and else a single one."""

    topic: Topic
    t_ns: int
    values: tuple[float, ...]
    variance: float
    frame: str = FRAME

    def build(self, new: New) -> Any:
        """Build the message, with all that a fault has made of it."""
        return self.topic.build(new, self.t_ns, self.values, self.variance, self.frame)


Tick = tuple[Truth, tuple[SensorMessage, ...]]


def measure(truth: Truth, settings: SensorSettings, rng: np.random.Generator) -> Reading:
    """Measure one true sample, the wheels apart.

    Every call draws the same basic numbers, whatever the settings: outliers, dropouts and an odometer come on top
    of an otherwise equal run.
    """
    position_noise, pressure_noise, speed_noise, side = rng.standard_normal(4)
    outlier, dropout = rng.random(2)
    if settings.student_dof > 0:
        # t = z / sqrt(chi2/dof), from a stream of its own kind: it comes last and only here.
        position_noise /= math.sqrt(rng.chisquare(settings.student_dof) / settings.student_dof)
    position = truth.position_m + settings.position_std_m * position_noise
    if outlier < settings.outlier_fraction:
        position += math.copysign(settings.outlier_size_m, side)
    return Reading(
        t_ns=truth.t_ns,
        position_m=None if dropout < settings.dropout_fraction else float(position),
        pressure_pa=float(truth.pressure_pa + ATMOSPHERE_PA + settings.pressure_std_pa * pressure_noise),
        speed_mps=float(truth.speed_mps + settings.speed_std_mps * speed_noise) if settings.speed_std_mps else None,
    )


def wheel_speeds(truth: Truth, radius_m: float, std_radps: float, rng: np.random.Generator) -> tuple[float, ...]:
    """Measure the angular speeds of the axle groups, rad/s; every call draws the same numbers."""
    sensor, restless = rng.standard_normal((2, GROUPS))
    creep = np.full(GROUPS, truth.applied / ROLLING_SLOPE)
    if truth.regime == ADHESION_LIMITED:
        turn = 2 * math.pi * (truth.t_ns * 1e-9 / CYCLE_S + np.arange(GROUPS) / GROUPS)
        share = np.clip(0.5 + 0.5 * np.sin(turn) + RESTLESS * restless, 0.0, 1.0)
        creep = SLIDING_LOW + (SLIDING_HIGH - SLIDING_LOW) * share
    measured = truth.speed_mps * (1.0 - creep) / radius_m + std_radps * sensor
    return tuple(measured.tolist())


def messages_of(reading: Reading, settings: SensorSettings) -> tuple[SensorMessage, ...]:
    """Return the messages of a reading in the order of publishing; the position completes the sample."""
    shown = (
        (BRAKE_PRESSURE, (reading.pressure_pa,), settings.pressure_std_pa),
        (SPEED, _single(reading.speed_mps), settings.speed_std_mps),
        (WHEEL_SPEED, reading.wheel_radps, settings.wheel_speed_std_radps),
        (POSITION, _single(reading.position_m), settings.position_std_m),
    )
    return tuple(
        SensorMessage(topic, reading.t_ns, values, std**2) for topic, values, std in shown if values is not None
    )


def _single(value: float | None) -> tuple[float, ...] | None:
    return None if value is None else (value,)
