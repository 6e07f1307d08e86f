# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The runs of `study real`: a case's drives through the estimator, every estimate beside the truth at its stamp."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_node.real.drive import START_S, Drive

from ...command.running import Arrays, Running, run_all
from ...core import Config
from ...core.physics.train import GRAVITY, Array
from ...run.pipeline import Pipeline
from ...run.results.score import SLOWEST_MPS
from ...wire.line import NOMINAL, Line
from ...wire.topics import POSITION
from ..trial.estimators import LaneResult, through
from ..trial.trials import DROP, Rows, length_m
from ..trial.world import Sent, received
from .cases import Case
from .truth import Border, Truth, borders, truth_at

ROW = np.dtype(
    [
        *(("seed", np.int64), ("t_s", np.float64), ("out_s", np.float64)),
        *((name, np.float64) for name in Truth._fields),
        *((name, np.float64) for name in ("mu", "std", "lower", "speed_mps", "speed_std_mps", "safe_m", "naive")),
        *(("regime", "U24"), ("withheld", np.bool_), ("changes", np.int64)),
    ]
)
"""An estimate: its run, its stamp and when it came out; the truth at its stamp (`truth.Truth`); the estimate with the
length of its safe curve (NaN: none); the naive estimate of its time (NaN: none)."""

RUN = np.dtype(
    [("seed", np.int64), *((name, np.float64) for name in ("full_s", "built_s", "slow_s", "end_s", "full_mps"))]
)
"""A run: when the full brake was demanded, when it had built up, when the train was down to `SLOWEST_MPS`, and when the
run ended; the speed at the first."""

BORDER = np.dtype([("seed", np.int64), *((name, np.float64) for name in Border._fields)])
"""A border of the rail that a run passed, as in `truth.Border`."""

NAIVE_S = 5.0
"""Length of the parabola of the naive estimate."""

SEEDS_OF_TASK = 4
"""The plant moves its runs side by side."""


class RealTrials(NamedTuple):
    """Some seeds of a case."""

    case: Case
    first_seed: int
    seeds: int

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"real-{self.case.name.replace(' ', '-')}-{self.first_seed}"

    @property
    def weight(self) -> float:
        """How much work it is beside the others: all are alike."""
        return float(self.seeds)

    def compute(self) -> Arrays:
        """Drive and estimate every seed."""
        started = time.perf_counter()
        config, line = self.case.config, self.case.line
        drives = self.case.drives(range(self.first_seed, self.first_seed + self.seeds))
        parts = [arrays(drive, config, self.case.built_after_s, line) for drive in drives]
        return {**joined(parts), "seconds": np.array([time.perf_counter() - started])}


class Found(NamedTuple):
    """What the runs of a case gave."""

    rows: Rows
    """Array of `ROW`."""
    runs: NDArray[np.void]
    """Array of `RUN`."""
    borders: NDArray[np.void]
    """Array of `BORDER`."""
    drops: NDArray[np.void]
    """Array of `DROP`."""
    seconds: Array
    """Computing time of each task."""

    def of_seed(self, seed: int) -> Found:
        """What one of them gave."""
        rows, runs, borders_of, drops = (some[some["seed"] == seed] for some in self[:4])
        return Found(rows, runs, borders_of, drops, self.seconds)


def found(cases: Iterable[Case], first_seed: int, seeds: int, where: Running) -> Mapping[Case, Found]:
    """Run what the cache lacks."""
    chunks = [(first, min(SEEDS_OF_TASK, seeds - first)) for first in range(0, seeds, SEEDS_OF_TASK)]
    tasks = [RealTrials(case, first_seed + first, count) for case in cases for first, count in chunks]
    parts: dict[Case, list[Arrays]] = {}
    for task, arrays_of in zip(tasks, run_all(tasks, where), strict=True):
        parts.setdefault(task.case, []).append(arrays_of)
    return {case: Found(**joined(some)) for case, some in parts.items()}


def joined(parts: Sequence[Arrays]) -> Arrays:
    """What stands by its name in each of some parts, one after the other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def arrays(drive: Drive, config: Config, built_after_s: float, line: Line = NOMINAL) -> Arrays:
    """Arrays of `ROW`, `RUN`, `BORDER` and `DROP` of one drive; the brake needs `built_after_s` to build up."""
    journey, seed = drive.journey, drive.journey.seed
    result = through(
        Pipeline(config, seed), (Sent(at_s, (received(message, line),)) for at_s, message in drive.messages)
    )
    braked = journey.time_s >= journey.full_from_s
    slow = journey.time_s[braked & (journey.speed_mps <= SLOWEST_MPS)]
    full_s, end_s = journey.full_from_s, float(journey.time_s[-1])
    times = (full_s, full_s + built_after_s, slow[0] if slow.size else end_s, end_s)
    drops = [(seed, reason, count, result.dropped_s[reason]) for reason, count in result.dropped.items()]
    return {
        "rows": rows_of(drive, config, result),
        "runs": np.array([(seed, *times, np.interp(full_s, journey.time_s, journey.speed_mps))], dtype=RUN),
        "borders": np.array([(seed, *border) for border in borders(journey)], dtype=BORDER),
        "drops": np.array(drops, dtype=DROP),
    }


def rows_of(drive: Drive, config: Config, result: LaneResult) -> Rows:
    """Every estimate, an array of `ROW`."""
    told = [(output, output.prediction.estimate) for output in result.outputs]
    stamps = np.array([estimate.t_ns * 1e-9 - START_S for _, estimate in told])
    truth = truth_at(drive.journey, stamps)
    rows = np.zeros(len(told), dtype=ROW)
    rows["seed"], rows["t_s"] = drive.journey.seed, stamps
    for name, column in truth._asdict().items():
        rows[name] = column
    estimated = [
        (
            output.out_s - START_S,
            e.mu,
            e.mu_std,
            e.mu_lower,
            e.speed_mps,
            e.speed_std_mps,
            e.withheld,
            e.changes,
        )
        for output, e in told
    ]
    names = "out_s", "mu", "std", "lower", "speed_mps", "speed_std_mps", "withheld", "changes"
    for name, column in zip(names, np.array(estimated).reshape(-1, len(names)).T, strict=True):
        rows[name] = column
    rows["regime"] = [estimate.regime.name for _, estimate in told]
    rows["safe_m"] = [length_m(output.prediction) for output, _ in told]
    rows["naive"] = naive(drive, config, rows["t_s"], rows["out_s"])
    return rows


def naive(drive: Drive, config: Config, t_s: Array, out_s: Array) -> Array:
    """Adhesion by the parabola through the positions of 5 s up to N stamps that had come by `out_s`; NaN: too few.

    What anybody would do first: the deceleration is the parabola's, the resistances of train and track are known.
    """
    positions = [(m.t_ns * 1e-9, at_s, m.values[0]) for at_s, m in drive.messages if m.topic == POSITION]
    stamps, came_s, places = (np.array(positions).reshape(-1, 3) - (START_S, START_S, 0.0)).T
    result = np.full(t_s.size, np.nan)
    for index, (now_s, by_s) in enumerate(zip(t_s, out_s, strict=True)):
        known = (stamps > now_s - NAIVE_S) & (stamps <= now_s) & (came_s <= by_s)
        if np.unique(stamps[known]).size < 4:
            continue
        curvature, slope, place = np.polyfit(stamps[known] - now_s, places[known], 2)
        resistance = config.motion.resistance(np.array([place]), np.array([max(slope, 0.0)]))[0]
        result[index] = -2.0 * curvature / GRAVITY - resistance
    return result
