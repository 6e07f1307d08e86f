# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""How the cost grows, each with the exponent of a power law.

The bank carries all nuisance parameters as components of its state, whose number is compiled in: one that is known for
certain has a variance of 0. So what is varied are those that are uncertain.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from ..command.options import progress
from ..core.bank.kernels import weighing
from ..core.bank.layout import Bank
from ..core.bank.motion import Braking, moved, white_variances
from ..core.bank.seeing import CLIPPED
from ..core.config import Config
from ..run.pipeline import Pipeline
from .scene import SIGMA_M, journey

SECONDS = 60.0
"""Of a journey: 20 s of cruising, and a braking."""

STEPS = 200
"""Steps of the bank that are timed together."""

NUISANCE = ("grade_std", "profile_std", "resistance_std", "mass_std", "brake_std", "rotating_mass_std")
"""Settings by which one is uncertain."""

SIZES: dict[str, Sequence[int]] = {
    "rate_hz": (5, 10, 20, 50, 100),
    "trains": (1, 2, 4, 8),
    "hypotheses": (10, 20, 40, 80, 160),
    "nuisance": (1, 2, 4, 6),
    "window": (25, 50, 100, 200),
}


def compare(rounds: int, seed: int) -> list[dict[str, Any]]:
    """Rows of the table: processor time, ms, in the least of some rounds that take turns."""
    costs: dict[str, Callable[[int], float]] = {
        "rate_hz": lambda rate: _journey_ms(Config(), float(rate), 1, seed),
        "trains": lambda trains: _journey_ms(Config(), 10.0, trains, seed),
        "hypotheses": lambda count: _step_ms(count, seed),
        "nuisance": lambda count: _journey_ms(_uncertain_in(count), 10.0, 1, seed),
        "window": lambda window: _journey_ms(replace(Config(), method="rail_condition", window=window), 10.0, 1, seed),
    }
    least = {(name, size): np.inf for name, sizes in SIZES.items() for size in sizes}
    for _ in progress(range(rounds), "rounds", rounds):
        for (name, size), before in least.items():
            least[name, size] = min(before, costs[name](size))
    rows = []
    for name, sizes in SIZES.items():
        found = [least[name, size] for size in sizes]
        exponent = float(np.polyfit(np.log(sizes), np.log(found), 1)[0])
        unit = "ms_per_step" if name == "hypotheses" else "ms_per_s"
        rows += [
            {"grows": name, "size": size, "ms": ms, "per": unit, "exponent": exponent}
            for size, ms in zip(sizes, found, strict=True)
        ]
    return rows


def _uncertain_in(count: int) -> Config:
    """Nominal settings but for nuisance parameters behind the first so many, which are known for certain."""
    certain: dict[str, Any] = dict.fromkeys(NUISANCE[count:], 0.0)
    return replace(Config(), **certain)


def _journey_ms(config: Config, rate_hz: float, trains: int, seed: int) -> float:
    """Processor time, ms, of a second of a journey: of all trains in one process together."""
    samples = list(islice(journey(rate_hz, np.random.default_rng(seed)), round(SECONDS * rate_hz)))
    pipelines = [Pipeline(config, seed) for _ in range(trains)]
    started = time.process_time()
    for pair in samples:
        for pipeline in pipelines:
            for sample in pair:
                pipeline.push(sample)
    return 1e3 * (time.process_time() - started) / SECONDS


def _step_ms(count: int, seed: int) -> float:
    """Processor time, ms, of moving so many hypotheses on by 0.1 s and of taking a position in."""
    config, pipeline = Config(), Pipeline(Config(), seed)
    for pair in islice(journey(10.0, np.random.default_rng(seed)), 250):
        for sample in pair:
            pipeline.push(sample)
    assert pipeline.state.memory is not None  # the train has been met
    braked: Bank = pipeline.state.memory.bank
    bank = braked.part(np.resize(np.arange(braked.kind.size), count)).normalised()
    braking, position_m = Braking(0.09), float(bank.mean[0, 0]) + SIGMA_M
    started = time.process_time()
    for _ in range(STEPS):
        ahead = moved(config, bank, 0.1, braking, SIGMA_M)
        weighing.placed(*ahead[:4], white_variances(SIGMA_M), position_m, CLIPPED)
    return 1e3 * (time.process_time() - started) / STEPS
