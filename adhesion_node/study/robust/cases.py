# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The cases of `study robust` as data: the world, what goes wrong in it from when to when, the estimator's settings."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from sim_node.faults.plan import Plan, period_of
from sim_node.train.sensors import SensorSettings

from ...core import Config
from ..trial.estimators import EXACT, Estimator
from ..trial.trials import Trials
from ..trial.world import PERIOD_S, World

WHOLE_RUN, BEFORE_BRAKING_S = 0.0, 10.0
"""Beginnings of a fault other than the usual one, which comes 10 s after the brakes."""

MOMENT_S = 0.0
"""Duration of a jump."""

POSITIONS = SensorSettings()
"""Positions and pressures alone."""


class Case(NamedTuple):
    """A line of a table."""

    name: str
    world: World
    estimator: Estimator = Estimator()

    @property
    def passes(self) -> bool:
        """Whether the fault is over before the run is."""
        return math.isfinite(self.world.lasts_s)

    @property
    def without(self) -> Case:
        """B: the same runs without the fault; one for all cases that share them."""
        return Case("without a fault", self.world.without_fault, self.estimator)

    @property
    def head(self) -> dict[str, str]:
        """Names for the case's row."""
        return {"case": self.name, "scenario": self.world.scenario, "method": self.estimator.config.method}

    def trials(self, runs: int) -> Trials:
        """Its runs."""
        return Trials(self.world, self.estimator, seeds=runs)


def _lasting(
    name: str,
    fault: str,
    start_s: float = Plan().fault_start_s,
    config: Config = EXACT,
    sensors: SensorSettings = POSITIONS,
    size: float = 0.0,
) -> Case:
    """A fault that lasts, in its usual dose or of a size."""
    plan = Plan(fault, start_s, fault_size=size)
    return Case(name, World("tunnel_entry", sensors, plan, period_s=period_of(plan, PERIOD_S)), Estimator(config))


def _passing(name: str, fault: str, lasts_s: float, scenario: str = "tunnel_entry") -> Case:
    """A fault in its usual dose that passes."""
    return Case(name, World(scenario, plan=Plan(fault, fault_duration_s=lasts_s), lasts_s=lasts_s))


ENTRY = World("tunnel_entry")
TAILS = World("tunnel_entry", SensorSettings(student_dof=3.0))
OUTLIERS = World("tunnel_entry", SensorSettings(outlier_fraction=0.05))
WHEELS = SensorSettings(wheel_speed_std_radps=0.05)
ODOMETER = SensorSettings(speed_std_mps=0.3)
DOPPLER = SensorSettings(speed_std_mps=0.1)

PAPER = Estimator(replace(EXACT, method="particle_em", step=10))
GAUSSIAN = Estimator(replace(EXACT, tail_dof=0.0))
STRANGER = Estimator(knows_track=False)

RAILS = (
    Case("as believed", ENTRY),
    Case("constant adhesion 0.07", World("constant_adhesion")),
    Case("snow", World("snow")),
    Case("0.8 x wet", World("scaled_wet")),
    Case("5 % outliers of 20 m", OUTLIERS),
    Case("Student t, 3 degrees of freedom", TAILS),
    Case("Student t, 2 degrees of freedom", World("tunnel_entry", SensorSettings(student_dof=2.0))),
    Case("30 % of the positions lost", World("tunnel_entry", SensorSettings(dropout_fraction=0.3))),
    Case("patch of 0.45 x wet", World("low_adhesion_patch")),
    Case("steady braking for minutes", World("long_braking")),
    Case("dry rail, the brake limits", World("dry_braking")),
    Case("brake at 60 %", World("weak_brake")),
    Case("brake at 60 %, wheel speeds", World("weak_brake", WHEELS)),
    Case("5 ‰ downhill, unknown", World("grade_unknown"), STRANGER),
    Case(
        "the same, grade_std 0.003", World("grade_unknown"), STRANGER._replace(config=replace(EXACT, grade_std=0.003))
    ),
    Case("10 % heavier", World("overweight")),
    Case("tunnel unknown", ENTRY, STRANGER),
    Case("Gaussian weights: as believed", ENTRY, GAUSSIAN),
    Case("Gaussian weights: Student t, 3", TAILS, GAUSSIAN),
    Case("particles: as believed", ENTRY, PAPER),
    Case("particles: 5 % outliers", OUTLIERS, PAPER),
    Case("particles: Student t, 3", TAILS, PAPER),
    Case("particles: patch", World("low_adhesion_patch"), PAPER),
)
"""The first table; its first case is the one that the others stand beside."""

FAULTS = (
    Case("without a fault", ENTRY),
    _passing("no positions for 1 s", "dropout", 1.0),
    _passing("no positions for 5 s", "dropout", 5.0),
    _passing("no positions for 30 s", "dropout", 30.0),
    _lasting("30 % of the positions lost", "loss"),
    _lasting("5 % outliers of 20 m", "outliers"),
    _passing("10 outliers of 20 m in a row", "burst", 1.0),
    _lasting("Student t, 2 degrees of freedom", "heavy_tails", WHOLE_RUN),
    _lasting("NaN on top", "nan"),
    _lasting("-Inf on top", "inf"),
    _lasting("1e308 on top", "huge"),
    _lasting("no variance told", "zero_variance"),
    _lasting("negative variance, on top", "negative_variance"),
    _lasting("0.3 s late, max_lag_s 0.5", "late", config=replace(EXACT, max_lag_s=0.5)),
    _lasting("0.3 s late, too late", "late"),
    _lasting("sent twice", "duplicates"),
    _passing("stamps 100 s back", "stamps_back", MOMENT_S),
    _passing("stamps 1 h forward", "stamps_forward", MOMENT_S),
    _passing("stamps stand still for 60 s", "clock_pause", 60.0, "snow"),
    _passing("stuck position for 10 s", "stuck", 10.0),
    _lasting("10, 1, 50 Hz in turn, ±30 %", "irregular"),
    _lasting("5 ‰ downhill, unknown", "grade", WHOLE_RUN),
    _lasting("the same, grade_std 0.005", "grade", WHOLE_RUN, replace(EXACT, grade_std=0.005)),
    _lasting("10 % heavier", "mass", WHOLE_RUN),
    _lasting("the same, mass_std 0.1", "mass", WHOLE_RUN, replace(EXACT, mass_std=0.1)),
    _lasting("balise step of 2 m forward", "balise_step"),
    _lasting("balise step of 2 m back", "balise_step", size=-2.0),
    _lasting("balise step of 1 m back", "balise_step", size=-1.0),
    _lasting("another frame", "wrong_frame"),
    _lasting("odometer in km/h", "kmh", BEFORE_BRAKING_S, sensors=ODOMETER),
    _lasting("speeds of 0 of a receiver", "speed_zero", config=replace(EXACT, speed_source="doppler"), sensors=DOPPLER),
    _lasting("half of the wheels stand", "wheels_silent", BEFORE_BRAKING_S, sensors=WHEELS),
    _lasting("all wheels show the same", "wheels_stuck", sensors=WHEELS),
    _lasting("gauge pressure", "gauge", BEFORE_BRAKING_S),
)
"""The second table."""
