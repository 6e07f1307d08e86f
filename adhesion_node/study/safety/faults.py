# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What may go wrong between the train and its monitor: each fault makes of a case and its messages another one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ...core.atp.monitor import Part, Refused
from ...core.atp.received import StampedCurve, TrainState
from .case import FREE_S, Case, Message, Noise, Rng, Segment, curve_of, estimated, in_units, told

Faulty = tuple[Case, list[Message]]
Fault = Callable[[Rng, Case, list[Message]], Faulty]

FEET, G = 1.0 / 0.3048, 1.0 / 9.80665
UNITS = (
    *((1e-3, 1.0, 1.0), (1.0, 3.6, 1.0), (1.0, 1.0, G), (0.0, 1.0, 1.0), (1.0, 3.6, 3.6), (FEET, 1.0, 1.0)),
    *((1e-3, 3.6, 1.0), (1e-3, 1e-3, 1e-3), (FEET, FEET, FEET), (1.0, 60.0, 3600.0), (100.0, 100.0, 100.0)),
)
"""Factors on the columns of a curve: places, speeds, decelerations. Some of them are consistent."""

MISLED_S, MISLED_LEAST_MPS = 4.0, 20.0
"""Within which a misled monitor must see it, with fresh states of a train that runs at least so fast. A curve all in
feet is consistent: only where the train is so fast it begins elsewhere, however unsure the state is."""
MISLED_NOISE = Noise(2.0, 0.3, None)

UNSURE = Noise(5.0, 5.0, None)
"""Of the first estimate after a start."""

DELAY_S = 0.22
"""Longest time that a message takes, where nothing is said of it."""

BLIND_MPS2 = 3.0
"""By which the standard deviation of the speed grows where no sensor is believed."""


def none(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """Nothing is wrong but the states, by their standard deviations."""
    del rng
    return case, messages


def lost(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """Some messages are lost, and all from a time on."""
    silent_s = rng.uniform(0.3, case.end_s + 1.0)
    return case, [one for one in messages if one.at_s < silent_s and (one.at_s < FREE_S or rng.uniform() > 0.4)]


def late(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """Every message takes its own time, so that they overtake each other."""
    return case, [one if one.at_s < FREE_S else one._replace(at_s=one.at_s + rng.uniform(0.0, 2.5)) for one in messages]


def twice(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """Every message comes again, at once or later."""
    again = [one._replace(at_s=one.at_s + rng.choice([0.0, 1.0]) * rng.uniform(0.0, 1.0)) for one in messages]
    return case, [*messages, *again]


def frozen(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """The last message comes again and again; or a blind estimator moves the train on, less and less sure."""
    from_s = rng.uniform(FREE_S, case.onset_s)
    before = [one for one in messages if one.at_s < from_s]
    states = [one.event for one in before if isinstance(one.event, TrainState)]
    if not states:
        return case, messages
    last = states[-1]
    made = [t_s for t_s in case.made_s if t_s >= from_s]
    if rng.integers(2):
        return case, [*before, *(Message(t_s, event) for t_s in made for event in (last, curve_of(case, last)))]
    gone_on = []
    for t_s in made:
        blind_s = (case.stamp_ns(t_s) - last.t_ns) / 1e9
        state = TrainState(
            case.stamp_ns(t_s),
            last.position_m + last.speed_mps * blind_s,
            last.speed_mps,
            last.position_std_m + last.speed_std_mps * blind_s + BLIND_MPS2 * blind_s**2 / 2.0,
            last.speed_std_mps + BLIND_MPS2 * blind_s,
        )
        gone_on += [Message(t_s, state), Message(t_s, curve_of(case, state))]
    return case, [*before, *gone_on]


def restart(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """The estimator is killed and comes again, at first unsure."""
    from_s = rng.uniform(FREE_S, case.onset_s)
    until_s = from_s + rng.uniform(0.1, 3.0)
    unsure = estimated(case, rng, until_s, UNSURE)
    kept = [one for one in messages if one.at_s < from_s or one.at_s > until_s + 0.3]
    return case, [*kept, Message(until_s, unsure), Message(until_s, curve_of(case, unsure))]


def units(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """From a time on, or ever, the curves are in other units."""
    from_s = rng.choice([0.0, rng.uniform(0.0, case.end_s)])
    if case.train.speed_mps < MISLED_LEAST_MPS:
        return case, messages
    factors = UNITS[rng.integers(len(UNITS))]
    return case, [
        one._replace(event=in_units(one.event, *factors))
        if isinstance(one.event, StampedCurve) and one.at_s >= from_s
        else one
        for one in messages
    ]


def clock(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """The monitor's clock stands and catches up, or is set to another time, for a while or for good, or it swings."""
    from_s = rng.uniform(FREE_S, case.onset_s)
    until_s = from_s + rng.uniform(0.1, 8.0)
    kind = rng.integers(3)
    if kind == 0:
        segments = [Segment(0.0, 0.0), Segment(from_s, None), Segment(until_s, 0.0)]
    elif kind == 1:
        by_s = rng.choice([-1.0, -1.0, 1.0]) * 10.0 ** rng.uniform(-2.0, 1.0)
        segments = [Segment(0.0, 0.0), Segment(from_s, by_s), Segment(until_s, 0.0)]
    else:
        by_s = rng.uniform(0.0, case.config.max_ahead_s)
        swings = [Segment(from_s + 0.05 * number, -by_s * (number % 2)) for number in range(10)]
        segments = [Segment(0.0, 0.0), *swings]
    stated_s = case.stated_s + case.clock_timeout_s + case.check_s
    case = replace(case, clock=tuple(segments), stated_s=stated_s, stated_m=np.inf)
    return lost(rng, case, messages) if rng.integers(2) else (case, messages)


def all_clocks(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """The clocks of all are set: what is stamped from then on is of the new time."""
    from_s, by_s = rng.uniform(FREE_S, case.onset_s), rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-2.0, 1.0)
    clocks = (Segment(0.0, 0.0), Segment(from_s, by_s))
    case = replace(case, shift=((from_s, by_s),), clock=clocks, stated_m=np.inf)
    made = [estimated(case, rng, t_s) for t_s in case.made_s]
    return case, [one for pair in told(case, rng, made) for one in pair]


def target(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """A nearer target, a slower one, one that is moved on and back; or one that is not understood."""
    from_s, by_m = rng.uniform(FREE_S, case.onset_s + 0.5), 10.0 ** rng.uniform(0.0, 3.0)
    kind = rng.integers(4)
    if kind == 0:
        return case.changed(from_s, -by_m), messages
    if kind == 1:
        return case.changed(from_s, target_speed_kmh=case.config.target_speed_kmh * rng.uniform(0.0, 1.0)), messages
    if kind == 2:
        return case.changed(from_s, by_m).changed(from_s + rng.uniform(0.0, 1.5), -by_m), messages
    return case, [*messages, Message(from_s, Refused(Part.TARGET, "points = 0"))]


def settings(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """A brake that takes longer to build up, and the settings that say so; or a lower speed on the line."""
    from_s, before = rng.uniform(FREE_S, case.onset_s + 0.5), case.config
    if rng.integers(2):
        line_kmh = max(case.train.speed(from_s) * 3.6 * rng.uniform(0.5, 1.0), before.target_speed_kmh, 1.0)
        return case.changed(from_s, line_speed_kmh=line_kmh), messages
    slower = {
        "emergency_build_up_s": before.emergency_build_up_s + rng.uniform(0.0, 5.0),
        "traction_cut_off_s": before.traction_cut_off_s + rng.uniform(0.0, 5.0),
    }
    after = replace(before, **slower)
    brake = replace(case.train.brake, pulling_s=after.traction_s, coasting_s=after.coasting_s)
    return case.changed(from_s, brake=brake, **slower), messages


def reboot(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """The monitor is killed and begins anew, with the last curve at once; its silence counts as the emergency brake."""
    del messages
    from_s = rng.uniform(FREE_S, 1.0)
    until_s = from_s + rng.uniform(0.35, 3.0)
    onset_s = until_s + rng.uniform(0.0, 4.0)
    end_s = onset_s + case.stated_s + 0.5
    case = replace(case, onset_s=onset_s, end_s=end_s, down_s=(from_s, until_s)).placed(case.train)
    case = replace(case, made_s=tuple(np.arange(0.0, end_s, case.made_s[1]).tolist()))
    messages = [one for pair in told(case, rng, [estimated(case, rng, t_s) for t_s in case.made_s]) for one in pair]
    curves = [one for one in messages if one.at_s < until_s and isinstance(one.event, StampedCurve)]
    return case, [*messages, *(one._replace(at_s=until_s) for one in curves[-1:])]


def ahead(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """States, curves or both are stamped ahead of the time, and for a while of all: by what the delay hides at most."""
    by_ns = round(10.0 ** rng.uniform(-2.0, 0.7) * 1e9)
    which = ((TrainState,), (StampedCurve,), (TrainState, StampedCurve))[rng.integers(3)]
    from_s, until_s = rng.choice([0.0, case.onset_s]), rng.choice([case.onset_s, np.inf])
    late_s = case.config.max_ahead_s + DELAY_S
    case = replace(case, stated_s=case.stated_s + late_s, end_s=case.end_s + late_s, stated_m=np.inf)
    return case, [
        one._replace(event=one.event._replace(t_ns=one.event.t_ns + by_ns))
        if isinstance(one.event, which) and from_s <= one.at_s < until_s
        else one
        for one in messages
    ]


def worse(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """The rail gets worse, and what tells of it is lost or late; older curves may be used while they are valid."""
    from_s, stated_s = case.onset_s, case.stated_s + case.config.valid_for_s
    further_m = rng.uniform(0.0, 600.0)
    case = replace(
        case,
        worse=(from_s, rng.uniform(0.5, 0.9)),
        targets=tuple(one._replace(place_m=one.place_m + further_m) for one in case.targets),
        stated_s=stated_s,
        end_s=from_s + stated_s + 0.5,
        stated_m=np.inf,
        made_s=tuple(np.arange(0.0, from_s + stated_s + 0.5, case.made_s[1]).tolist()),
    )
    messages = [one for pair in told(case, rng, [estimated(case, rng, t_s) for t_s in case.made_s]) for one in pair]
    return (lost if rng.integers(2) else late)(rng, case, messages)


def misled(rng: Rng, case: Case, messages: list[Message]) -> Faulty:
    """States give no hint of what is wrong: places that stand or fall, places or speeds in other units; also twice."""
    case = case.placed(replace(case.train, speed_mps=max(case.train.speed_mps, MISLED_LEAST_MPS)))
    case = replace(
        case,
        end_s=case.onset_s + MISLED_S + case.stated_s + 0.5,
        stated_s=MISLED_S + case.stated_s,
        stated_m=np.inf,
        noise=MISLED_NOISE,
    )
    period_s = min(case.made_s[1], 0.5)
    case = replace(case, made_s=tuple(number * period_s for number in range(round(case.end_s / period_s))))
    from_s, kind = float(rng.choice([0.0, rng.uniform(0.0, 1.0)])), rng.integers(5)
    made = [
        _spoilt(int(kind), estimated(case, rng, t_s), float(case.train.place(from_s))) if t_s >= from_s else honest
        for t_s in case.made_s
        for honest in (estimated(case, rng, t_s),)
    ]
    messages = [one for pair in told(case, rng, made) for one in pair]
    return twice(rng, case, messages) if rng.integers(2) else (case, messages)


def _spoilt(kind: int, state: TrainState, begun_m: float) -> TrainState:
    """A state in which something is wrong that began at a place."""
    gone_m = state.position_m - begun_m
    return (
        state._replace(position_m=begun_m),
        state._replace(position_m=begun_m - gone_m),
        state._replace(position_m=begun_m - gone_m, speed_mps=0.5),
        state._replace(position_m=begun_m + gone_m / 1000.0),
        state._replace(speed_mps=state.speed_mps / 3.6),
    )[kind]


FAULTS: dict[str, Sequence[Fault]] = {
    "none": (none,),
    "lost": (lost,),
    "late, reordered": (late,),
    "sent twice": (twice,),
    "frozen": (frozen,),
    "estimator restarted": (restart,),
    "curve in other units": (units,),
    "monitor's clock": (clock,),
    "all clocks set": (all_clocks,),
    "monitor restarted": (reboot,),
    "stamps ahead": (ahead,),
    "target": (target,),
    "settings": (settings,),
    "rail gets worse": (worse,),
    "states that mislead": (misled,),
    "several at once": (reboot, lost, late, twice, frozen, restart, units, clock, target, settings),
}
"""The faults of each row of the table; where there are more than one, two of them are drawn."""
