# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The runs of `study worlds`: each a world of its own, its estimates beside the truth as those of `study real`."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from sim_node.real.drawn import world
from sim_node.real.drive import Drive, sense
from sim_node.real.plant.simulate import simulate
from sim_node.real.sensors.sensor import Ride

from ...command.running import Arrays, Running, run_all
from ...core.setting import Value
from ..real.cases import built_after_s, config_of
from ..real.trials import Found, arrays, joined

SEEDS_OF_TASK = 2
"""Worlds differ in the time that they take."""


class Kind(NamedTuple):
    """A line of the table."""

    sensors: str
    """One of `sim_node.real.drawn.SENSORS`."""
    told: tuple[tuple[str, Value], ...] = ()
    """Settings of the estimator that differ from what it is told else."""


class WorldTrials(NamedTuple):
    """Some seeds of a kind."""

    kind: Kind
    first_seed: int
    seeds: int

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"worlds-{self.kind.sensors}-{self.first_seed}"

    @property
    def weight(self) -> float:
        """How much work it is beside the others: all are alike."""
        return float(self.seeds)

    def compute(self) -> Arrays:
        """Draw, drive and estimate every world."""
        started = time.perf_counter()
        parts = [_of_world(self.kind, seed) for seed in range(self.first_seed, self.first_seed + self.seeds)]
        return {**joined(parts), "seconds": np.array([time.perf_counter() - started])}


def _of_world(kind: Kind, seed: int) -> Arrays:
    scenario, fitted = world(kind.sensors, seed)
    (journey,) = simulate(scenario, [seed])
    drive = Drive(journey, sense(Ride(journey, scenario.nominal), fitted))
    return arrays(drive, config_of(scenario, fitted, kind.told), built_after_s(scenario.nominal))


def found(kinds: Sequence[Kind], first_seed: int, seeds: int, where: Running) -> Iterator[Found]:
    """Run what the cache lacks; yield what each of the kinds gave, as given."""
    chunks = [(first, min(SEEDS_OF_TASK, seeds - first)) for first in range(0, seeds, SEEDS_OF_TASK)]
    tasks = [WorldTrials(kind, first_seed + first, count) for kind in kinds for first, count in chunks]
    parts = list(run_all(tasks, where))
    for index in range(0, len(parts), len(chunks)):
        yield Found(**joined(parts[index : index + len(chunks)]))
