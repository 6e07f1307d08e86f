# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The parts of `study creep` as tasks."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ...core.creep.config import CreepConfig
from ...core.physics.train import Array
from ..trial.tasks import Arrays
from . import beyond as creep_beyond
from .runs import ONE, RISE, one_surface, rise, swings, switched

MOVEMENTS: Mapping[str, Callable[[int], Array]] = MappingProxyType({"swings": swings, "rise": rise})
"""How the creep moves on each of two surfaces, by the samples of a rise."""


class Experiment(NamedTuple):
    """A course of p1 and p2: one rise on one surface, or a movement on the dry and then on the wet one."""

    runs: int
    seed: int
    config: CreepConfig = ONE
    samples: int = RISE
    """Of a rise."""
    movement: str | None = None
    """None: one surface."""
    in_mu: bool = False
    """On one surface: noise of mu itself."""

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"creep-{self.movement or 'one'}"

    @property
    def weight(self) -> float:
        """How much work it is: the samples."""
        return float(self.samples if self.movement is None else 2 * self.samples_of_surface)

    @property
    def samples_of_surface(self) -> int:
        """Samples on each surface."""
        return self.samples if self.movement is None else MOVEMENTS[self.movement](self.samples).size

    def compute(self) -> Arrays:
        """Theta after every sample, shape (samples, runs, 2)."""
        if self.movement is None:
            return {"theta": one_surface(self.runs, self.seed, in_mu=self.in_mu).theta}
        creeps = MOVEMENTS[self.movement](self.samples)
        return {"theta": switched(self.config, creeps, self.runs, self.seed).theta}


BEYOND: Mapping[str, Callable[[int, int], Any]] = MappingProxyType(
    {
        **{f"noise{std:g}": creep_beyond.with_creep_noise(std) for std in creep_beyond.CREEP_STDS},
        "coverage": lambda _runs, seed: creep_beyond.coverage(seed),
        "withholding": lambda _runs, seed: creep_beyond.withholding(seed),
        "dfp": creep_beyond.dfp_difference,
    }
)
"""What the paper leaves out, by name: plain values of runs and seed."""


class Beyond(NamedTuple):
    """One of `BEYOND`."""

    what: str
    runs: int
    seed: int

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"creep-{self.what}"

    @property
    def weight(self) -> float:
        """How much work it is beside the samples of an experiment."""
        return 8000.0

    def compute(self) -> Arrays:
        """The values as JSON in one text."""
        return {"json": np.array(json.dumps(BEYOND[self.what](self.runs, self.seed)))}


def value_of(found: Arrays) -> Any:
    """Read what `Beyond.compute` wrote."""
    return json.loads(str(found["json"]))
