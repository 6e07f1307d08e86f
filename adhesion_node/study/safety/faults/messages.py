# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Messages that are lost, late, sent twice, frozen, in other units, or that mislead; an estimator that is restarted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....core.atp.received import StampedCurve, TrainState
from ..case import FREE_S, Case, Message, Noise, Rng
from ..told import curve_of, estimated, in_units, told

Faulty = tuple[Case, list[Message]]

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
