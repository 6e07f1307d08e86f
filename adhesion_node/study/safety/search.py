# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Cases by number, and how long and how far each leaves a train that needs more way than it has left."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...core.atp.monitor import Event, Known, Now, Rules, Tick, step
from ...core.atp.received import NS_PER_S
from ...core.atp.supervision import Level
from ...core.physics.train import Array
from .case import EPOCH_NS, FREE_S, Case, Target
from .drawn import draw
from .faults.table import FAULTS
from .told import estimated, told
from .truth import allowed

GRID_S = 0.01
"""At which times the truth is looked at."""

BEYOND_S = 0.5
"""How long a case goes on beyond the time stated."""

AFTER_S = 0.4
"""How long a case goes on once it is told: whether it is taken back."""


class Outcome(NamedTuple):
    """Of a case."""

    hazardous: bool
    """The train needed more way than it had left."""
    free: bool
    """It had been let go before, towards the target that makes it so."""
    untold_s: float
    """Longest time for which it was not told then."""
    excess_m: float
    """Most way that it needed above what was left in such a time; 0 where there was none."""
    judged_m: float
    """The same at the moments when the monitor judged, and let the train go on."""
    stated_s: float
    """How long it may be untold."""
    counterexample: bool
    """The monitor took longer, or more way was missing, than is stated."""


def case_of(seed: int, number: int) -> Case:
    """The case of a number: its row in turn, all else at random."""
    rng = np.random.default_rng([seed, number])
    name = list(FAULTS)[number % len(FAULTS)]
    case = draw(rng)
    messages = [one for pair in told(case, rng, [estimated(case, rng, t_s) for t_s in case.made_s]) for one in pair]
    of_row = FAULTS[name]
    for index in sorted(rng.permutation(len(of_row))[:2]):
        case, messages = of_row[index](rng, case, messages)
    end_s = max(case.end_s, case.onset_s + case.stated_s + BEYOND_S)
    return replace(case, messages=tuple(sorted(messages, key=lambda one: one.at_s)), end_s=end_s, faults=(name,))


def happenings(case: Case) -> Iterator[tuple[float, Event]]:
    """Yield all that happens to the monitor in the order of time."""
    events: list[tuple[float, Event]] = [(one.at_s, one.event) for one in case.messages]
    events += [(later.from_s, _told_of(earlier, later)) for earlier, later in pairwise(case.targets)]
    events += [(t_s, Tick.STEADY) for t_s in np.arange(0.37 * case.check_s, case.end_s, case.check_s).tolist()]
    ends = [*(segment.from_s for segment in case.clock[1:]), case.end_s]
    for segment, end_s in zip(case.clock, ends, strict=True):
        if segment.ahead_s is not None:  # a timer begins anew where the clock is set
            events += [
                (t_s, Tick.ROS) for t_s in np.arange(segment.from_s + case.check_s, end_s, case.check_s).tolist()
            ]
    return (event for event in sorted(events, key=lambda event: event[0]) if event[0] < case.end_s)


def clock_ns(case: Case, t_s: float) -> int:
    """What the monitor's clock shows."""
    segment = next(one for one in reversed(case.clock) if one.from_s <= t_s)
    if segment.ahead_s is None:
        return EPOCH_NS + round(segment.from_s * NS_PER_S)
    return EPOCH_NS + round((t_s + segment.ahead_s) * NS_PER_S)


def decided(case: Case) -> tuple[list[tuple[float, bool]], float]:
    """When the monitor decided, and whether on the emergency brake; and until when, no further than is needed."""
    known, said, (down_s, up_s) = Known(0), [(0.0, True)], case.down_s
    configs = [(target.from_s, case.supervised(target)) for target in case.targets]
    braked_s: float | None = 0.0
    """Since when it has been braked without a pause."""
    for t_s, event in happenings(case):
        if down_s <= t_s < up_s:
            known = Known(round(up_s * NS_PER_S))
            if braked_s is None:
                braked_s = down_s
                said.append((down_s, True))
            continue
        config = next(config for from_s, config in reversed(configs) if from_s <= t_s)
        now = Now(clock_ns(case, t_s), round(t_s * NS_PER_S))
        known, decision = step(Rules(config, case.clock_timeout_s), known, event, now)
        if decision is not None:
            said.append((t_s, decision.level is Level.EMERGENCY_BRAKE))
            if not said[-1][1]:
                braked_s = None
            elif braked_s is None:
                braked_s = t_s
        if braked_s is not None and t_s > max(braked_s, case.onset_s, up_s) + AFTER_S:
            return said, t_s
    return said, case.end_s


def outcome(case: Case) -> Outcome:
    """Let a monitor live through a case, and hold what it says against the truth."""
    said, until_s = decided(case)
    t_s = np.arange(0.0, until_s, GRID_S)
    times, braked = np.array([at_s for at_s, _ in said]), np.array([one for _, one in said])
    excess_m = _excess(case, t_s)
    hazard = excess_m > 0.0
    untold = hazard & ~braked[np.searchsorted(times, t_s, side="right") - 1]
    ends = np.flatnonzero(np.diff(np.concatenate(([False], untold, [False])).astype(np.int8)))
    longest = float(np.max(ends[1::2] - ends[::2], initial=0)) * GRID_S
    judged_m = float(np.max(_excess(case, times[~braked]), initial=0.0))
    return Outcome(
        bool(hazard.any()),
        not braked[times > FREE_S].all(),
        longest,
        float(np.max(excess_m[untold], initial=0.0)),
        judged_m,
        case.stated_s,
        longest > case.stated_s + GRID_S or judged_m > case.stated_m,
    )


def _excess(case: Case, t_s: Array) -> Array:
    """Way, m, that the train needs at each time above what is left: to the target, and none above the line's speed."""
    excess = np.full(len(t_s), -np.inf)
    begins = np.array([*(target.from_s for target in case.targets), np.inf])
    for index, target in enumerate(case.targets):
        settings = {"target_speed_kmh": case.config.target_speed_kmh} | dict(target.changes)
        brake = target.brake or case.train.brake
        for worse in (False, True):
            now = (t_s >= begins[index]) & (t_s < begins[index + 1]) & ((t_s >= case.worse[0]) == worse)
            if now.any():
                speed, here = case.train.speed(t_s[now]), brake.times(case.worse[1]) if worse else brake
                needed = here.needed(speed, allowed(settings["target_speed_kmh"] / 3.6))
                excess[now] = case.train.place(t_s[now]) + needed - target.place_m
                if "line_speed_kmh" in settings:
                    on_the_line = here.needed(speed, allowed(settings["line_speed_kmh"] / 3.6))
                    excess[now] = np.maximum(excess[now], on_the_line)
    return excess


def _told_of(earlier: Target, later: Target) -> Tick:
    """What a node makes of other settings."""
    same = earlier.place_m == later.place_m and "target_speed_kmh" not in later.changes
    return Tick.RULES if same else Tick.TARGET
