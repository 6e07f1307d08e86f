# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A drive: a journey of the real train, and the messages of its sensors in the order in which they arrive."""

from collections.abc import Iterator, Sequence
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from adhesion_node.wire.messages.parts import NS

from ..train.sensors import SensorMessage
from .plant.journey import Journey
from .plant.scenarios import Scenario
from .plant.simulate import simulate
from .sensors.fitted import Fitted, Mounted
from .sensors.sensor import Ride
from .sensors.timing import schedule

START_S = 1000.0
"""Time of the journey's first moment in stamps and arrivals, so that none is near 0 or below it."""


class Drive(NamedTuple):
    """A journey and what its sensors tell."""

    journey: Journey
    messages: tuple[tuple[float, SensorMessage], ...]
    """Time of arrival, s, and message, in order of arrival; both times begin at `START_S`."""


def drive(scenario: Scenario, fitted: Fitted, seeds: Sequence[int]) -> tuple[Drive, ...]:
    """Let the train drive and measure, once for every seed.

    Every sensor and every device draws from a stream of its own: a journey does not depend on the sensors, nor a
    sensor on the others.
    """
    rides = (Ride(journey, scenario.nominal) for journey in simulate(scenario, seeds))
    return tuple(Drive(ride.journey, sense(ride, fitted)) for ride in rides)


def sense(ride: Ride, fitted: Fitted) -> tuple[tuple[float, SensorMessage], ...]:
    """What all sensors tell of a ride, in order of arrival."""
    sent = (one for name, mounted in fitted.sensors.items() for one in _tell(ride, name, mounted))
    return tuple(sorted(sent, key=itemgetter(0)))


def _tell(ride: Ride, name: str, mounted: Mounted) -> Iterator[tuple[float, SensorMessage]]:
    """What one sensor tells, in order of arrival."""
    journey = ride.journey
    when = schedule(mounted.timing, float(journey.time_s[-1]), _stream(journey.seed, mounted.device, "timing"))
    shown = mounted.sensor.measure(ride, when.time_s, _stream(journey.seed, name, "errors"))
    stamps_ns = np.round((START_S + when.stamp_s) * NS).astype(np.int64)
    columns = (START_S + when.arrival_s, stamps_ns, shown.values, shown.variance)
    for arrival_s, t_ns, values, variance in zip(*(column[when.works].tolist() for column in columns), strict=True):
        yield arrival_s, SensorMessage(mounted.sensor.topic, t_ns, tuple(values), variance)


def _stream(seed: int, *names: str) -> np.random.Generator:
    return np.random.default_rng([seed, *" ".join(names).encode()])
