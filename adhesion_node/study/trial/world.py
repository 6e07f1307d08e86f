# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a trial takes place in: a train on its track, its sensors and what goes wrong with them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import NamedTuple

from sim_node.faults.plan import FAULTS, NONE, Plan, faulty_run
from sim_node.train.plant import Truth, stopping_distances
from sim_node.train.scenario import find
from sim_node.train.sensors import SensorMessage, SensorSettings, Tick

from ...core import Config, Measurement, Sample
from ...core.estimator import paired
from ...core.physics.train import Array
from ...wire.line import NOMINAL, Line
from ...wire.messages.codec import plain
from ...wire.messages.refused import Rejected

PERIOD_S = 0.1
"""Of every published figure."""


class Refusal(NamedTuple):
    """A message that the codecs refuse."""

    topic: str
    reason: str


class World(NamedTuple):
    """A scenario, and all that the estimator is not told. With a seed it is a run."""

    scenario: str
    sensors: SensorSettings = SensorSettings()
    plan: Plan = Plan(NONE, 0.0)
    lasts_s: float = math.inf
    """How long the fault of the plan lasts; infinite: to the end of the run."""
    period_s: float = PERIOD_S
    """Of the simulated run; the messages of a run without a fault come every `PERIOD_S` all the same."""

    @property
    def over_s(self) -> float:
        """When the fault has passed; where it lasts, when it begins."""
        return self.plan.fault_start_s + (self.lasts_s if math.isfinite(self.lasts_s) else 0.0)

    @property
    def without_fault(self) -> World:
        """The same run, one for all worlds that differ in their faults alone."""
        return self._replace(plan=Plan(NONE, 0.0), lasts_s=math.inf)


def ticks(world: World, seed: int) -> Iterator[Tick]:
    """Truth and messages of every sample of a run."""
    run = faulty_run(world.plan, find(world.scenario), world.period_s, seed, world.sensors)
    if world.plan.fault != NONE:
        return run
    every = round(PERIOD_S / world.period_s)
    return ((truth, sent if index % every == 0 else ()) for index, (truth, sent) in enumerate(run))


def stopping_m(world: World, position_m: Array, speed_mps: Array) -> Array:
    """True distances, m, from places, m, and speeds, m/s, to a standstill; shape (N,)."""
    true = FAULTS[world.plan.fault].scenario(find(world.scenario), world.plan.dose)
    return stopping_distances(true, position_m, speed_mps)


class Sent(NamedTuple):
    """What the estimator receives at a true time, s: samples, and messages that the codecs refuse."""

    t_s: float
    received: tuple[Sample | Refusal, ...]


class SimulatedRun(NamedTuple):
    """A simulated run."""

    world: World
    seed: int
    sent: tuple[Sent, ...]
    measurements: tuple[Measurement, ...]
    """The samples paired as the pipeline does at its nominal settings."""
    born: Mapping[int, Truth]
    """Truth by stamp, ns; a stamp that is no time of the run stands for the time when its message was born."""


@lru_cache(maxsize=20)  # two worlds' runs of a task, which are taken with every estimator
def simulate(world: World, seed: int) -> SimulatedRun:
    """Simulate a run of `world`."""
    born, sent = dict[int, Truth](), list[Sent]()
    for truth, messages in ticks(world, seed):
        born.setdefault(truth.t_ns, truth)
        for message in messages:
            born.setdefault(message.t_ns, truth)
        sent.append(Sent(truth.t_ns * 1e-9, tuple(map(received, messages))))
    samples = (sample for _, received in sent for sample in received if not isinstance(sample, Refusal))
    return SimulatedRun(world, seed, tuple(sent), tuple(paired(Config(), samples)), born)


def received(message: SensorMessage, line: Line = NOMINAL) -> Sample | Refusal:
    """What the codecs make of a message."""
    try:
        sample: Sample = message.topic.read(message.build(plain), line)
        return sample
    except Rejected as refusal:
        return Refusal(message.topic.name, refusal.reason)
