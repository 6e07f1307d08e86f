# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The faults of `study robust` as data: what goes wrong from when to when, and how the estimator is set."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from sim_node.faults.plan import FAULTS, NONE, Plan, faulty_run, period_of
from sim_node.train.messages import Tick
from sim_node.train.scenario import Scenario, find
from sim_node.train.sensors import SensorSettings

from ...core import Config
from ..trial.runs import PERIOD_S

WHOLE_RUN, BEFORE_BRAKING_S = 0.0, 10.0
"""Beginnings of a fault other than the usual one, which comes 10 s after the brakes."""


class Case(NamedTuple):
    """A line of the table."""

    name: str
    plan: Plan
    lasts_s: float = math.inf
    """How long the fault lasts; infinite: to the end of the run."""
    config: Config = Config()
    scenario: str = "tunnel_entry"
    sensors: SensorSettings = SensorSettings()
    run_period_s: float = PERIOD_S
    """Of the simulated run; the messages of a run without a fault come every `PERIOD_S` all the same."""

    @property
    def start_s(self) -> float:
        """When the fault begins."""
        return self.plan.fault_start_s

    @property
    def passes(self) -> bool:
        """Whether it is over before the run is."""
        return math.isfinite(self.lasts_s)

    @property
    def over_s(self) -> float:
        """When it has passed; where it lasts, when it begins."""
        return self.start_s + (self.lasts_s if self.passes else 0.0)

    @property
    def known(self) -> Scenario:
        """What the estimator believes."""
        return find(self.scenario)

    @property
    def true(self) -> Scenario:
        """What the train does."""
        return FAULTS[self.plan.fault].scenario(self.known, self.plan.dose)

    @property
    def without(self) -> Case:
        """B: the same run without the fault; one for all cases that share it."""
        return Case(
            "without a fault",
            Plan(NONE, 0.0),
            config=self.config,
            scenario=self.scenario,
            sensors=self.sensors,
            run_period_s=self.run_period_s,
        )

    def ticks(self, seed: int) -> Iterator[Tick]:
        """Yield the run's ticks."""
        run = faulty_run(self.plan, self.known, self.run_period_s, seed, self.sensors)
        if self.plan.fault != NONE:
            return run
        every = round(PERIOD_S / self.run_period_s)
        return ((truth, sent if index % every == 0 else ()) for index, (truth, sent) in enumerate(run))


def _lasting(name: str, fault: str, start_s: float = Plan().fault_start_s) -> Case:
    """A fault in its usual dose that lasts."""
    plan = Plan(fault, start_s)
    return Case(name, plan, run_period_s=period_of(plan, PERIOD_S))


def _passing(name: str, fault: str, lasts_s: float) -> Case:
    """A fault in its usual dose that passes."""
    return Case(name, Plan(fault, fault_duration_s=lasts_s), lasts_s)


def _jump(name: str, fault: str) -> Case:
    """A fault of one moment."""
    return Case(name, Plan(fault), 0.0)


_ODOMETER = SensorSettings(speed_std_mps=0.3)

CASES = (
    Case("without a fault", Plan(NONE, 0.0)),
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
    _lasting("no variance, on top", "zero_variance"),
    _lasting("negative variance, on top", "negative_variance"),
    _lasting("0.3 s late, max_lag_s 0.5", "late")._replace(config=Config(max_lag_s=0.5)),
    _lasting("0.3 s late, too late", "late"),
    _lasting("sent twice", "duplicates"),
    _jump("stamps 100 s back", "stamps_back"),
    _jump("stamps 1 h forward", "stamps_forward"),
    _passing("stamps stand still for 60 s", "clock_pause", 60.0)._replace(scenario="snow"),
    _passing("stuck position for 10 s", "stuck", 10.0),
    _lasting("10, 1, 50 Hz in turn, ±30 %", "irregular"),
    _lasting("5 ‰ downhill, unknown", "grade", WHOLE_RUN),
    _lasting("the same, grade_std 0.005", "grade", WHOLE_RUN)._replace(config=Config(grade_std=0.005)),
    _lasting("10 % heavier", "mass", WHOLE_RUN),
    _lasting("the same, mass_std 0.1", "mass", WHOLE_RUN)._replace(config=Config(mass_std=0.1)),
    _lasting("balise step of 2 m forward", "balise_step"),
    Case("balise step of 2 m back", Plan("balise_step", fault_size=-2.0)),
    Case("balise step of 1 m back", Plan("balise_step", fault_size=-1.0)),
    _lasting("another frame", "wrong_frame"),
    _lasting("odometer in km/h", "kmh", BEFORE_BRAKING_S)._replace(sensors=_ODOMETER),
    _lasting("gauge pressure", "gauge", BEFORE_BRAKING_S),
)
