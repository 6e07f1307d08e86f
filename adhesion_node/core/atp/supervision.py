# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

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
from ..physics.train import KMH
from . import limits as etcs
from .config import SupervisionConfig

MAX_EXCESS_MPS = 10 * KMH
"""How far a speed may lie above the curve's first: a train gains less while a curve is valid."""

SPEED_TOLERANCE_MPS = 0.01
"""A curve that ends so close to the target speed reaches it: km/h and m/s are rounded differently."""

NS_PER_S = 1e9


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


class TrainState(NamedTuple):
    """Where the train is, m along the track, and how fast, m/s."""

    t_ns: int
    position_m: float
    speed_mps: float


class StampedCurve(NamedTuple):
    """A braking curve and the time it was made for."""

    t_ns: int
    curve: BrakingCurve


class Unavailable(NamedTuple):
    """Stands for a state or a curve that is not there; `why` says what was received instead and the remedy."""

    why: str


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


@dataclass(frozen=True, slots=True)
class Decision:
    """The level, its reason, and the numbers behind it as far as they are known."""

    level: Level
    message: str
    severity: Severity
    reading: Reading | None = None
    curve_age_s: float | None = None
    state_age_s: float | None = None


def decide(
    config: SupervisionConfig,
    now_ns: int,
    state: TrainState | Unavailable,
    braking: StampedCurve | Unavailable,
    previous: Level = Level.NORMAL,
) -> Decision:
    """Decide on the level at time `now_ns`, which `previous` was decided before.

    A state that is old is moved on at its speed. A speed that lies more than 10 km/h above the curve's first one is
    not covered, which is unsafe like a missing curve.
    """
    ages = {"state_age_s": _age_s(state, now_ns), "curve_age_s": _age_s(braking, now_ns)}
    if isinstance(state, Unavailable):
        return unsafe(f"state: {state.why}", **ages)
    if isinstance(braking, Unavailable):
        return unsafe(f"braking curve: {braking.why}", **ages)
    for what, stamped in (("state", state), ("braking curve", braking)):
        late = _out_of_date(stamped, now_ns, config.valid_for_s)
        if late:
            return unsafe(f"{what} {late}", **ages)
    uncovered = _uncovered(braking.curve, state.speed_mps, config.target_speed_mps)
    if uncovered:
        return unsafe(f"braking curve {uncovered}", **ages)
    travelled = state.speed_mps * max(now_ns - state.t_ns, 0) / NS_PER_S
    reading = read(config, braking.curve, state.position_m + travelled, state.speed_mps)
    level = held(previous, measured(reading, state.speed_mps))
    return Decision(level, level.message, level.severity, reading, ages["curve_age_s"], ages["state_age_s"])


def read(config: SupervisionConfig, braking: BrakingCurve, position_m: float, speed_mps: float) -> Reading:
    """Hold a train at a place, m, with a speed, m/s, against the limits."""
    distance = config.target_position_m - position_m
    safe_distance = np.array([distance - config.position_margin_m])
    speed = np.array([max(speed_mps, 0.0)])
    limits = etcs.speeds(config, braking, safe_distance)
    needed = etcs.distances(config, braking, speed)
    braked = etcs.distance_between(braking, speed, config.target_speed_mps)
    return Reading(
        distance_to_target_m=distance,
        margin_m=float(safe_distance[0] - needed.ebi[0]),
        braking_distance_m=max(float(braked[0]), 0.0),
        permitted_mps=float(limits.permitted[0]),
        warning_mps=float(limits.warning[0]),
        sbi_mps=float(limits.sbi[0]),
        ebi_mps=float(limits.ebi[0]),
        indication_mps=float(limits.indication[0]),
    )


def measured(reading: Reading, speed_mps: float) -> Level:
    """Return the level of a speed: that of the highest limit it exceeds."""
    limits = (reading.indication_mps, reading.permitted_mps, reading.warning_mps, reading.sbi_mps, reading.ebi_mps)
    return LEVELS[sum(speed_mps > limit for limit in limits)]


def held(previous: Level, now: Level) -> Level:
    """Keep a level above INDICATION until the permitted speed is kept again (SUBSET-026-3, 3.13.10, table 10)."""
    if LEVELS.index(now) <= LEVELS.index(Level.INDICATION):
        return now
    return max(previous, now, key=LEVELS.index)


def unsafe(why: str, curve_age_s: float | None = None, state_age_s: float | None = None) -> Decision:
    """Decide on the emergency brake because something is missing that a safe distance would need."""
    message = f"no safe distance is known, emergency brake: {why}"
    return Decision(Level.EMERGENCY_BRAKE, message, Severity.STALE, None, curve_age_s, state_age_s)


def _uncovered(braking: BrakingCurve, speed_mps: float, target_mps: float) -> str:
    first, last = float(braking.speed_mps[0]), float(braking.speed_mps[-1])
    if speed_mps > max(first, target_mps) + MAX_EXCESS_MPS:
        return f"begins at {first / KMH:.1f} km/h but the train runs at {speed_mps / KMH:.1f} km/h"
    if last > target_mps + SPEED_TOLERANCE_MPS:
        return f"ends at {last / KMH:.1f} km/h, above the target speed {target_mps / KMH:.1f} km/h: make it longer"
    return ""


def _out_of_date(stamped: TrainState | StampedCurve, now_ns: int, valid_for_s: float) -> str:
    age = (now_ns - stamped.t_ns) / NS_PER_S
    if age > valid_for_s:
        return f"expired: {age:.3g} s old, valid for {valid_for_s:g} s; is the estimator running, use_sim_time right?"
    if age < -valid_for_s:
        return f"is stamped {-age:.3g} s ahead of the clock; is use_sim_time right?"
    return ""


def _age_s(stamped: TrainState | StampedCurve | Unavailable, now_ns: int) -> float | None:
    return None if isinstance(stamped, Unavailable) else (now_ns - stamped.t_ns) / NS_PER_S
