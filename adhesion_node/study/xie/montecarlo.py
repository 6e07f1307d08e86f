# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The Monte-Carlo runs of the tables as tasks: a chunk of seeds of one scenario with one method."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_node.train.scenario import find

from ...core import Config
from ..trial.running import Running, run_all
from ..trial.runs import FIRST_SEED, simulate
from ..trial.tasks import EVERY_SOURCE, Arrays
from .methods import METHODS, PAPER, STARTS, Lane

CHUNK = 40
"""Seeds in a chunk: with five starts 200 runs side by side, which a processor's cache still holds."""


class Chunk(NamedTuple):
    """Some runs of a scenario with one method, from every start."""

    scenario: str
    method: str
    sigma_m: float
    first_seed: int
    seeds: int
    config: Config = PAPER
    seed_shift: int = 0
    """Added to a run's seed it gives that of its estimator."""

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"{self.scenario}-{self.method}-{self.first_seed}"

    @property
    def weight(self) -> float:
        """How much work it is, in that of a Kalman filter, about."""
        return self.seeds * {"particle_em": 12.0, "rail_condition": 6.0}.get(self.method, 1.0)

    @property
    def sources(self) -> tuple[str, ...]:
        """Where its numbers come from."""
        return EVERY_SOURCE

    def compute(self) -> Arrays:
        """Simulate and estimate every run; the rows of all runs stand in one array, run i before `ends[i]`."""
        started = time.perf_counter()
        lanes = [
            Lane(seed + self.seed_shift, start, simulated)
            for seed in range(self.first_seed, self.first_seed + self.seeds)
            for simulated in (simulate(self.scenario, seed, self.sigma_m),)
            for start in STARTS
        ]
        config = replace(self.config, track=find(self.scenario).track)
        outcome = METHODS[self.method](config, lanes)
        return {
            "rows": np.concatenate(outcome.rows),
            "ends": np.cumsum([len(rows) for rows in outcome.rows]),
            "seconds": np.array(time.perf_counter() - started),
            "window_ms": np.array(outcome.window_ms),
        }


class Result(NamedTuple):
    """A chunk's rows: those of seed i from start j stand at index i * len(STARTS) + j."""

    chunk: Chunk
    rows: list[NDArray[np.void]]
    seconds: float
    """Computing time, in one process."""
    window_ms: NDArray[np.float64]


def chunks(scenario: str, method: str, sigma_m: float, runs: int, chunk: int = CHUNK) -> list[Chunk]:
    """Divide `runs` runs of a scenario into chunks."""
    return [
        Chunk(scenario, method, sigma_m, FIRST_SEED + first, min(chunk, runs - first))
        for first in range(0, runs, chunk)
    ]


def results(wanted: Sequence[Chunk], where: Running) -> Iterator[Result]:
    """Yield the results of all chunks in order."""
    for chunk, found in zip(wanted, run_all(wanted, where), strict=True):
        yield result_of(chunk, found)


def result_of(chunk: Chunk, found: Arrays) -> Result:
    """Take a chunk's arrays apart."""
    rows = np.split(found["rows"], found["ends"][:-1])
    return Result(chunk, rows, float(found["seconds"]), found["window_ms"])
