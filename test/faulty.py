# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Simulated runs with a fault through the pipeline, to be held beside the same run without it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from messages import message_of

from adhesion_node.core import Config, Estimate
from adhesion_node.core.intake.samples import Sample
from adhesion_node.core.physics.train import Array
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire import topics
from adhesion_node.wire.topic import Topic
from sim_node.faults.plan import Plan, faulty_run, period_of
from sim_node.train.plant import Truth
from sim_node.train.scenario import find
from sim_node.train.sensors import SensorSettings

S = 10**9
SETTINGS = SensorSettings()
READERS: dict[Topic, Callable[[Any], Sample]] = {topic: topic.read for topic in topics.ADHESION_INPUTS}


class Outcome(NamedTuple):
    """A run's estimates, the truth by stamp, and the pipeline at its end."""

    predictions: list[Prediction]
    truth: dict[int, Truth]
    pipeline: Pipeline

    def true(self, t_ns: int) -> Truth:
        """The truth at a stamp, or at the one nearest to that of an estimate without a position."""
        return (
            self.truth[t_ns] if t_ns in self.truth else self.truth[min(self.truth, key=lambda each: abs(each - t_ns))]
        )

    def braking(self) -> list[Estimate]:
        """Estimates of settled, adhesion-limited braking."""
        first = max(truth.speed_mps for truth in self.truth.values())
        settled = [p.estimate for p in self.predictions if first - self.true(p.estimate.t_ns).speed_mps > 30 / 3.6]
        return [e for e in settled if self.true(e.t_ns).regime == "ADHESION_LIMITED"]

    def errors(self) -> Array:
        """Errors of mu while it can be seen."""
        return np.array([e.mu - self.true(e.t_ns).mu for e in self.braking()])

    def by_second(self) -> dict[int, Estimate]:
        """The last estimate of every second."""
        return {p.estimate.t_ns // S: p.estimate for p in self.predictions}


@cache
def outcome(
    fault: str,
    seed: int = 1,
    start_s: float = 30.0,
    duration_s: float = 0.0,
    share: float = 0.0,
    knows_track: bool = False,
    knows_law: bool = False,
) -> Outcome:
    plan, scenario = Plan(fault, start_s, duration_s, share), find("tunnel_entry")
    config = Config(track=scenario.track) if knows_track else Config()
    config = replace(config, law_probability=0.9) if knows_law else config
    pipeline, predictions, truths = Pipeline(config, 1), list[Prediction](), {}
    for truth, sent in faulty_run(plan, scenario, period_of(plan, 0.1), seed, SETTINGS):
        truths[truth.t_ns] = truth
        for message in sent:
            predictions += pipeline.push(READERS[message.topic](message_of(message)))
    return Outcome(predictions + pipeline.finish(), truths, pipeline)


def assert_sound(run: Outcome) -> None:
    """Every number is finite and the stamps strictly increase."""
    assert all(later.estimate.t_ns > earlier.estimate.t_ns for earlier, later in pairwise(run.predictions))
    assert all(math.isfinite(value) for p in run.predictions for value in p.estimate if isinstance(value, float))
