"""Supervision of a target: how much distance is left before the brakes must be on, and what follows from it.

    margin = target - (position now + reaction distance + braking distance)

    position now       the last position, moved on at the last speed for as long as the state is old
    reaction distance  speed x reaction time: the train runs on until the brakes are built up
    braking distance   along the braking curve from the present speed down to the target speed

Whatever is missing, refused, old or not covered by the curve counts as the worst case.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import NamedTuple

from .braking import BrakingCurve, distance_to
from .train import KMH

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
    """What the driver or the brake has to do: the message for people and how bad that is."""

    NORMAL = ("nothing to do", Severity.OK)
    WARNING = ("the braking point is near: be ready to brake", Severity.WARN)
    SERVICE_BRAKE = ("the braking point is reached: service brake", Severity.ERROR)
    EMERGENCY_BRAKE = ("no distance is left: emergency brake", Severity.ERROR)

    def __init__(self, message: str, severity: Severity) -> None:
        self.message = message
        self.severity = severity


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


@dataclass(frozen=True, slots=True)
class Target:
    """The target and the margins before it. Raises ValueError naming the value that is out of range."""

    target_position_m: float = 6000.0
    target_speed_kmh: float = 100.0
    warning_margin_m: float = 300.0
    service_margin_m: float = 100.0
    reaction_time_s: float = 1.5
    """From the decision until the brakes are built up."""
    valid_for_s: float = 2.0
    """Age up to which a curve and a state are used."""

    def __post_init__(self) -> None:
        if not math.isfinite(self.target_position_m):
            raise ValueError(f"target_position_m = {self.target_position_m!r}: give a finite position")
        for name in ("target_speed_kmh", "service_margin_m", "reaction_time_s", "valid_for_s"):
            value = getattr(self, name)
            if not 0 <= value < math.inf:
                raise ValueError(f"{name} = {value!r}: give a finite number of at least 0")
        if not self.service_margin_m <= self.warning_margin_m < math.inf:
            least = f"service_margin_m = {self.service_margin_m!r}"
            raise ValueError(f"warning_margin_m = {self.warning_margin_m!r}: give at least {least}")

    @property
    def target_speed_mps(self) -> float:
        """The target speed in m/s."""
        return self.target_speed_kmh * KMH


@dataclass(frozen=True, slots=True)
class Decision:
    """The level, its reason, and the numbers behind it as far as they are known (metres, seconds)."""

    level: Level
    message: str
    severity: Severity
    margin_m: float | None = None
    braking_distance_m: float | None = None
    reaction_distance_m: float | None = None
    curve_age_s: float | None = None
    state_age_s: float | None = None


def decide(
    target: Target, now_ns: int, state: TrainState | Unavailable, braking: StampedCurve | Unavailable
) -> Decision:
    """Decide on the level at time `now_ns`.

    A train at or below the target speed is NORMAL wherever it is, as long as state and curve are good. A speed
    above the curve's first one is braked at the curve's weakest deceleration down to it; one that lies more than
    10 km/h above is not covered, which is unsafe like a missing curve.
    """
    ages = {"state_age_s": _age_s(state, now_ns), "curve_age_s": _age_s(braking, now_ns)}
    if isinstance(state, Unavailable):
        return _unsafe(f"state: {state.why}", ages)
    if isinstance(braking, Unavailable):
        return _unsafe(f"braking curve: {braking.why}", ages)
    for what, stamped in (("state", state), ("braking curve", braking)):
        late = _out_of_date(stamped, now_ns, target.valid_for_s)
        if late:
            return _unsafe(f"{what} {late}", ages)
    uncovered = _uncovered(braking.curve, state.speed_mps, target.target_speed_mps)
    if uncovered:
        return _unsafe(f"braking curve {uncovered}", ages)
    return _measure(target, now_ns, state, braking.curve, ages)


def _measure(
    target: Target, now_ns: int, state: TrainState, braking: BrakingCurve, ages: dict[str, float | None]
) -> Decision:
    speed, wanted = state.speed_mps, target.target_speed_mps
    travelled = speed * max(now_ns - state.t_ns, 0) / NS_PER_S
    reaction = speed * target.reaction_time_s
    distance = braking_distance(braking, speed, wanted)
    margin = target.target_position_m - (state.position_m + travelled + reaction + distance)
    level = Level.NORMAL if speed <= wanted else _level(target, margin)
    return Decision(level, level.message, level.severity, margin, distance, reaction, **ages)


def _level(target: Target, margin_m: float) -> Level:
    if margin_m <= 0:
        return Level.EMERGENCY_BRAKE
    if margin_m <= target.service_margin_m:
        return Level.SERVICE_BRAKE
    return Level.WARNING if margin_m <= target.warning_margin_m else Level.NORMAL


def braking_distance(braking: BrakingCurve, speed_mps: float, target_mps: float) -> float:
    """Distance, m, along the curve from one speed to another; 0 when already at or below the target speed."""
    if speed_mps <= target_mps:
        return 0.0
    return _along(braking, target_mps) - _along(braking, speed_mps)


def _along(braking: BrakingCurve, speed_mps: float) -> float:
    """Place on the curve, m, where the train has a speed; before its start (negative) when faster than its first."""
    first = float(braking.speed_mps[0])
    if speed_mps <= first:
        return distance_to(braking, speed_mps)
    return (first**2 - speed_mps**2) / (2 * float(braking.deceleration_mps2.min()))


def _uncovered(braking: BrakingCurve, speed_mps: float, target_mps: float) -> str:
    first, last = float(braking.speed_mps[0]), float(braking.speed_mps[-1])
    if speed_mps > max(first, target_mps) + MAX_EXCESS_MPS:
        return f"begins at {first / KMH:.1f} km/h but the train runs at {speed_mps / KMH:.1f} km/h"
    if speed_mps > target_mps and last > target_mps + SPEED_TOLERANCE_MPS:
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


def _unsafe(why: str, ages: dict[str, float | None]) -> Decision:
    return Decision(Level.EMERGENCY_BRAKE, f"no safe distance is known, emergency brake: {why}", Severity.STALE, **ages)
