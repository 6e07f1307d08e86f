# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Faults of the sensors as functions from a stream of ticks to a stream of ticks.

Every function has the signature of `Change`: it takes the ticks, the `Dose` and a generator of random numbers, and
yields the ticks with their messages changed. The truth stays what it is.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from adhesion_node.wire.topic import Topic
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION, SPEED, WHEEL_SPEED

from ..train.plant import Truth
from ..train.sensors import ATMOSPHERE_PA, SensorMessage, Tick

Messages = tuple[SensorMessage, ...]


@dataclass(frozen=True, slots=True)
class Dose:
    """When and how much: from `start_s` of the run for `duration_s`, in `share` of the samples, of `size`."""

    start_s: float = 30.0
    duration_s: float = math.inf
    share: float = 1.0
    size: float = 0.0

    def now(self, truth: Truth) -> bool:
        """Whether the fault is on at this sample."""
        return 0.0 <= truth.t_ns * 1e-9 - self.start_s < self.duration_s

    def hits(self, truth: Truth, rng: np.random.Generator) -> bool:
        """Whether the fault meets this sample; draws one number in any case."""
        return rng.random() < self.share and self.now(truth)


Change = Callable[[Iterator[Tick], Dose, np.random.Generator], Iterator[Tick]]

Alter = Callable[[Messages, Dose, np.random.Generator], Messages]


def hit(alter: Alter) -> Change:
    """Alter the messages of the samples that the fault meets."""

    def change(ticks: Iterator[Tick], dose: Dose, rng: np.random.Generator) -> Iterator[Tick]:
        for truth, messages in ticks:
            yield truth, alter(messages, dose, rng) if dose.hits(truth, rng) else messages

    return change


def each(topic: Topic, alter: Callable[[SensorMessage, Dose, np.random.Generator], SensorMessage]) -> Change:
    """Alter the messages of a topic one by one."""
    return hit(lambda messages, dose, rng: tuple(alter(m, dose, rng) if m.topic == topic else m for m in messages))


def moved(message: SensorMessage, by: float) -> SensorMessage:
    """Return the message with its value moved."""
    return message._replace(values=(message.values[0] + by,))


def _without(values: tuple[float, ...], share: float) -> tuple[float, ...]:
    """The values with 0 in place of such a share of them, from the first on."""
    first = round(share * len(values))
    return (0.0,) * first + values[first:]


lost = hit(lambda messages, dose, rng: tuple(m for m in messages if m.topic != POSITION))
duplicated = hit(lambda messages, dose, rng: messages * 2)
outlying = each(POSITION, lambda message, dose, rng: moved(message, math.copysign(dose.size, rng.standard_normal())))
shifted = each(POSITION, lambda message, dose, rng: moved(message, dose.size))
misframed = each(POSITION, lambda message, dose, rng: message._replace(frame="map"))
undeclared = each(POSITION, lambda message, dose, rng: message._replace(variance=0.0))
in_kmh = each(SPEED, lambda message, dose, rng: message._replace(values=(3.6 * message.values[0],)))
standing = each(SPEED, lambda message, dose, rng: message._replace(values=(0.0,)))
silent = each(WHEEL_SPEED, lambda message, dose, rng: message._replace(values=_without(message.values, dose.size)))
gauge = each(BRAKE_PRESSURE, lambda message, dose, rng: moved(message, -ATMOSPHERE_PA))


def bad(value: float | None = None, variance: float | None = None) -> Change:
    """Send, before good messages, one that nobody can use: this value or this variance in all that they hold."""

    def spoilt(message: SensorMessage) -> SensorMessage:
        values = message.values if value is None else (value,) * len(message.values)
        return message._replace(values=values, variance=message.variance if variance is None else variance)

    def before(messages: Messages, dose: Dose, rng: np.random.Generator) -> Messages:
        return *(spoilt(m) for m in messages if value is not None or m.topic == POSITION), *messages

    return hit(before)


def late(ticks: Iterator[Tick], dose: Dose, rng: np.random.Generator) -> Iterator[Tick]:
    """Hold messages back: they leave `size` seconds after their time."""
    waiting: list[tuple[int, Messages]] = []
    for truth, messages in ticks:
        held_back = dose.hits(truth, rng)
        if held_back:
            waiting.append((truth.t_ns + round(dose.size * 1e9), messages))
        due = [message for until_ns, held in waiting if until_ns <= truth.t_ns for message in held]
        waiting = [(until_ns, held) for until_ns, held in waiting if until_ns > truth.t_ns]
        yield truth, (*(() if held_back else messages), *due)


def restamped(ticks: Iterator[Tick], dose: Dose, rng: np.random.Generator) -> Iterator[Tick]:
    """Let the sensors' clock jump by `size` seconds, for good."""
    for truth, messages in ticks:
        by_ns = round(dose.size * 1e9) if dose.now(truth) else 0
        yield truth, tuple(message._replace(t_ns=message.t_ns + by_ns) for message in messages)


def paused(ticks: Iterator[Tick], dose: Dose, rng: np.random.Generator) -> Iterator[Tick]:
    """Let the sensors' clock stand still; afterwards it shows the right time again."""
    still_ns = round(dose.start_s * 1e9)
    for truth, messages in ticks:
        yield truth, tuple(m._replace(t_ns=still_ns) if dose.now(truth) else m for m in messages)


def held(topic: Topic) -> Change:
    """Repeat the last good values of a topic under fresh stamps."""

    def change(ticks: Iterator[Tick], dose: Dose, rng: np.random.Generator) -> Iterator[Tick]:
        shown: tuple[float, ...] | None = None
        for truth, messages in ticks:
            if shown is None or not dose.now(truth):
                shown = next((message.values for message in messages if message.topic == topic), shown)
                yield truth, messages
            else:
                yield truth, tuple(m._replace(values=shown) if m.topic == topic else m for m in messages)

    return change


stuck, wheels_stuck = held(POSITION), held(WHEEL_SPEED)


RATES_HZ = (10.0, 1.0, 50.0)
"""Rates of `irregular`, one after the other."""

FINE_HZ = 500.0
"""Rate of the run from which `irregular` picks its samples."""


def irregular(ticks: Iterator[Tick], dose: Dose, rng: np.random.Generator) -> Iterator[Tick]:
    """Thin a run of `FINE_HZ` to each of `RATES_HZ` for `duration_s` in turn, uneven by `size` of the period."""
    due_s = 0.0
    for truth, messages in ticks:
        now_s = truth.t_ns * 1e-9
        yield truth, messages if now_s >= due_s else ()
        if now_s >= due_s:
            turns = max(now_s - dose.start_s, 0.0) / dose.duration_s
            due_s += (1.0 + dose.size * rng.uniform(-1.0, 1.0)) / RATES_HZ[int(turns) % len(RATES_HZ)]
