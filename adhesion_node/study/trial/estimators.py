# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a trial tries: an estimator's settings, and the ways in which it runs through simulated runs."""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

from sim_node.train.scenario import find

from ...core import Config, Estimate, finish, init
from ...core.following import follow
from ...core.methods import METHODS
from ...core.prediction import Prediction
from ...run.pipeline import Pipeline
from ..baselines.ekf import TUNED, Tuning, ekf, ride_of
from .world import Refusal, Sent, SimulatedRun

EXACT = Config(
    method="rail_condition",
    law_probability=0.9,
    grade_std=0.0,
    profile_std=0.0,
    resistance_std=0.0,
    mass_std=0.0,
    brake_std=0.0,
    rotating_mass_std=0.0,
)
"""The paper's world: train and track are known exactly, and the shape of the law nearly."""


class Lane(NamedTuple):
    """A simulated run from one start of mu."""

    run: SimulatedRun
    start_mu: float


class Output(NamedTuple):
    """A prediction, when it came out, how much had been accepted by then, and whether the end of the data gave it."""

    prediction: Prediction
    out_s: float
    accepted: int = 0
    at_end: bool = False


class LaneResult(NamedTuple):
    """What came out of a lane."""

    outputs: list[Output]
    resets: int = 0
    accepted_before: int = 0
    """Measurements accepted before the fault was over."""
    dropped: Mapping[str, int] = MappingProxyType({})
    """Messages that were not used, by reason."""
    dropped_s: Mapping[str, float] = MappingProxyType({})
    """When the first one was."""


class LaneResults(NamedTuple):
    """The results of all lanes."""

    results: list[LaneResult]
    window_ms: list[float]
    """Time per window, all included, or per estimate without windows: of each lane."""


class Estimator(NamedTuple):
    """A way to run and its settings."""

    config: Config = EXACT
    """The start of mu is that of the lane."""
    way: str = "pipeline"
    """One of `WAYS`."""
    tuning: Tuning = TUNED
    """Of the way "ekf"."""
    knows_track: bool = True
    seed_shift: int = 0
    """Added to a run's seed it gives that of its estimator."""

    def config_in(self, lane: Lane) -> Config:
        """Settings for a lane."""
        track = find(lane.run.world.scenario).track if self.knows_track else self.config.track
        return replace(self.config, track=track, start_mu=lane.start_mu)

    def seed_in(self, lane: Lane) -> int:
        """Seed for a lane."""
        return lane.run.seed + self.seed_shift

    @property
    def heeds_start(self) -> bool:
        """Whether the start of mu makes a difference: the bank has none."""
        return self.config.method in METHODS

    def run(self, lanes: Sequence[Lane]) -> LaneResults:
        """Run through all lanes."""
        return WAYS[self.way].run(self, lanes)


def _by_pipeline(estimator: Estimator, lane: Lane) -> LaneResult:
    """Sample by sample through the pipeline, as the live node and the replay run."""
    pipeline = Pipeline(estimator.config_in(lane), estimator.seed_in(lane))
    return through(pipeline, lane.run.sent, lane.run.world.over_s)


def through(pipeline: Pipeline, sent: Iterable[Sent], over_s: float = 0.0) -> LaneResult:
    """Push what is received in its order; the fault, if there is one, is over at `over_s`."""
    outputs, first_s = list[Output](), dict[str, float]()
    now_s, before = 0.0, 0
    for now_s, received in sent:
        for sample in received:
            if isinstance(sample, Refusal):
                pipeline.refuse(*sample)
            else:
                outputs += [Output(prediction, now_s, pipeline.accepted) for prediction in pipeline.push(sample)]
        if received:
            first_s = dict.fromkeys(pipeline.dropped, now_s) | first_s
        before = pipeline.accepted if now_s < over_s else before
    outputs += [Output(prediction, now_s, pipeline.accepted, at_end=True) for prediction in pipeline.finish()]
    dropped = pipeline.dropped
    dropped_s = {reason: first_s.get(reason, now_s) for reason in dropped}
    return LaneResult(outputs, pipeline.resets, before, dropped, dropped_s)


def _by_core(estimator: Estimator, lane: Lane) -> LaneResult:
    """Measurement by measurement through the core alone: no gate, as they are paired already, and no curves."""
    config = estimator.config_in(lane)
    state, estimates = init(config, estimator.seed_in(lane)), list[Estimate]()
    for measurement in lane.run.measurements:
        state, estimate = follow(config, state, measurement)
        estimates += [] if estimate is None else [estimate]
    return _estimated([*estimates, *finish(config, state)[1]])


def _estimated(estimates: Iterable[Estimate]) -> LaneResult:
    """What came out where nothing is known but the estimates."""
    return LaneResult([Output(Prediction(estimate, None, None), estimate.t_ns * 1e-9) for estimate in estimates])


def _one_by_one(run: Callable[[Estimator, Lane], LaneResult]) -> Callable[[Estimator, Sequence[Lane]], LaneResults]:
    def tried(estimator: Estimator, lanes: Sequence[Lane]) -> LaneResults:
        results, window_ms = list[LaneResult](), list[float]()
        for before, lane in zip((None, *lanes), lanes, strict=False):
            if before and before.run is lane.run and not estimator.heeds_start:
                results.append(results[-1])
                continue
            started = time.perf_counter()
            results.append(run(estimator, lane))
            spent_ms, outputs = 1e3 * (time.perf_counter() - started), results[-1].outputs
            windows = sum(output.prediction.estimate.window > 0 for output in outputs)
            window_ms.append(spent_ms / max(windows or len(outputs), 1))
        return LaneResults(results, window_ms)

    return tried


def _by_ekf(estimator: Estimator, lanes: Sequence[Lane]) -> LaneResults:
    """All lanes, of one world, side by side through the extended Kalman filter."""
    started, config = time.perf_counter(), estimator.config_in(lanes[0])
    rides = {lane.run.seed: lane.run.measurements for lane in lanes}
    taken = {seed: ride_of(config, measurements) for seed, measurements in rides.items()}
    starts = [lane.start_mu for lane in lanes]
    estimates = ekf(config, estimator.tuning, starts, [taken[lane.run.seed] for lane in lanes])
    mean_ms = 1e3 * (time.perf_counter() - started) / max(sum(map(len, estimates)), 1)
    return LaneResults([_estimated(of_lane) for of_lane in estimates], [mean_ms] * len(lanes))


class Way(NamedTuple):
    """How an estimator runs through its lanes."""

    run: Callable[[Estimator, Sequence[Lane]], LaneResults]
    weight: float
    """Work of a lane, in that of a Kalman filter, about."""
    lanes: int = 50
    """In a task."""


WAYS: Mapping[str, Way] = {
    "pipeline": Way(_one_by_one(_by_pipeline), 8.0, 10),
    "core": Way(_one_by_one(_by_core), 6.0),
    "ekf": Way(_by_ekf, 1.0),
}
"""By name."""
