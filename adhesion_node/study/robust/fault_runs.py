# Copyright 2026 the adhesion_node authors
# SPDX-License-Identifier: Apache-2.0

"""The faulty runs of `study robust` as tasks: message by message through the pipeline, as a live node takes them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_node.train.messages import SensorMessage
from sim_node.train.plant import ADHESION_LIMITED, Truth

from ...core import Outcome
from ...core.prediction import Prediction
from ...run.offline import READERS
from ...run.pipeline import Pipeline
from ...run.score import CONVERGED_AFTER_MPS
from ...wire.codecs import Rejected
from ...wire.topics import FRAME
from ..trial.tasks import EVERY_SOURCE, Arrays
from .fault_cases import Case
from .plain import plain
from .stopping import stopping_distances

ROW = np.dtype(
    [
        ("run", np.int64),
        *((name, np.float64) for name in ("t_s", "out_s", "true_mu", "mu", "std", "lower", "safe_m", "true_m")),
        *((name, np.bool_) for name in ("limited", "late", "withheld")),
        *((name, np.int64) for name in ("window", "fresh", "changes")),
    ]
)
"""An estimate under the brake: true times of its measurement and of its publication; length of its safe curve (NaN:
none) and the true distance to a standstill; whether adhesion truly limits, whether the first 30 km/h of braking are
over, whether mu is withheld; measurements in its window, and accepted since the fault is over; changes of the rail told
so far."""

RUN = np.dtype([("run", np.int64), ("resets", np.int64), ("finite", np.bool_)])
"""A run: how often the estimation started anew, and whether every number of the estimates was finite."""

DROP = np.dtype([("run", np.int64), ("reason", "U32"), ("count", np.int64), ("first_s", np.float64)])
"""Messages of a run that were dropped for one reason; when the first one was."""


class Runs(NamedTuple):
    """Some seeds of a case."""

    case: Case
    first_seed: int
    seeds: int

    @property
    def name(self) -> str:
        """Readable beginning of its file's name."""
        return f"fault-{self.case.plan.fault}-{self.first_seed}"

    @property
    def weight(self) -> float:
        """How much work it is."""
        return float(self.seeds)

    @property
    def sources(self) -> tuple[str, ...]:
        """Where its numbers come from."""
        return EVERY_SOURCE

    def compute(self) -> Arrays:
        """Simulate and estimate every run."""
        runs = [one(self.case, seed) for seed in range(self.first_seed, self.first_seed + self.seeds)]
        return {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}


class Seen(NamedTuple):
    """A prediction, when it came out, and what had been accepted by then."""

    prediction: Prediction
    out_s: float
    accepted: int


def one(case: Case, seed: int) -> Arrays:
    """Simulate one run and hold its estimates against the truth: arrays of `ROW`, `RUN` and `DROP`."""
    pipeline = Pipeline(replace(case.config, track=case.known.track), seed)
    born, seen, first_s = dict[int, Truth](), list[Seen](), dict[str, float]()
    now_s, old = 0.0, 0
    for truth, sent in case.ticks(seed):
        now_s = truth.t_ns * 1e-9
        born.setdefault(truth.t_ns, truth)
        for message in sent:
            born.setdefault(message.t_ns, truth)  # a stamp that is no time of the run stands for that of its birth
            seen += [Seen(prediction, now_s, pipeline.accepted) for prediction in _take(pipeline, message)]
        if sent:
            first_s = dict.fromkeys(pipeline.dropped, now_s) | first_s
        old = pipeline.accepted if now_s < case.over_s else old
    seen += [Seen(prediction, now_s, pipeline.accepted) for prediction in pipeline.finish()]
    numbers = (value for s in seen for value in s.prediction.estimate if isinstance(value, float))
    summary = (seed, pipeline.state.counts[Outcome.RESET], all(map(math.isfinite, numbers)))
    drops = [(seed, reason, count, first_s.get(reason, now_s)) for reason, count in pipeline.dropped.items()]
    return {
        "rows": _rows(case, seed, seen, born, old),
        "runs": np.array([summary], dtype=RUN),
        "drops": np.array(drops, dtype=DROP),
    }


def _take(pipeline: Pipeline, message: SensorMessage) -> list[Prediction]:
    """Give a message to the pipeline as the node and the replay do."""
    try:
        sample = READERS[message.topic.name](plain(message), FRAME)
    except Rejected as refusal:
        pipeline.refuse(message.topic.name, refusal.reason)
        return []
    return pipeline.push(sample)


def _rows(case: Case, seed: int, seen: Sequence[Seen], born: Mapping[int, Truth], old: int) -> NDArray[np.void]:
    """Estimates under the brake, an array of `ROW`; `old` measurements had been accepted before it was over."""
    braked = [(s, born[s.prediction.estimate.t_ns]) for s in seen]
    braked = [(s, truth) for s, truth in braked if truth.pressure_pa > 0.0]
    slow_enough = case.known.speed_mps - CONVERGED_AFTER_MPS
    places = np.array([truth.position_m for _, truth in braked])
    true_m = stopping_distances(case.true, places, np.array([truth.speed_mps for _, truth in braked]))
    return np.array(
        [
            (
                *(seed, truth.t_ns * 1e-9, s.out_s, truth.mu, *s.prediction.estimate[1:4], _length(s.prediction), way),
                *(truth.regime == ADHESION_LIMITED, truth.speed_mps < slow_enough, s.prediction.withheld),
                *(s.prediction.estimate.window, s.accepted - old, s.prediction.estimate.changes),
            )
            for (s, truth), way in zip(braked, true_m.tolist(), strict=True)
        ],
        dtype=ROW,
    )


def _length(prediction: Prediction) -> float:
    """Length, m, of the safe curve; NaN where there is none."""
    return math.nan if prediction.safe is None else float(prediction.safe.distance_m[-1])
