# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Clocks that stand, are set or swing, and stamps ahead of the time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....core.atp.received import StampedCurve, TrainState
from ..case import FREE_S, Case, Message, Rng, Segment
from ..told import estimated, told
from .messages import Faulty, lost

DELAY_S = 0.22
"""Longest time that a message takes, where nothing is said of it."""


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
