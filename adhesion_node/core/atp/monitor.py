# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a monitor makes of one event after the other: a pure step, driven live by a node and without one by a search.

::

    step(rules, known, event, now)  ->  what is known then, and a decision where there was something to decide

A state is judged with the curve of its own stamp. Where one of the two stays away, a watchdog judges with the one
before: after a judgement it lets one of its ticks pass, and once more when a state and a curve first fall apart. So
between two judgements there are at most `TICKS` of its periods.

No trick of time makes what is known younger. The clock counts as the latest time that it has shown; where it goes back
by more, all that was heard is forgotten. A message older than the one before it is not taken in.
"""

from enum import Enum, auto
from typing import NamedTuple

from .config import SupervisionConfig
from .plausibility import Course, out_of_date
from .received import NS_PER_S, StampedCurve, TrainState, Unavailable
from .supervision import Decision, Level, decide, unsafe

TICKS = 3

SILENCE = Unavailable("none received yet; is the estimator running, are topic names and QoS right?")


class Part(Enum):
    """What a refused message was about."""

    STATE = auto()
    CURVE = auto()
    TARGET = auto()


class Refused(NamedTuple):
    """A message that was not understood, and why."""

    what: Part
    why: str


class Tick(Enum):
    """Of a watchdog by one of the two clocks; or a new target, or other new rules, by which is judged at once."""

    ROS = auto()
    STEADY = auto()
    TARGET = auto()
    RULES = auto()


Event = TrainState | StampedCurve | Refused | Tick


class Now(NamedTuple):
    """The time by the ROS clock, and by the machine's own."""

    ros_ns: int
    steady_ns: int


class Rules(NamedTuple):
    """By what is judged. `clock_timeout_s` is how long, by the machine's time, the ROS clock may stand still."""

    supervision: SupervisionConfig
    clock_timeout_s: float


class Known(NamedTuple):
    """What a monitor remembers."""

    moved_ns: int
    """By the machine's clock: when the ROS clock last went on."""
    latest_ns: int = 0
    """The latest time that the ROS clock has shown."""
    state: TrainState | Unavailable = SILENCE
    curve: StampedCurve | Unavailable = SILENCE
    course: Course = Course()
    refused_target: str = ""
    level: Level | None = None
    judged: bool = False
    """Since the last tick of the watchdog."""
    apart: bool = False
    """Whether state and curve are of different stamps."""


def step(rules: Rules, known: Known, event: Event, now: Now) -> tuple[Known, Decision | None]:
    """Take an event in; decide, unless the other half of a pair may still be on its way or nothing has changed."""
    went_back = now.ros_ns < known.latest_ns - rules.supervision.max_ahead_s * NS_PER_S
    known = _at(known, now, went_back)
    due = went_back
    match event:
        case Tick.ROS:
            due, known = due or not known.judged, known._replace(judged=False)
        case Tick.STEADY:
            due = due or stands_s(known, now) > rules.clock_timeout_s
        case Tick.RULES:
            due = True
        case Tick.TARGET:
            due, known = True, known._replace(refused_target="")
        case Refused(Part.TARGET, why):
            due, known = True, known._replace(refused_target=why)
        case _:
            known = _heard(rules.supervision, known, event)
            apart = _apart(known)
            due = due or not apart
            known = known._replace(apart=apart, judged=known.judged or (apart and not known.apart))
    if not due:
        return known, None
    decision = judge(rules, known, now)
    return known._replace(level=decision.level, judged=event is not Tick.ROS), decision


def stands_s(known: Known, now: Now) -> float:
    """How long, by the machine's own clock, the ROS clock has not gone on."""
    return (now.steady_ns - known.moved_ns) / NS_PER_S


def judge(rules: Rules, known: Known, now: Now) -> Decision:
    """Decide by what is known."""
    if (stands := stands_s(known, now)) > rules.clock_timeout_s:
        return unsafe(f"the clock has stood still for {stands:.3g} s; is /clock published?")
    if known.refused_target:
        return unsafe(f"target: refused: {known.refused_target}")
    return decide(rules.supervision, known.latest_ns, known.state, known.curve, known.level or Level.NORMAL)


def _at(known: Known, now: Now, went_back: bool) -> Known:
    if went_back:
        gone_s = (known.latest_ns - now.ros_ns) / NS_PER_S
        lost = Unavailable(f"none since the clock went back by {gone_s:.3g} s; is there one publisher of /clock?")
        return Known(now.steady_ns, now.ros_ns, lost, lost, refused_target=known.refused_target, level=known.level)
    if now.ros_ns > known.latest_ns:
        return known._replace(latest_ns=now.ros_ns, moved_ns=now.steady_ns)
    return known


def _heard(config: SupervisionConfig, known: Known, event: Event) -> Known:
    """Take in what a message says; one from before what is known says nothing new, and is judged by what is."""
    horizon_ns = known.latest_ns + config.max_ahead_s * NS_PER_S
    match event:
        case TrainState():
            newest = known.course.states[-1].t_ns if known.course.states else None
            late = newest is not None and event.t_ns <= newest
            return known if late else _state_heard(config, known, event, event.t_ns > horizon_ns)
        case StampedCurve():
            late = isinstance(known.curve, StampedCurve) and event.t_ns <= known.curve.t_ns
            ahead = event.t_ns > horizon_ns
            curve = Unavailable(out_of_date(config, event.age_s(known.latest_ns))) if ahead else event
            return known if late else known._replace(curve=curve)
        case Refused(Part.STATE, why):
            return known._replace(state=Unavailable(f"refused: {why}"))
        case Refused(Part.CURVE, why):
            return known._replace(curve=Unavailable(f"refused: {why}"))
    return known


def _state_heard(config: SupervisionConfig, known: Known, state: TrainState, ahead: bool) -> Known:
    """Hold a state against those before; one ahead of the clock is none of them, or no later one would be newer."""
    if ahead:
        return known._replace(state=Unavailable(out_of_date(config, state.age_s(known.latest_ns))))
    course = known.course.after(state)
    complaint = course.complaint(config)
    return known._replace(course=course, state=Unavailable(complaint) if complaint else state)


def _apart(known: Known) -> bool:
    state, curve = known.state, known.curve
    return isinstance(state, TrainState) and isinstance(curve, StampedCurve) and state.t_ns != curve.t_ns
