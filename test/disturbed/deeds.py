# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What is done to a line and undone, by a script, and what comes of it."""

from __future__ import annotations

import random
import signal
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import NamedTuple

from adhesion_node.wire import topics

from .line import Line

TOLD_S, RECOVERED_S, PAUSE_S = 10.0, 120.0, 10.0
"""Longest times. A state is valid for 2 s, /clock may stand for 2 s, and this machine may be busy."""


class Deed(NamedTuple):
    """What is done and undone. `unsafe`: the monitor has to say so, `mute`: it cannot."""

    do: Callable[[Line], None]
    undo: Callable[[Line], None] = lambda line: None
    unsafe: bool = True
    mute: bool = False


def stop(name: str) -> Callable[[Line], None]:
    return lambda line: getattr(line, name).send(signal.SIGSTOP)


def go_on(name: str) -> Callable[[Line], None]:
    return lambda line: getattr(line, name).send(signal.SIGCONT)


DEEDS = {
    "kill -9 estimator": Deed(lambda line: line.estimator.kill(), lambda line: line.estimator.begin()),
    "stop estimator": Deed(stop("estimator"), go_on("estimator")),
    "kill -9 simulator, clock on by 1000 s": Deed(lambda line: line.simulator.kill(), lambda line: line.again(1000.0)),
    "kill -9 simulator, clock back by 300 s": Deed(lambda line: line.simulator.kill(), lambda line: line.again(-300.0)),
    "stop simulator, and /clock": Deed(stop("simulator"), go_on("simulator")),
    "kill -9 monitor": Deed(lambda line: line.monitor.kill(), lambda line: line.monitor.begin(), mute=True),
    "stop monitor": Deed(stop("monitor"), go_on("monitor"), mute=True),
    "kill -9 recorder": Deed(Line.kill_recorder, Line.begin_recorder, unsafe=False),
    "stop recorder": Deed(stop("recorder"), go_on("recorder"), unsafe=False),
    "another /clock, 50 s back": Deed(lambda line: line.set_clock(-50.0)),
    "another /clock, 50 s on": Deed(lambda line: line.set_clock(50.0)),
    "500 positions/s, not finite": Deed(
        lambda line: line.flood(topics.POSITION, line.message(topics.POSITION), 3.0, 500.0), unsafe=False
    ),
    "200 states/s, not finite": Deed(lambda line: line.flood(topics.STATE, line.message(topics.STATE), 3.0, 200.0)),
    "publishers come and go": Deed(lambda line: line.flap(20), unsafe=False),
}


class Done(NamedTuple):
    """What came of a deed, s; None where it was not to be."""

    name: str
    told_s: float | None
    recovered_s: float
    pause_s: float | None
    fault: str


def perform(line: Line, name: str) -> Done:
    """Do and undo, and listen to what the monitor says."""
    deed, faults = DEEDS[name], []
    begun_s = time.time()
    deed.do(line)
    told_s = None
    if deed.unsafe and not deed.mute:
        line.spin(TOLD_S, lambda: line.heard(begun_s, True) is not None)
        if (at_s := line.heard(begun_s, True)) is None:
            faults.append("silent: no EMERGENCY_BRAKE")
        else:
            told_s = at_s - begun_s
    line.spin(line.rng.uniform(0.5, 3.0))
    undone_s = time.time()
    deed.undo(line)
    if deed.mute:
        line.spin(RECOVERED_S, lambda: line.seen[-1][0] > undone_s + 0.5)
    line.spin(RECOVERED_S, lambda: line.heard(undone_s, False) is not None)
    free_s = line.heard(undone_s, False)
    if free_s is None:
        faults.append("never recovered")
    line.spin(line.rng.uniform(1.0, 3.0))
    pause_s = None
    if not deed.mute:
        times = [at_s for at_s, _ in line.seen if at_s >= begun_s - PAUSE_S]
        pause_s = max((later - one for one, later in pairwise(times)), default=float("inf"))
        if pause_s > PAUSE_S:
            faults.append(f"silent for {pause_s:.1f} s")
    return Done(name, told_s, (free_s or time.time()) - undone_s, pause_s, "; ".join(faults))


def script(rng: random.Random) -> Iterator[str]:
    """All deeds in turn, in another order each time."""
    while True:
        yield from rng.sample(sorted(DEEDS), len(DEEDS))
