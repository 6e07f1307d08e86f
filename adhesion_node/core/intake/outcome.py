# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What becomes of a sample, with the words in which an operator is told."""

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import NamedTuple

LONGEST = 300
"""Characters of a text from outside that are told."""


def text_of(said: str) -> str:
    r"""A text from outside without control characters, cut where it is too long.

    >>> text_of("a\x1b[2J" + 300 * "b")[:5], len(text_of(1000 * "b"))
    ('a [2J', 301)
    """
    printable = "".join(each if each.isprintable() else " " for each in said[: LONGEST + 1])
    return printable if len(said) <= LONGEST else f"{printable[:LONGEST]}…"


class Outcome(Enum):
    """What an estimator did with a sample; the value says it in words, with the remedy."""

    __hash__ = object.__hash__  # each is one object, and every sample is counted: Enum's own is a Python call

    ACCEPTED = "accepted"
    TICK = "no position at its time: the other sensors are used without one"
    LATE = "older than the newest one by more than max_lag_s: dropped; raise it, or is there a second publisher?"
    DUPLICATE = "a second measurement with the same stamp: dropped; does its clock stand still, or header.stamp stay 0?"
    REPEATED = "a second sample of another sensor with the same stamp: dropped"
    OVERTAKEN = "came when all of its time had been used: dropped; is its clock right? Else raise pressure_wait_s"
    STRAY = "stamped apart from all others, and none came that agrees: dropped; check the clock of its publisher"
    SHIFTED = "against the rhythm of the positions and the way of the train: put back; check the receiver's clock"
    TOO_OFTEN = "publish at most 200 messages a second: no more are used"
    INVALID = "not finite, no positive variance or physically impossible: dropped"
    STUCK = (
        "the same to the bit although the train must have moved on, a standstill that no brake brings about, or a "
        "speed far below that of the positions: check the sensor"
    )
    HELD = "the same to the bit as before: taken for a value that is held until the next one; publish each only once"
    SPEED_IN_KMH = "speed is in m/s: divide km/h by 3.6"
    WHEEL_UNIT = (
        "left out until they agree while no brake is applied; wheel_speed is in rad/s: multiply rpm by 0.1047, divide "
        "m/s by the radius; or is train.wheel_radius_m another, or are positions not in m?"
    )
    POSITION_UNIT = (
        "positions hardly run while all wheels turn: left out until they do; are they in km, not in m, or does the "
        "receiver hang?"
    )
    SLIDING = (
        "positions slow down as no train can: those of a sliding wheel, left out until the brake is released; "
        "take them from an axle without a brake, or from satellites; or is a speed beside them not in m/s, or do they "
        "fall along the run: set direction?"
    )
    TURNED = (
        "the accelerometer feels the brake push the train forward: left out until a braking says otherwise; "
        "x is to point forward along the track, level"
    )
    ASKEW = (
        "the accelerometer shows too much for one that is level: left out until the train is met anew; x is to point "
        "forward along the track, level, in m/s^2"
    )
    OUTLIER = "further from the prediction than gate_sigma: dropped"
    UNPAIRED = "no speed or force of its time: dropped; is that sensor alive, its clock right?"
    SLOW = "slower than min_speed_mps: the creep is not formed"
    AXLES = "another number of axles than the setting axles: dropped"
    UNEQUAL = "the axles creep so differently that their common force belongs to no one creep: dropped"
    IDLE = "creep below min_creep: says nothing of the curve, nothing is forgotten"
    CHANGED = "the newest samples lie on one side of the curve: the surface changed, what was known is forgotten"
    FAILED = "the numbers of a window failed, nothing is identified by it: is a setting far from what any train has?"
    RESET = "stamp or position jumped, or a sensor had deceived: the estimation starts anew"


DROPS = tuple(outcome for outcome in Outcome if outcome.name not in ("ACCEPTED", "TICK", "SHIFTED", "CHANGED", "RESET"))
"""Outcomes of a sample that is not used."""

KEPT_OUT = tuple(map(Outcome.__getitem__, ("LATE", "DUPLICATE", "REPEATED", "OVERTAKEN", "STRAY", "TOO_OFTEN")))
"""Those of them that a stamp brings about as a sample comes, its own or, of STRAY, that of the one before: a sensor of
which all are kept out is as good as silent. The others may be of a sample long before, or of another sensor's."""

QUIET = ("ACCEPTED", "TICK", "REPEATED", "HELD", "OUTLIER", "SLOW", "IDLE", "CHANGED")
"""Names of those that an operator need not hear of beyond their counts: they are part of good days."""

NO_COUNTS: Mapping[Outcome, int] = MappingProxyType(dict.fromkeys(Outcome, 0))


class Event(NamedTuple):
    """Something other than that a sample was accepted."""

    outcome: Outcome
    detail: str = ""
    """What it was, with its value."""

    def __str__(self) -> str:
        """Say what = value: outcome, with the remedy."""
        return f"{text_of(self.detail)}: {self.outcome.value}" if self.detail else self.outcome.value

    @property
    def is_told(self) -> bool:
        """Whether an operator must hear of it, not only see it counted."""
        return self.outcome.name not in QUIET


ACCEPTED, TICK = Event(Outcome.ACCEPTED), Event(Outcome.TICK)
"""Nothing other: a sample was used."""


def counted(counts: Mapping[Outcome, int], *events: Event) -> Mapping[Outcome, int]:
    """The counts with those of the events added."""
    if not events:
        return counts
    added = counts.copy() if isinstance(counts, MappingProxyType) else dict(counts)
    for event in events:
        added[event.outcome] += 1
    return MappingProxyType(added)
