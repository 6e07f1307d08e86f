# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""How far a train really runs until it stands: what a braking curve is held against.

The true rail, track and brake of a scenario without process noise, integrated over speed at the places that the train
passes; nothing of it comes from the estimator or its curves.
"""

from __future__ import annotations

import numpy as np

from adhesion_node.core.physics.train import Array

from .scenario import Rail, Scenario

STEPS = 500
"""Equal steps of speed to a standstill: 1 cm off the simulated way on one rail, 0.2 % where a patch lies ahead."""


def stopping_distances(scenario: Scenario, position_m: Array, speed_mps: Array) -> Array:
    """Distances, m, shape (N,), from N places and speeds to a standstill under the scenario's full brake.

    ds = v dv/a(s, v) by the midpoint rule. The brake is taken as built up, as a braking curve takes it.
    """
    step = speed_mps / STEPS
    place = np.array(position_m, dtype=np.float64)
    for k in range(STEPS):
        speed = speed_mps - k * step
        middle = place + step / 2 * speed / _deceleration(scenario, place, speed)
        speed = speed - step / 2
        place = place + step * speed / _deceleration(scenario, middle, speed)
    result: Array = place - position_m
    return result


def _deceleration(scenario: Scenario, position_m: Array, speed_mps: Array) -> Array:
    """Deceleration, m/s^2, shape (N,)."""
    train = scenario.train
    resistance = train.specific_resistance(speed_mps) + scenario.track.specific_resistance(position_m)
    brake = train.specific_brake(scenario.brake.pressure_pa)
    return train.deceleration(_adhesion(scenario.rail, position_m, speed_mps), brake, resistance)


def _adhesion(rail: Rail, position_m: Array, speed_mps: Array) -> Array:
    """Adhesion at N places and speeds, shape (N,)."""
    starts = np.array([start for start, _ in rail.laws])
    of_place = np.maximum(np.searchsorted(starts, position_m, side="right") - 1, 0)
    return np.choose(of_place, [law(speed_mps) for _, law in rail.laws])
