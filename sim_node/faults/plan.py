# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The faults by name, as data: what each one does to the run, to the sensors or to their messages, and how much.

    simulator --ros-args -p fault:=dropout -p fault_start_s:=30.0 -p fault_duration_s:=5.0

The true run keeps its seed: with and without a fault of the sensors the train does the same.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from adhesion_node.core.physics.track import Grade, Track
from adhesion_node.core.setting import check_settings, setting

from ..train.plant import Truth
from ..train.run import run
from ..train.scenario import Scenario
from ..train.sensors import SensorSettings, Tick, messages_of
from . import streams
from .streams import Change, Dose

NONE = "none"

_LINE_M = 50e3
"""Longer than any run."""


def _same(given: Any, *_others: object) -> Any:
    return given


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault; `size` is the meaning of its dose's size, with the unit."""

    description: str
    dose: Dose = field(default_factory=Dose)
    size: str = ""
    stream: Change = _same
    scenario: Callable[[Scenario, Dose], Scenario] = _same
    sensors: Callable[[SensorSettings, Dose], SensorSettings] = _same
    rate_hz: float | None = None
    """Rate of the run where the fault needs one of its own."""
    of: str = ""
    """The setting by which the sensor is there that the fault is of, where it may be absent."""


def _graded(scenario: Scenario, dose: Dose) -> Scenario:
    slope = Grade(0.0, _LINE_M, -dose.size * _LINE_M)
    return replace(scenario, track=Track((*scenario.track.sections, slope), scenario.track.train_length_m))


def _loaded(scenario: Scenario, dose: Dose) -> Scenario:
    return replace(scenario, train=replace(scenario.train, mass_kg=dose.size * scenario.train.mass_kg))


def _heavy_tailed(settings: SensorSettings, dose: Dose) -> SensorSettings:
    return replace(settings, student_dof=dose.size)


_RARELY = Dose(share=0.1)

_SPEED, _WHEELS = "speed_std_mps", "wheel_speed_std_radps"

FAULTS: Mapping[str, Fault] = {
    NONE: Fault("all is well"),
    "dropout": Fault("no positions", Dose(duration_s=5.0), stream=streams.lost),
    "loss": Fault("positions lost at random", Dose(share=0.3), stream=streams.lost),
    "outliers": Fault("positions far off", Dose(share=0.05, size=20.0), "m", streams.outlying),
    "burst": Fault("positions far off in a row", Dose(duration_s=1.0, size=20.0), "m", streams.outlying),
    "heavy_tails": Fault(
        "position noise of Student's t, the whole run", Dose(size=2.0), "degrees of freedom", sensors=_heavy_tailed
    ),
    "nan": Fault("additional messages with NaN", _RARELY, stream=streams.bad(value=float("nan"))),
    "inf": Fault("additional messages with -Inf", _RARELY, stream=streams.bad(value=float("-inf"))),
    "huge": Fault("additional messages with 1e308", _RARELY, stream=streams.bad(value=1e308)),
    "zero_variance": Fault("positions with an empty covariance", _RARELY, stream=streams.undeclared),
    "negative_variance": Fault(
        "additional positions with a negative variance", _RARELY, stream=streams.bad(variance=-0.25)
    ),
    "late": Fault("messages that leave late", Dose(share=0.1, size=0.3), "s", streams.late),
    "duplicates": Fault("messages sent twice", Dose(share=0.1), stream=streams.duplicated),
    "stamps_back": Fault("stamps that jump back", Dose(size=-100.0), "s", streams.restamped),
    "stamps_forward": Fault("stamps that jump forward", Dose(size=3600.0), "s", streams.restamped),
    "clock_pause": Fault("stamps that stand still", Dose(duration_s=60.0), stream=streams.paused),
    "stuck": Fault("one position again and again, freshly stamped", Dose(duration_s=10.0), stream=streams.stuck),
    "irregular": Fault(
        "10, 1 and 50 Hz in turn, unevenly",
        Dose(duration_s=10.0, size=0.3),
        "part of the period",
        streams.irregular,
        rate_hz=streams.FINE_HZ,
    ),
    "grade": Fault("a downhill grade, the whole run", Dose(size=0.005), "m/m", scenario=_graded),
    "mass": Fault("a train of another mass", Dose(size=1.1), "times its mass", scenario=_loaded),
    "balise_step": Fault("positions moved from one on", Dose(size=2.0), "m", streams.shifted),
    "wrong_frame": Fault("positions in another frame", stream=streams.misframed),
    "kmh": Fault("speeds in km/h", stream=streams.in_kmh, of=_SPEED),
    "speed_zero": Fault("speeds of 0, as of a receiver without satellites", stream=streams.standing, of=_SPEED),
    "wheels_silent": Fault("wheels that show a standstill", Dose(size=0.5), "of the axles", streams.silent, of=_WHEELS),
    "wheels_stuck": Fault(
        "one speed of each wheel again and again, freshly stamped", stream=streams.wheels_stuck, of=_WHEELS
    ),
    "gauge": Fault("gauge for absolute pressures", stream=streams.gauge),
}
"""The faults by name."""


@dataclass(frozen=True, slots=True)
class Plan:
    """A fault and how much of it: from `start_s` of the run; 0 for the rest keeps the fault's own dose.

    Raises ValueError naming the value that does not fit.
    """

    fault: str = setting(NONE, "What goes wrong", choices=tuple(FAULTS))
    fault_start_s: float = setting(30.0, "Time of the run at which the fault begins", "s", 0.0, 1e6)
    fault_duration_s: float = setting(0.0, "How long the fault lasts; 0 = as it is usual", "s", 0.0, 1e6)
    fault_share: float = setting(0.0, "Share of the samples that it meets; 0 = as it is usual", "", 0.0, 1.0)
    fault_size: float = setting(0.0, "Its size in the unit of the fault; 0 = as it is usual", "", -1e6, 1e6)

    def __post_init__(self) -> None:
        check_settings(self, "")

    @property
    def dose(self) -> Dose:
        """The fault's own dose with what is given in its place."""
        own = FAULTS[self.fault].dose
        return Dose(
            self.fault_start_s,
            self.fault_duration_s or own.duration_s,
            self.fault_share or own.share,
            self.fault_size or own.size,
        )


def faulty_run(plan: Plan, scenario: Scenario, period_s: float, seed: int, settings: SensorSettings) -> Iterator[Tick]:
    """Yield the ticks of a run with its fault.

    The fault draws from a stream of its own, so that all else is as without it. Raises ValueError as `run`.
    """
    fault, dose = FAULTS[plan.fault], plan.dose
    sensors = fault.sensors(settings, dose)
    samples = run(fault.scenario(scenario, dose), period_s, seed, sensors)
    ticks = ((truth, messages_of(reading, sensors)) for truth, reading in samples)
    # `run` has the first three children of the seed.
    rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(4)[3])
    return fault.stream(ticks, dose, rng)


def told(plan: Plan) -> list[tuple[float, str]]:
    """When the fault begins and, where it does, ends, s of the run, in words; one of the whole run has neither.

    >>> told(Plan(fault="dropout", fault_start_s=4.0))
    [(4.0, 'dropout begins: no positions'), (9.0, 'dropout ends')]
    """
    fault, dose = FAULTS[plan.fault], plan.dose
    if plan.fault == NONE or fault.stream is _same:
        return []
    ends = [(dose.start_s + dose.duration_s, f"{plan.fault} ends")] if math.isfinite(dose.duration_s) else []
    return [(dose.start_s, f"{plan.fault} begins: {fault.description}"), *ends]


def active(plan: Plan, truth: Truth) -> bool:
    """Whether the fault is at work at this sample."""
    return plan.fault != NONE and (FAULTS[plan.fault].stream is _same or plan.dose.now(truth))


def period_of(plan: Plan, period_s: float) -> float:
    """Return the period of the run: the fault's own where it needs one, else `period_s`."""
    rate_hz = FAULTS[plan.fault].rate_hz
    return 1.0 / rate_hz if rate_hz else period_s
