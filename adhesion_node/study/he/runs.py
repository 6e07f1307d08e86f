# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The experiments of He et al. 2017, many seeds at once through the recursion that also runs live.

The paper prints neither the surfaces' parameters nor the number of samples nor how the creep moves. Here mu_0 = 20 and
both surfaces have their peak at a creep of 0.1, mu_max 0.35 (dry) and 0.20 (wet). v(k) ~ N(0, 0.01) is read as the v
of (7), the error of the linear form, with 0.01 as its standard deviation: the measured adhesion then has the error
v/(1 + p1 l + p2 l^2). A rise of the creep from 0 to 0.1 has `RISE` samples.
"""

from typing import Any, NamedTuple

import numpy as np

from ...command.running import Arrays
from ...core.creep.config import FIXED, VARYING, CreepConfig
from ...core.creep.curve import adhesion, parameters, peak
from ...core.creep.recursion import Recursion, advance, begin
from ...core.physics.train import Array

SLOPE, LAMBDA_M = 20.0, 0.1
DRY_PEAK, WET_PEAK = 0.35, 0.20
DRY, WET = parameters(SLOPE, DRY_PEAK, LAMBDA_M), parameters(SLOPE, WET_PEAK, LAMBDA_M)

NOISE_STD = 0.01
START_SHARE = 0.2
"""The recursion starts from this share of the true p1 and p2."""

RISE, SWINGS = 1000, 3
"""Samples of a rise; rises and falls of the creep on each surface of experiments 2 and 3."""

RAMP = 4000
"""Samples of the one rise per surface of the variants of experiments 2 and 3."""

ENOUGH = 0.03
"""Creep up to which experiment 1 may look."""

BAND = 0.05
"""An estimate within this share of the truth counts as right."""

ONE = CreepConfig(forgetting=FIXED, eta=1.0)
FIXED_ETA = CreepConfig(forgetting=FIXED, eta=0.99)
VARYING_ETA = CreepConfig(forgetting=VARYING, gain=0.1, eta_min=0.971, eta_max=1.0)


class Data(NamedTuple):
    """Measured creeps and adhesions of shape (samples, runs), and the true theta of every sample, (samples, 2)."""

    creep: Array
    adhesion: Array
    theta: Array


class Trace(NamedTuple):
    """A recursion's course."""

    theta: Array
    """Shape (samples, runs, 2)."""
    last: Recursion


def peaks(theta: Array) -> Array:
    """Estimated mu_max after every sample, shape (samples, runs); `theta` as in `Trace`."""
    return peak(SLOPE, theta)[0]


def rise(samples: int = RISE) -> Array:
    """Creep from 0 (left out: it says nothing) to 0.1 in equal steps."""
    return np.arange(1, samples + 1) / samples * LAMBDA_M


def swings(samples: int = RISE, count: int = SWINGS) -> Array:
    """Creep that rises to 0.1 and falls again, `count` times."""
    up = rise(samples)
    return np.tile(np.concatenate([up, up[::-1]]), count)


def measure(
    creeps: Array, surfaces: Array, runs: int, seed: int, *, in_mu: bool = False, creep_std: float = 0.0
) -> Data:
    """Measure `runs` times; `surfaces` holds the true theta of every sample, shape (samples, 2).

    The noise is that of (7), or with `in_mu` one of mu itself; `creep_std` is that of the creep. Run i has the same
    numbers whatever `runs` is.
    """
    streams = [np.random.default_rng([seed, run]) for run in range(runs)]
    noise = np.stack([stream.standard_normal((creeps.size, 2)) for stream in streams], axis=1)
    bottom = 1.0 if in_mu else 1.0 + surfaces[:, :1] * creeps[:, None] + surfaces[:, 1:] * creeps[:, None] ** 2
    true = adhesion(creeps, SLOPE, surfaces)[:, None]
    return Data(creeps[:, None] + creep_std * noise[..., 1], true + NOISE_STD * noise[..., 0] / bottom, surfaces)


def on_one(creeps: Array, theta: Array = DRY) -> Array:
    """True theta of every sample on one surface."""
    return np.broadcast_to(theta, (creeps.size, 2))


def identify(config: CreepConfig, data: Data, noise: Array | None = None) -> Trace:
    """Run the recursion over all runs at once; `noise` is what is taken off sample by sample, as `creep_fit.add`."""
    recursion = begin(config, data.creep.shape[1:], START_SHARE * data.theta[0])
    thetas = np.empty((*data.creep.shape, 2))
    for index, (creeps, adhesions) in enumerate(zip(data.creep, data.adhesion, strict=True)):
        recursion = advance(config, recursion, creeps, adhesions, 0.0 if noise is None else noise[index])
        thetas[index] = recursion.theta
    return Trace(thetas, recursion)


def fractions(found: Array, truth: float) -> tuple[Array, Array]:
    """Shares of the samples, per run, after which the estimate is within `BAND` of the truth for good, and first.

    >>> for_good, first = fractions(np.array([[9.0], [1.0], [9.0], [1.0], [1.01]]), 1.0)
    >>> for_good.tolist(), first.tolist()
    ([0.6], [0.2])
    """
    wrong = np.abs(found - truth) > BAND * truth
    for_good = np.where(wrong.any(axis=0), wrong.shape[0] - np.argmax(wrong[::-1], axis=0), 0)
    first = np.where(wrong.all(axis=0), wrong.shape[0], np.argmin(wrong, axis=0))
    return for_good / wrong.shape[0], first / wrong.shape[0]


def peak_row(name: str, truth: float, found: Array, used: float) -> dict[str, Any]:
    """What every row of the study says of the peaks that its runs found."""
    return {
        "experiment": int(name) if name.isdigit() else name,
        "peak_true": truth,
        "peak_estimated_mean": float(np.mean(found)),
        "peak_estimated_std": float(np.std(found)),
        "used_fraction": used,
    }


class Experiment(NamedTuple):
    """A course of p1 and p2: one rise on one surface, or a movement on the dry and then on the wet one."""

    runs: int
    seed: int
    config: CreepConfig = ONE
    samples: int = RISE
    """Of a rise."""
    movement: str | None = None
    """Of the creep on each of two surfaces, "rise" or "swings"; None: one rise on one surface."""
    in_mu: bool = False
    """Noise of mu itself."""

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"creep-{self.movement or 'one'}"

    @property
    def surfaces(self) -> tuple[Array, ...]:
        """Theta of one surface after the other."""
        return (DRY,) if self.movement is None else (DRY, WET)

    @property
    def creeps(self) -> Array:
        """Creep on each surface."""
        return swings(self.samples) if self.movement == "swings" else rise(self.samples)

    @property
    def weight(self) -> float:
        """How much work it is: the samples."""
        return float(len(self.surfaces) * self.creeps.size)

    def compute(self) -> Arrays:
        """Theta after every sample, shape (samples, runs, 2)."""
        surfaces = np.concatenate([on_one(self.creeps, theta) for theta in self.surfaces])
        creeps = np.tile(self.creeps, len(self.surfaces))
        return {"theta": identify(self.config, measure(creeps, surfaces, self.runs, self.seed, in_mu=self.in_mu)).theta}
