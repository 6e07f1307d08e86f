# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Supervision of a target: the present speed against the limits of `etcs`, and what has to be done.

The statuses are those of SUBSET-026-3, section 3.13.10, with the intervention told apart by brake. Whatever is
missing, refused, old or not covered by the curve counts as the worst case: no distance is left.

Simplified: an intervention, the emergency brake's too, ends where the permitted speed is kept again (as with
Q_NVEMRRLS = 1), and from the indication there is a way back to normal.
"""

from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import NamedTuple

import numpy as np

from ..physics.braking import BrakingCurve
from . import limits as etcs
from . import plausibility
from .config import SupervisionConfig
from .received import StampedCurve, TrainState, Unavailable


class Severity(IntEnum):
    """How bad a status is, numbered as in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


class Level(Enum):
    """What the driver or the brake has to do: the message for people and how bad that is. The order is that of need."""

    NORMAL = ("nothing to do", Severity.OK)
    INDICATION = ("a braking point is near: be ready to brake", Severity.OK)
    OVERSPEED = ("above the permitted speed: brake", Severity.WARN)
    WARNING = ("shortly before an intervention: brake now, traction off", Severity.WARN)
    SERVICE_BRAKE = ("service brake intervention", Severity.ERROR)
    EMERGENCY_BRAKE = ("emergency brake intervention", Severity.ERROR)

    def __init__(self, message: str, severity: Severity) -> None:
        self.message = message
        self.severity = severity


LEVELS = tuple(Level)
"""From the least to the most urgent."""

RELEASE_MPS = 0.3
"""As much as a train may gain between two states: without it a level would come and go."""


class Reading(NamedTuple):
    """The train against the limits: speeds in m/s, distances in m."""

    distance_to_target_m: float
    """From the estimated front end, negative beyond the target."""
    margin_m: float
    """How far the train may go on at its speed until the emergency brake intervenes."""
    braking_distance_m: float
    """Along the braking curve to the target speed, brakes built up."""
    permitted_mps: float
    warning_mps: float
    sbi_mps: float
    ebi_mps: float
    indication_mps: float
    supervised_mps: float
    """How fast the train may be, which is held against the limits."""


@dataclass(frozen=True, slots=True)
class Decision:
    """The level, its reason, and the numbers behind it as far as they are known."""

    level: Level
    message: str
    severity: Severity
    reading: Reading | None = None
    curve_age_s: float | None = None
    state_age_s: float | None = None

    def numbers(self, config: SupervisionConfig) -> dict[str, str]:
        """Return the level and every number behind it; a number that is not known has no key."""
        values = {
            "target_position_m": config.target_position_m,
            "target_speed_mps": config.target_speed_mps,
            "curve_age_s": self.curve_age_s,
            "state_age_s": self.state_age_s,
            **({} if self.reading is None else self.reading._asdict()),
        }
        known = {key: f"{value:.3f}" for key, value in values.items() if value is not None}
        return {"level": self.level.name, **known}


def decide(
    config: SupervisionConfig,
    now_ns: int,
    state: TrainState | Unavailable,
    braking: StampedCurve | Unavailable,
    previous: Level = Level.NORMAL,
) -> Decision:
    """Decide on the level at time `now_ns`, which `previous` was decided before.

    The train is judged as far ahead and as fast as it may be (`TrainState.at_most`). What is not plausible is unsafe
    like what is missing.
    """
    ages = {"state_age_s": state.age_s(now_ns), "curve_age_s": braking.age_s(now_ns)}
    if isinstance(state, Unavailable):
        return unsafe(f"state: {state.why}", **ages)
    if isinstance(braking, Unavailable):
        return unsafe(f"braking curve: {braking.why}", **ages)
    if complaint := plausibility.of_state(config, state, now_ns):
        return unsafe(f"state {complaint}", **ages)
    if complaint := plausibility.of_curve(config, braking, state, now_ns):
        return unsafe(f"braking curve {complaint}", **ages)
    reading = read(config, braking.curve, state, now_ns)
    level = held(previous, reading)
    return Decision(level, level.message, level.severity, reading, **ages)


def read(config: SupervisionConfig, braking: BrakingCurve, state: TrainState, now_ns: int) -> Reading:
    """Hold a train against the limits."""
    front, fastest = state.at_most(config, now_ns)
    expected = state.position_m + state.speed_mps * max(state.age_s(now_ns), 0.0)
    safe_distance = np.array([config.target_position_m - config.position_margin_m - front])
    speed = np.array([fastest])
    limits = etcs.speeds(config, braking, safe_distance)
    needed = etcs.distances(config, braking, speed)
    braked = etcs.distance_between(braking, speed, config.target_speed_mps)
    return Reading(
        distance_to_target_m=config.target_position_m - expected,
        margin_m=float(safe_distance[0] - needed.ebi[0]),
        braking_distance_m=max(float(braked[0]), 0.0),
        permitted_mps=float(limits.permitted[0]),
        warning_mps=float(limits.warning[0]),
        sbi_mps=float(limits.sbi[0]),
        ebi_mps=float(limits.ebi[0]),
        indication_mps=float(limits.indication[0]),
        supervised_mps=fastest,
    )


def measured(reading: Reading, more_mps: float = 0.0) -> Level:
    """Return the level of the speed supervised and `more_mps`: that of the highest limit it exceeds."""
    limits = (reading.indication_mps, reading.permitted_mps, reading.warning_mps, reading.sbi_mps, reading.ebi_mps)
    return LEVELS[sum(reading.supervised_mps + more_mps > limit for limit in limits)]


def held(previous: Level, reading: Reading) -> Level:
    """Return the level of a reading, or one still held.

    A level is left where its limit is kept by `RELEASE_MPS`; one above INDICATION not before the permitted speed is
    kept again (SUBSET-026-3, 3.13.10, table 10).
    """
    now, released = measured(reading), measured(reading, RELEASE_MPS)
    now = max(now, min(previous, released, key=LEVELS.index), key=LEVELS.index)
    if LEVELS.index(now) <= LEVELS.index(Level.INDICATION):
        return now
    return max(previous, now, key=LEVELS.index)


def unsafe(why: str, curve_age_s: float | None = None, state_age_s: float | None = None) -> Decision:
    """Decide on the emergency brake because something is missing that a safe distance would need."""
    message = f"no safe distance is known, emergency brake: {why}"
    return Decision(Level.EMERGENCY_BRAKE, message, Severity.ERROR, None, curve_age_s, state_age_s)
