# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The trials of all studies: seeds and starts of one world with one estimator, their rows, and groups of them."""

from __future__ import annotations

import math
import time
from bisect import bisect_left
from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from sim_node.train.plant import ADHESION_LIMITED, Truth

from ...command.running import Arrays, Running, run_all
from ...core import Config, Regime
from ...core.prediction import Prediction
from ...run.results.score import CONVERGED_AFTER_MPS
from .estimators import WAYS, Estimator, Lane, LaneResult
from .world import World, simulate, stopping_m

FIRST_SEED = 1000
"""Run r of a table has simulator and estimator seed FIRST_SEED + r."""

MOST_RUNS = 10**6
"""More would fill the memory before the first begins."""

ROW = np.dtype(
    [
        *(("seed", np.int64), ("start", np.float64), ("t_ns", np.int64), ("out_s", np.float64)),
        *((f"true_{name}", np.float64) for name in ("position_m", "speed_mps", "mu", "stopping_m")),
        *((name, np.float64) for name in ("mu", "std", "lower", "position_m", "speed_mps", "safe_m")),
        *((name, np.bool_) for name in ("limited", "scored", "claimed", "withheld", "at_end")),
        *((name, np.int64) for name in ("window", "fresh", "changes")),
    ]
)
"""An estimate under the brake. Run and start; true times of its measurement and of its publication; the truth, with
the distance to a standstill; the estimate, with the length of its safe curve (NaN: none); whether adhesion truly
limits, whether it does after the first 30 km/h of braking, whether the estimate claims it, whether mu is withheld,
whether the end of the data gave it; measurements in its window, those accepted since the fault is over, changes of the
rail told so far."""

TRIAL = np.dtype([("seed", np.int64), ("start", np.float64), ("resets", np.int64), ("finite", np.bool_)])
"""A trial: how often the estimation started anew, and whether every number of the estimates was finite."""

DROP = np.dtype([("seed", np.int64), ("reason", "U32"), ("count", np.int64), ("first_s", np.float64)])
"""Messages of a trial that were dropped for one reason; when the first one was."""

Rows = NDArray[np.void]
Key = TypeVar("Key", bound=Hashable)


class Trials(NamedTuple):
    """Trials of one world with one estimator, which differ in seed and start: the task of all studies."""

    world: World
    estimator: Estimator = Estimator()
    first_seed: int = FIRST_SEED
    seeds: int = 1
    starts: tuple[float, ...] = (Config().start_mu,)

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"{self.world.scenario}-{self.world.plan.fault}-{self.estimator.way}-{self.first_seed}"

    @property
    def weight(self) -> float:
        """How much work it is, in that of a Kalman filter, about."""
        slower = 10.0 if (self.estimator.way, self.estimator.config.method) == ("pipeline", "particle_em") else 1.0
        return slower * self.seeds * len(self.starts) * WAYS[self.estimator.way].weight

    def compute(self) -> Arrays:
        """Simulate and estimate every trial."""
        started = time.perf_counter()
        runs = [simulate(self.world, seed) for seed in range(self.first_seed, self.first_seed + self.seeds)]
        lanes = [Lane(run, start) for run in runs for start in self.starts]
        tried = self.estimator.run(lanes)
        parts = [_arrays(lane, result) for lane, result in zip(lanes, tried.results, strict=True)]
        arrays = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        seconds = np.array([time.perf_counter() - started])
        return {**arrays, "window_ms": np.array(tried.window_ms), "seconds": seconds}

    def tasks(self) -> list[Trials]:
        """Divide the seeds into tasks. Raises ValueError without any."""
        if not 1 <= self.seeds <= MOST_RUNS:
            raise ValueError(f"runs = {self.seeds}: give at least 1, at most {MOST_RUNS}")
        chunk = WAYS[self.estimator.way].lanes // len(self.starts)
        return [
            self._replace(first_seed=self.first_seed + first, seeds=min(chunk, self.seeds - first))
            for first in range(0, self.seeds, chunk)
        ]


class Results(NamedTuple):
    """What trials gave: a table of estimates (`ROW`) and what stands beside it."""

    rows: Rows
    runs: NDArray[np.void]
    """Array of `TRIAL`."""
    drops: NDArray[np.void]
    """Array of `DROP`."""
    window_ms: NDArray[np.float64]
    seconds: NDArray[np.float64]
    """Computing time of each task."""

    def of_start(self, start: float) -> Results:
        """Those from one start."""
        return self._replace(rows=self.rows[self.rows["start"] == start], runs=self.runs[self.runs["start"] == start])

    def where(self, which: NDArray[np.bool_]) -> Results:
        """With a choice of the rows only."""
        return self._replace(rows=self.rows[which])


def grouped(wanted: Iterable[tuple[Key, Trials]], where: Running) -> dict[Key, Results]:
    """Run what the cache lacks, and put together what has the same key, as given. Raises ValueError without runs.

    What is of the same seeds is run one after the other, so that a worker simulates them once for all estimators.
    """
    tasks = [(key, task) for key, trials in wanted for task in trials.tasks()]
    parts: dict[Key, list[Arrays]] = {key: [] for key, _ in tasks}
    tasks.sort(key=lambda one: (one[1].first_seed, -one[1].weight))
    for (key, _), found in zip(tasks, run_all([task for _, task in tasks], where, as_given=True), strict=True):
        parts[key].append(found)
    return {
        key: Results(*(np.concatenate([part[name] for part in some]) for name in Results._fields))
        for key, some in parts.items()
    }


def each_trial(rows: Rows) -> list[Rows]:
    """Divide rows by their trials."""
    ends = np.flatnonzero((np.diff(rows["seed"]) != 0) | (np.diff(rows["start"]) != 0)) + 1
    return np.split(rows, ends) if rows.size else []


def _arrays(lane: Lane, result: LaneResult) -> Arrays:
    """Arrays of `ROW`, `TRIAL` and `DROP`."""
    seed, start = lane.run.seed, lane.start_mu
    numbers = (value for output in result.outputs for value in output.prediction.estimate if isinstance(value, float))
    drops = [(seed, reason, count, result.dropped_s[reason]) for reason, count in result.dropped.items()]
    return {
        "rows": _rows(lane, result),
        "runs": np.array([(seed, start, result.resets, all(map(math.isfinite, numbers)))], dtype=TRIAL),
        "drops": np.array(drops, dtype=DROP),
    }


def _truth_at(born: Mapping[int, Truth], stamps: Sequence[int], t_ns: int) -> Truth:
    """The train at a stamp; an estimate without a position may lie between two of the `stamps`, which rise."""
    if t_ns in born:
        return born[t_ns]
    index = min(max(bisect_left(stamps, t_ns), 1), len(stamps) - 1)
    (early, before), (late, behind) = ((each, born[each]) for each in stamps[index - 1 : index + 1])
    part = (t_ns - early) / (late - early)
    names = ("position_m", "speed_mps", "mu")
    between = {name: (1.0 - part) * getattr(before, name) + part * getattr(behind, name) for name in names}
    return before._replace(t_ns=before.t_ns + round(part * (behind.t_ns - before.t_ns)), **between)


def _rows(lane: Lane, result: LaneResult) -> Rows:
    """Estimates under the brake, an array of `ROW`."""
    born = lane.run.born
    stamps = sorted(born)
    braked = [(output, _truth_at(born, stamps, output.prediction.estimate.t_ns)) for output in result.outputs]
    braked = [(output, truth) for output, truth in braked if truth.pressure_pa > 0.0]
    onset = next((truth.speed_mps for truth in born.values() if truth.pressure_pa > 0.0), 0.0)
    rows = np.array(
        [
            (
                *(lane.run.seed, lane.start_mu, truth.t_ns, output.out_s),
                *(truth.position_m, truth.speed_mps, truth.mu, math.nan),
                *(e.mu, e.mu_std, e.mu_lower, e.position_m, e.speed_mps, length_m(output.prediction)),
                *(truth.regime == ADHESION_LIMITED, False, e.regime is Regime.ADHESION_LIMITED),
                *(e.withheld, output.at_end),
                *(e.window, output.accepted - result.accepted_before, e.changes),
            )
            for output, truth in braked
            for e in (output.prediction.estimate,)
        ],
        dtype=ROW,
    )
    rows["scored"] = rows["limited"] & (rows["true_speed_mps"] < onset - CONVERGED_AFTER_MPS)
    if not np.isnan(rows["safe_m"]).all():
        rows["true_stopping_m"] = stopping_m(lane.run.world, rows["true_position_m"], rows["true_speed_mps"])
    return rows


def length_m(prediction: Prediction) -> float:
    """Length, m, of the safe curve; NaN where there is none."""
    return math.nan if prediction.safe is None else float(prediction.safe.distance_m[-1])
