# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The wheel-speed sensors: one per axle group, whose wheels roll with micro-creep or slide under slip protection.

    w r = v (1 - c)

with the radius r and the creep c of braking, positive here.
"""

from __future__ import annotations

import math

import numpy as np

from .plant import ADHESION_LIMITED, Truth

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
