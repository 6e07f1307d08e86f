# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The true train: a point mass integrated in steps of at most 10 ms, with process noise once per sample.

How far it really runs until it stands, what a braking curve is held against, is integrated over speed instead.

It shares the forces (`core.physics.train` and `track`) with the estimator but not the motion model: this one integrates
by the midpoint rule, so that an error in the estimator's steps shows instead of cancelling.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from adhesion_node.core.physics.train import KMH, Array, Real
from adhesion_node.core.setting import check_settings, setting

from .scenario import RUN_ON_S, Rail, Scenario

SUBSTEP_S = 0.01
"""Longest step of the integration."""

REFERENCE_PERIOD_S = 0.1
"""Period to which the noise of `PlantNoise` belongs."""

STOPPING_STEPS = 500
"""Equal steps of speed to a standstill: 1 cm off the simulated way on one rail, 0.2 % where a patch lies ahead."""

COASTING, BRAKE_LIMITED, ADHESION_LIMITED = "COASTING", "BRAKE_LIMITED", "ADHESION_LIMITED"
"""The regimes, named as the estimator's."""


@dataclass(frozen=True, slots=True)
class PlantNoise:
    """Process noise: standard deviations per `REFERENCE_PERIOD_S`; they grow with the root of the period.

    Raises ValueError naming the value that is not finite or negative.
    """

    position_m: float = setting(0.02, "Of the position", "m", low=0.0)
    speed_mps: float = setting(0.02 * KMH, "Of the speed", "m/s", low=0.0)

    def __post_init__(self) -> None:
        check_settings(self, "process noise ")


NOMINAL_NOISE = PlantNoise()
NO_NOISE = PlantNoise(0.0, 0.0)


class Truth(NamedTuple):
    """The train at one sample.

    `mu` is the adhesion available at this place and speed, `applied` the part of it that the brake makes use of,
    min(F, B)/(M g), both without unit.
    """

    t_ns: int
    position_m: float
    speed_mps: float
    mu: float
    applied: float
    pressure_pa: float
    """Brake-cylinder pressure, gauge."""
    regime: str


def simulate(
    scenario: Scenario, period_s: float, rng: np.random.Generator, noise: PlantNoise = NOMINAL_NOISE
) -> Iterator[Truth]:
    """Yield the true state every `period_s` from time 0 to the end of the scenario.

    The train never runs backwards, and once at rest stays there. Raises ValueError, at the call, when the period
    is not finite or shorter than 1 ns.
    """
    if not math.isfinite(period_s) or round(period_s * 1e9) < 1:
        raise ValueError(f"simulation period_s = {period_s!r}: give a finite number of seconds, at least 1e-9")
    return _run(scenario, round(period_s * 1e9), rng, noise)


def _run(scenario: Scenario, period_ns: int, rng: np.random.Generator, noise: PlantNoise) -> Iterator[Truth]:
    growth = math.sqrt(period_ns / 1e9 / REFERENCE_PERIOD_S)
    position, speed = 0.0, scenario.speed_mps
    t_ns, last_ns = 0, round(scenario.end_s * 1e9)
    ending = False
    while t_ns <= last_ns:
        yield _truth(scenario, t_ns, position, speed)
        if not ending and scenario.end_speed_mps is not None and speed <= scenario.end_speed_mps:
            ending = True
            last_ns = min(last_ns, t_ns + round(RUN_ON_S * 1e9))
        moved, slower = advance(scenario, t_ns / 1e9, period_ns / 1e9, position, speed)
        jitter = rng.standard_normal(2) * growth
        if slower > 0.0:
            moved = max(moved + noise.position_m * float(jitter[0]), position)
            slower = max(slower + noise.speed_mps * float(jitter[1]), 0.0)
        position, speed = moved, slower
        t_ns += period_ns


def advance(
    scenario: Scenario, time_s: float, duration_s: float, position_m: float, speed_mps: float
) -> tuple[float, float]:
    """Position and speed after `duration_s` of undisturbed motion from `time_s`: midpoint rule, exact at a stop."""
    substeps = math.ceil(duration_s / SUBSTEP_S - 1e-9)
    h = duration_s / substeps
    for i in range(substeps):
        if speed_mps <= 0.0:
            return position_m, 0.0
        start = time_s + i * h
        slowing = _deceleration(scenario, start, position_m, speed_mps)
        half_speed = max(speed_mps - slowing * h / 2, 0.0)
        slowing = _deceleration(scenario, start + h / 2, position_m + speed_mps * h / 2, half_speed)
        running = h if slowing * h <= speed_mps else speed_mps / slowing
        position_m += (speed_mps - slowing * running / 2) * running
        speed_mps = speed_mps - slowing * h if running == h else 0.0
    return position_m, speed_mps


def stopping_distances(scenario: Scenario, position_m: Array, speed_mps: Array) -> Array:
    """Distances, m, shape (N,), from N places and speeds to a standstill under the scenario's full brake.

    ds = v dv/a(s, v) by the midpoint rule at the places that the train passes, without process noise. The brake is
    taken as built up, as a braking curve takes it.
    """
    step = speed_mps / STOPPING_STEPS
    place = np.array(position_m, dtype=np.float64)
    for k in range(STOPPING_STEPS):
        speed = speed_mps - k * step
        middle = place + step / 2 * speed / _slowing(scenario, place, speed)
        speed = speed - step / 2
        place = place + step * speed / _slowing(scenario, middle, speed)
    result: Array = place - position_m
    return result


def _deceleration(scenario: Scenario, time_s: float, position_m: float, speed_mps: float) -> float:
    """Deceleration, m/s^2: none before the brake, where traction balances the resistance and holds the speed."""
    if time_s < scenario.brake.start_s:
        return 0.0
    mu = scenario.rail.mu(position_m, speed_mps)
    brake = scenario.train.specific_brake(scenario.brake.gauge_pressure(time_s))
    return scenario.train.deceleration(mu, brake, _resistance(scenario, position_m, speed_mps))


def _resistance(scenario: Scenario, position_m: Real, speed_mps: Real) -> Real:
    """Resistance of train and track per weight, N/N (5)."""
    return scenario.train.specific_resistance(speed_mps) + scenario.track.specific_resistance(position_m)


def _truth(scenario: Scenario, t_ns: int, position_m: float, speed_mps: float) -> Truth:
    mu = scenario.rail.mu(position_m, speed_mps)
    pressure = scenario.brake.gauge_pressure(t_ns / 1e9)
    if pressure <= 0.0:
        return Truth(t_ns, position_m, speed_mps, mu, 0.0, pressure, COASTING)
    if speed_mps <= 0.0:  # the rail is asked for nothing, so nothing of mu can be seen
        return Truth(t_ns, position_m, speed_mps, mu, 0.0, pressure, BRAKE_LIMITED)
    brake = scenario.train.specific_brake(pressure)
    applied = scenario.train.used_adhesion(mu, brake, _resistance(scenario, position_m, speed_mps))
    regime = BRAKE_LIMITED if applied < mu else ADHESION_LIMITED
    return Truth(t_ns, position_m, speed_mps, mu, applied, pressure, regime)


def _slowing(scenario: Scenario, position_m: Array, speed_mps: Array) -> Array:
    """Deceleration under the full brake, m/s^2, shape (N,)."""
    brake = scenario.train.specific_brake(scenario.brake.pressure_pa)
    resistance = _resistance(scenario, position_m, speed_mps)
    return scenario.train.deceleration(_adhesion(scenario.rail, position_m, speed_mps), brake, resistance)


def _adhesion(rail: Rail, position_m: Array, speed_mps: Array) -> Array:
    """Adhesion at N places and speeds, shape (N,)."""
    starts = np.array([start for start, _ in rail.laws])
    of_place = np.maximum(np.searchsorted(starts, position_m, side="right") - 1, 0)
    return np.choose(of_place, [law(speed_mps) for _, law in rail.laws])
