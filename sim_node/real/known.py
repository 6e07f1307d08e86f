# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What an onboard unit is told of a real train and its track, in the estimator's own terms."""

from dataclasses import asdict
from typing import Any

from adhesion_node.core.physics.track import Grade, Track
from adhesion_node.core.physics.train import GRAVITY, KMH, Train

from .plant.scenarios import Scenario
from .plant.way import LEVEL
from .sensors.fitted import Fitted

LONG_M = 1e5
"""So far a profile tells that a line is level."""


def train(scenario: Scenario) -> Train:
    """Return the train by its papers: the pads' friction stands for whatever makes the force of the full brake."""
    nominal = scenario.nominal
    weight_kn = 1e-3 * nominal.mass_kg * GRAVITY
    c0, c1, c2 = nominal.resistance
    known: dict[str, Any] = {
        "mass_kg": nominal.mass_kg,
        "length_m": nominal.length_m,
        "full_pressure_pa": nominal.full_pa,
        "wheel_radius_m": nominal.wheel_radius_m,
        "rotating_mass_fraction": nominal.rotating,
        "resistance_c0": c0 / weight_kn,
        "resistance_c1": c1 * KMH / weight_kn,
        "resistance_c2": c2 * KMH**2 / weight_kn,
    }
    like = Train(**known)
    return Train(pad_friction=like.pad_friction * nominal.brake_n / like.brake_force(nominal.full_pa), **known)


def parameters(scenario: Scenario, fitted: Fitted) -> dict[str, Any]:
    """Return the estimator's parameters by name: train, known grades, and what its sensors are.

    A fitted `fix` needs a file with the track's line beside them.
    """
    grades = "; ".join(f"grade {one.start_m} {one.end_m} {one.rise_m}" for one in _grades(scenario))
    own = {f"train.{name}": value for name, value in asdict(train(scenario)).items()}
    return {**own, **brake(scenario), "track": grades, **fitted.told}


def brake(scenario: Scenario) -> dict[str, float]:
    """Return the full pressure and the time until the last cylinder has it, as parameters by name."""
    nominal = scenario.nominal
    builds_up_s = nominal.build_up_s + nominal.length_m / nominal.propagation_mps
    return {"assumed_pressure_pa": nominal.full_pa, "brake_build_up_s": builds_up_s}


def track(scenario: Scenario) -> Track:
    """Return the profile: the grades that are known, that the line is level, or where it undulates nothing."""
    return Track(_grades(scenario), scenario.nominal.length_m)


def _grades(scenario: Scenario) -> tuple[Grade, ...]:
    level = ((-LONG_M, LONG_M, 0.0),) if scenario.grade is LEVEL else ()
    return tuple(Grade(start, end, slope * (end - start)) for start, end, slope in scenario.known_grade or level)
