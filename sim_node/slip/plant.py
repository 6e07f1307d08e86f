# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The slip plant: a locomotive whose drive pulls until the wheels creep to the peak, eases off, and pulls again.

    J dw/dt = T - r F,   F = mu(l) N g,   l = (r w - v)/v,   M dv/dt = sum F - R

per driven axle: w its angular speed, T the motor's torque, N its load; v and M belong to the whole train, R is its
running resistance. mu(l) is a Kiencke curve of the surface under the axle, written here by its peak and not by the
p1, p2 that are to be identified: an error in those must not cancel.

The drive raises the torque slowly, so that the contact is in balance all the way up, and lets go quickly when an axle
creeps to `CREEP_LIMIT`, as a slip protection does. So the creep runs from 0 to the peak again and again.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from adhesion_node.core.physics.train import GRAVITY, Array
from adhesion_node.core.setting import check_settings, setting

from .scenario import Locomotive, SlipScenario, Surface

SUBSTEP_S = 0.002
"""Longest step of the integration: the contact settles within some ms, and the midpoint rule is stable up to 3 ms."""

CREEP_LIMIT, CREEP_LOW = 0.1, 0.004
"""The drive lets go above the one and pulls again below the other."""

RISE_S, FALL_S = 20.0, 0.5
"""Time in which the drive builds up its full torque and takes it away."""


@dataclass(frozen=True, slots=True)
class SlipNoise:
    """Noise of the sensors, standard deviations. Raises ValueError naming the one that is out of range."""

    wheel_std_radps: float = setting(0.003, "Noise of a wheel speed", "rad/s", 0.0, 10.0)
    speed_std_mps: float = setting(0.003, "Noise of the train's speed", "m/s", 0.0, 10.0)
    force_std_n: float = setting(2000.0, "Noise of the traction force", "N", 0.0, 1e6)

    def __post_init__(self) -> None:
        check_settings(self, "sensor ")


class SlipTruth(NamedTuple):
    """The train at one sample; the arrays have one entry per axle."""

    t_ns: int
    position_m: float
    """Of the first axle."""
    speed_mps: float
    wheel_radps: Array
    creep: Array
    force_n: float
    """Of all axles at the rim."""
    mu_max: float
    """Peak of the curves under the axles, their mean."""


class SlipReading(NamedTuple):
    """What the sensors show of one sample."""

    t_ns: int
    wheel_radps: tuple[float, ...]
    speed_mps: float
    force_n: float


def run(
    scenario: SlipScenario, period_s: float, seed: int, noise: SlipNoise | None = None
) -> Iterator[tuple[SlipTruth, SlipReading]]:
    """Yield the truth and the reading of every sample from time 0 to the scenario's end.

    The train's run does not depend on the noise. Raises ValueError when the period is not finite or below 1 ns.
    """
    if not math.isfinite(period_s) or round(period_s * 1e9) < 1:
        raise ValueError(f"simulation period_s = {period_s!r}: give a finite number of seconds, at least 1e-9")
    rng, used = np.random.default_rng(seed), noise or SlipNoise()
    return ((truth, measure(truth, used, rng)) for truth in simulate(scenario, round(period_s * 1e9)))


def measure(truth: SlipTruth, noise: SlipNoise, rng: np.random.Generator) -> SlipReading:
    """Measure one true sample; every call draws the same numbers, whatever the noise."""
    drawn = rng.standard_normal(truth.wheel_radps.size + 2)
    wheels = truth.wheel_radps + noise.wheel_std_radps * drawn[2:]
    speed = truth.speed_mps + noise.speed_std_mps * float(drawn[0])
    return SlipReading(truth.t_ns, tuple(wheels.tolist()), speed, truth.force_n + noise.force_std_n * float(drawn[1]))


def simulate(scenario: SlipScenario, period_ns: int) -> Iterator[SlipTruth]:
    """Yield the true train every `period_ns`: midpoint rule in steps of at most `SUBSTEP_S`, no process noise."""
    loco = scenario.locomotive
    position, speed, torque, pulling = 0.0, scenario.speed_mps, 0.0, True
    wheels = np.full(loco.axles, speed / loco.wheel_radius_m)
    substeps = math.ceil(period_ns * 1e-9 / SUBSTEP_S - 1e-9)
    h = period_ns * 1e-9 / substeps
    for t_ns in range(0, round(scenario.end_s * 1e9) + 1, period_ns):
        surfaces = [scenario.surface(position - i * loco.axle_spacing_m) for i in range(loco.axles)]
        yield _truth(loco, surfaces, t_ns, position, speed, wheels)
        for _ in range(substeps):
            torque, pulling = drive(loco, torque, pulling, float(np.max(_creep(loco, wheels, speed))), h)
            turning, pulled = _accelerations(loco, surfaces, torque, wheels, speed)
            half = wheels + turning * h / 2, speed + pulled * h / 2
            turning, pulled = _accelerations(loco, surfaces, torque, *half)
            position += half[1] * h
            wheels, speed = wheels + turning * h, speed + pulled * h


def drive(loco: Locomotive, torque_nm: float, pulling: bool, creep: float, duration_s: float) -> tuple[float, bool]:
    """Return the torque per axle after `duration_s`, and whether the drive then builds it up."""
    pulling = creep < CREEP_LIMIT if pulling else creep < CREEP_LOW
    rate = loco.full_torque_nm / (RISE_S if pulling else -FALL_S)
    return min(max(torque_nm + rate * duration_s, 0.0), loco.full_torque_nm), pulling


def _accelerations(
    loco: Locomotive, surfaces: list[Surface], torque_nm: float, wheels: Array, speed: float
) -> tuple[Array, float]:
    """Angular accelerations of the axles, rad/s^2, and the train's, m/s^2."""
    forces = _forces(loco, surfaces, _creep(loco, wheels, speed))
    turning = (torque_nm - loco.wheel_radius_m * forces) / loco.axle_inertia_kgm2
    return turning, (float(forces.sum()) - loco.resistance_n) / loco.train_mass_kg


def _forces(loco: Locomotive, surfaces: list[Surface], creep: Array) -> Array:
    load = loco.axle_load_kg * GRAVITY
    if surfaces[0] == surfaces[-1]:
        return surfaces[0].mu(creep) * load
    return np.array([float(surface.mu(one)) for surface, one in zip(surfaces, creep, strict=True)]) * load


def _creep(loco: Locomotive, wheels: Array, speed: float) -> Array:
    return (loco.wheel_radius_m * wheels - speed) / speed


def _truth(
    loco: Locomotive, surfaces: list[Surface], t_ns: int, position: float, speed: float, wheels: Array
) -> SlipTruth:
    creep = _creep(loco, wheels, speed)
    force = float(_forces(loco, surfaces, creep).sum())
    return SlipTruth(
        t_ns, position, speed, wheels, creep, force, sum(surface.mu_max for surface in surfaces) / loco.axles
    )
