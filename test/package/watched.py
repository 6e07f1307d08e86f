# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A pipeline under watch: what it publishes is sound, and every position is accounted for."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from hypothesis import strategies as st

from adhesion_node.core import Config, Outcome
from adhesion_node.core.intake.samples import PositionSample, Sample
from adhesion_node.core.methods.protocol import MethodWindow
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire.messages.refused import Reason, Rejected
from adhesion_node.wire.topics import POSITIONS

S = 10**9
START_NS = 1000 * S

LOOSE = [0.0, -0.0, 1.0, 0.25, 1e-12, 1e8, 1e-13, 5e-324, 1e7, -1e7, 1e9, 1e154, 1e308, -1e308]
NUMBERS = st.sampled_from([*LOOSE, math.nan, math.inf, -math.inf]) | st.floats()

CONFIGS = st.builds(
    Config,
    iterations=st.just(3),
    particles=st.just(8),
    window=st.sampled_from([20, 10]),
    step=st.sampled_from([1, 5, 9]),
    max_lag_s=st.sampled_from([0.0, 0.5]),
    max_outliers=st.sampled_from([1, 10]),
    pressure_wait_s=st.sampled_from([0.0, 0.2, 60.0]),
    start_mu=st.sampled_from([0.0, 0.05, 0.12, 1.0]),
    speed_source=st.sampled_from(["axle", "radar"]),
)


def _lasted_s(window: MethodWindow, step: int) -> float:
    """How long it was at most when it was last evaluated."""
    return (window.samples[-step].t_ns - window.samples[0].t_ns) * 1e-9


class Watched:
    """A pipeline whose promises are checked at each sample."""

    def __init__(self, config: Config) -> None:
        self.pipeline = Pipeline(config, 1)
        self.positions = 0
        self.refused_positions = 0
        self._last_ns: int | None = None
        self._resets = 0

    def push(self, sample: Sample) -> None:
        self.positions += isinstance(sample, PositionSample)
        self._check(self.pipeline.push(sample))
        self._note()
        pipeline, config = self.pipeline, self.pipeline.config
        window = pipeline.state.window
        if window is not None and len(window.samples) >= config.window + config.step:
            assert _lasted_s(window, config.step) < config.shortest_window_s

    def refuse(self, topic: str, refusal: Rejected) -> None:
        assert Reason[refusal.reason].value in str(refusal)
        is_position = any(topic == one.name for one in POSITIONS)
        self.positions += is_position
        self.refused_positions += is_position
        self.pipeline.refuse(topic, refusal.reason)

    def finish(self) -> None:
        self._check(self.pipeline.finish())
        self._note()
        assert self.pipeline.accepted + self.refused_positions == self.positions == self.pipeline.measurements

    def _note(self) -> None:
        """Count the positions among what was not used."""
        for event in self.pipeline.events:
            same = event.outcome in (Outcome.STUCK, Outcome.HELD) and event.detail.startswith("position")
            of_positions = same or event.outcome in (Outcome.LATE, Outcome.OUTLIER, Outcome.SLIDING)
            self.refused_positions += of_positions or event.detail.startswith("PositionSample")

    def _check(self, predictions: list[Prediction]) -> None:
        resets = self.pipeline.state.counts[Outcome.RESET]
        stamps = [prediction.estimate.t_ns for prediction in predictions]
        if resets == self._resets and self._last_ns is not None:
            stamps = [self._last_ns, *stamps]
        if resets == self._resets:
            assert all(one < other for one, other in pairwise(stamps)), stamps
        for prediction in predictions:
            check_numbers(prediction)
        if stamps:
            self._last_ns = stamps[-1]
        if resets != self._resets:  # before or behind it: the stamps begin anew
            self._last_ns, self._resets = None, resets


def check_numbers(prediction: Prediction) -> None:
    estimate = prediction.estimate
    numbers = [value for value in estimate if isinstance(value, (int, float))]
    assert all(map(math.isfinite, numbers)), estimate
    assert 0.0 <= estimate.mu_lower <= estimate.mu, estimate
    assert min(estimate.mu_std, estimate.position_std_m, estimate.speed_std_mps) >= 0.0, estimate
    for curve in (prediction.safe, prediction.nominal):
        check_curve(curve)


def check_curve(curve: BrakingCurve | None) -> None:
    if curve is None:
        return
    columns = (curve.distance_m, curve.speed_mps, curve.deceleration_mps2, curve.time_s)
    assert all(np.isfinite(column).all() for column in columns)
    assert (np.diff(curve.distance_m) >= 0.0).all()
    assert (np.diff(curve.time_s) >= 0.0).all()
