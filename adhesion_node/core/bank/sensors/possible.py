# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How a train may move under the brake: no harder than its brake, and with no gain of speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from ...physics.train import GRAVITY, Array
from ..layout import POSITION, SPEED, Bank

if TYPE_CHECKING:
    from ...config import Config

BRAKE_ERROR, RESISTANCE_ERROR, GRADE_SIGMA = 1.15, 1.2, 2.0
"""Factors on the full brake and the running resistance that are possible, and standard deviations of the grade."""

SURELY = 2.0
"""Standard deviations by which the brake may be stronger, too, where it shows exactly how hard a train brakes."""

GAIN_MPS2 = 0.1
"""A train that has been braked for long does not gain speed by more than this, and the grade's part."""


class Possible(NamedTuple):
    """How a train may move under the brake."""

    least_mps2: float
    """By how much it slows down at least, once it has been braked for long, ..."""
    most_mps2: float
    """... and at most."""
    speed_mps: float


def possible_of(config: Config, bank: Bank, places: Array, applied: float = 0.0, brake_sigma: float = 0.0) -> Possible:
    """How it may where it is, and at the places so far from there, m, that are looked at.

    A brake that is `applied`, over the weight, may be more than the full one, as in an emergency.
    """
    speed_mps = max(bank.mean_of(SPEED), 0.0)
    climbs = config.track.specific_resistance(bank.mean_of(POSITION) + places)
    least_mps2 = GRAVITY * (min(float(climbs.min()), 0.0) - GRADE_SIGMA * config.grade_error) - GAIN_MPS2
    most_mps2 = strongest_mps2(config, speed_mps, applied, brake_sigma) + GRAVITY * max(float(climbs.max()), 0.0)
    return Possible(least_mps2, most_mps2, speed_mps)


def strongest_mps2(config: Config, speed_mps: float, applied: float = 0.0, brake_sigma: float = 0.0) -> float:
    """By how much a train slows down at most, m/s^2, but for what the grade is told to be."""
    c0, c1, c2 = config.train.resistance_si
    resisting = RESISTANCE_ERROR * (c0 + speed_mps * (c1 + c2 * speed_mps))
    factor = max(BRAKE_ERROR, 1.0 + brake_sigma * config.brake_error)
    return GRAVITY * (factor * max(config.train.full_brake, applied) + resisting + GRADE_SIGMA * config.grade_error)
