# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Whatever the sensors send, the pipeline stands: arbitrary streams of good and bad samples and messages.

Hypothesis draws what follows what: pieces of a real braking, garbage, duplicates, late ones, jumps of the clock.
"""

from __future__ import annotations

import math
import pickle
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from oracles import ride

from adhesion_node.core import Config, Measurement, Outcome
from adhesion_node.core.intake import stream
from adhesion_node.core.intake.samples import PositionSample, PressureSample, Sample, SpeedSample
from adhesion_node.core.methods.particle_em import method as particle_em
from adhesion_node.core.methods.particle_em.em import EStep, Identified, Search, identify
from adhesion_node.core.methods.protocol import MethodWindow
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.core.prediction import Prediction
from adhesion_node.run.pipeline import Pipeline
from adhesion_node.wire.line import FRAME, MAX_ABSOLUTE_PA, Line
from adhesion_node.wire.messages.refused import Reason, Rejected
from adhesion_node.wire.topics import POSITIONS, SENSORS
from adhesion_node.wire.track_line import line_of

S = 10**9
GOOD = ride([(3.0, 0.0), (9.0, 410e3), (1.0, 0.0), (3.0, 200e3)])
START_NS = 1000 * S

LOOSE = [0.0, -0.0, 1.0, 0.25, 1e-12, 1e8, 1e-13, 5e-324, 1e7, -1e7, 1e9, 1e154, 1e308, -1e308]
NUMBERS = st.sampled_from([*LOOSE, math.nan, math.inf, -math.inf]) | st.floats()
PRESSURES_PA = st.sampled_from([math.nan, math.inf, 0.0, 1e-300, MAX_ABSOLUTE_PA]) | st.floats(0.0, MAX_ABSOLUTE_PA)
OFFSETS_NS = st.sampled_from([0, 1, -1, S // 20, -S // 20, S, -S, 5 * S, -5 * S, 59 * S, 100 * S, -100 * S, 3600 * S])
"""Of a stray sample against the good ones around it."""
JUMPS_NS = st.sampled_from([0, 1, -S, S, 3 * S, -30 * S, 30 * S, -100 * S, 100 * S, 3600 * S, 10**18])

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


def strays() -> st.SearchStrategy[tuple[Any, ...]]:
    """A sample at an offset from the good ones."""
    return st.one_of(
        st.tuples(st.just(PositionSample), OFFSETS_NS, NUMBERS, NUMBERS),
        st.tuples(st.just(PressureSample), OFFSETS_NS, PRESSURES_PA),
        st.tuples(st.just(SpeedSample), OFFSETS_NS, NUMBERS),
    )


PIECES = st.one_of(
    st.tuples(st.just("good"), st.integers(1, 60)),
    st.tuples(st.just("backwards"), st.integers(2, 10)),
    st.tuples(st.just("without pressure"), st.integers(1, 30)),
    st.tuples(st.just("speed"), st.integers(1, 20)),
    st.tuples(st.just("again"), st.integers(1, 5)),
    st.tuples(st.just("elsewhere"), st.integers(1, 15)),
    st.tuples(st.just("jump"), JUMPS_NS),
    st.tuples(st.just("stray"), strays()),
)


def samples_of(pieces: Iterable[tuple[str, Any]]) -> Iterator[Sample]:
    """Yield the samples of a stream: the good run goes on from piece to piece, and around."""
    place, origin_ns = 0, START_NS
    for kind, value in pieces:
        if kind == "jump":
            origin_ns += value
            continue
        if kind == "stray":
            sample, offset_ns, *numbers = value
            yield sample(origin_ns + GOOD[place % len(GOOD)].t_ns + offset_ns, *numbers)
            continue
        piece = [shifted(number, origin_ns) for number in range(place, place + value)]
        place += 0 if kind == "again" else value
        for good in reversed(piece) if kind == "backwards" else piece:
            if kind not in ("without pressure", "again"):
                yield PressureSample(good.t_ns, good.brake_pressure_pa or 0.0)
            if kind == "speed":
                yield SpeedSample(good.t_ns, 70.0)
            yield PositionSample(good.t_ns, good.position_m + 5000.0 * (kind == "elsewhere"), good.variance_m2)


def shifted(number: int, origin_ns: int) -> Measurement:
    """Return a measurement of the good run, which begins anew at its end."""
    rounds, index = divmod(number, len(GOOD))
    return GOOD[index]._replace(t_ns=origin_ns + rounds * (GOOD[-1].t_ns + S // 10) + GOOD[index].t_ns)


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


@given(config=CONFIGS, pieces=st.lists(PIECES, max_size=12))
@example(config=Config(), pieces=[("again", 1), ("jump", 1), ("good", 1)])  # a position that is said twice
def test_any_stream_of_samples(config: Config, pieces: list[tuple[str, Any]]) -> None:
    watched = Watched(config)
    for sample in samples_of(pieces):
        watched.push(sample)
    watched.finish()


def fields(name: str, value: Any) -> Any:
    """Return an object with a nested attribute, given by its path."""
    for part in reversed(name.split(".")):
        value = SimpleNamespace(**{part: value})
    return value


SENSED = {topic.name: topic for topic in SENSORS}

HEADERS = st.builds(
    lambda sec, nanosec, frame: SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec), frame_id=frame),
    st.sampled_from([0, 1, 2, 3, 63, -(2**31), 2**31 - 1]) | st.integers(-(2**31), 2**31 - 1),
    st.sampled_from([0, 1, 5 * 10**8, 2**32 - 1]),
    st.sampled_from([FRAME, FRAME, FRAME, "", "map"]),
)
VARIANCES = NUMBERS | st.just(0.25)
POSES = st.builds(
    lambda x, variance: SimpleNamespace(pose=fields("position.x", x), covariance=[variance, *[0.0] * 35]),
    NUMBERS,
    VARIANCES,
)
TWISTS = st.builds(
    lambda x, variance: SimpleNamespace(twist=fields("linear.x", x), covariance=[variance, *[0.0] * 35]),
    NUMBERS,
    VARIANCES,
)
MERIDIAN = Line(track=line_of("a meridian", np.array([47.0, 47.1]), np.array([8.0, 8.0]), None, 0.0))
MESSAGES = st.one_of(
    st.tuples(
        st.sampled_from(["position", "odometry"]),
        st.builds(lambda h, pose: SimpleNamespace(header=h, pose=pose), HEADERS, POSES),
    ),
    st.tuples(
        st.just("fix"),
        st.builds(
            lambda h, latitude, longitude, spread, kind: SimpleNamespace(
                header=h,
                status=SimpleNamespace(status=0),
                latitude=latitude,
                longitude=longitude,
                position_covariance=spread,
                position_covariance_type=kind,
            ),
            HEADERS,
            NUMBERS | st.floats(46.99, 47.11),
            NUMBERS | st.floats(7.9999, 8.0001),
            st.lists(VARIANCES, min_size=9, max_size=9),
            st.integers(0, 3),
        ),
    ),
    st.tuples(
        st.just("imu"),
        st.builds(
            lambda h, along, spread: SimpleNamespace(
                header=h, linear_acceleration=SimpleNamespace(x=along), linear_acceleration_covariance=[spread] * 9
            ),
            HEADERS,
            NUMBERS,
            VARIANCES | st.just(-1.0),
        ),
    ),
    st.tuples(
        st.sampled_from(["brake_pressure", "brake_demand"]),
        st.builds(lambda h, p: SimpleNamespace(header=h, fluid_pressure=p), HEADERS, NUMBERS | st.just(511325.0)),
    ),
    st.tuples(
        st.just("speed"),
        st.builds(lambda h, twist: SimpleNamespace(header=h, twist=twist), HEADERS, TWISTS),
    ),
    st.tuples(
        st.just("traction_force"),
        st.builds(lambda h, f: SimpleNamespace(header=h, wrench=fields("force.x", f)), HEADERS, NUMBERS),
    ),
    st.tuples(
        st.just("wheel_speed"),
        st.builds(
            lambda h, names, velocities: SimpleNamespace(header=h, name=names, velocity=velocities),
            HEADERS,
            st.lists(st.text(max_size=3), max_size=3),
            st.lists(NUMBERS, max_size=3),
        ),
    ),
)


@given(config=CONFIGS, messages=st.lists(MESSAGES, max_size=25))
def test_any_messages_are_read_or_refused_with_a_remedy(config: Config, messages: list[tuple[str, Any]]) -> None:
    watched = Watched(config)
    for topic, message in messages:
        try:
            sample = SENSED[topic].read(message, MERIDIAN)
        except Rejected as refusal:
            watched.refuse(topic, refusal)
            continue
        if topic == "wheel_speed":
            assert sample.known_radps
        else:
            assert all(value is None or math.isfinite(value) for value in sample)
        if topic != "traction_force":
            watched.push(sample)
    watched.finish()


FLOODS: dict[str, Callable[[int], int]] = {
    "fresh": lambda number: number * S // 1_000,  # of these 200 a second are used
    "one stamp": lambda _: 0,
    "two clocks": lambda number: number % 2 * 30 * S + number * S // 10_000,
    "back and forth": lambda number: number % 100 * S // 1000,
}
"""Stamps of 1000 or 10 000 messages a second."""


@pytest.mark.parametrize("stamps", FLOODS)
@pytest.mark.parametrize("pressures", [True, False])
def test_a_flood_takes_bounded_memory_and_work(stamps: str, pressures: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """No more windows than the accepted measurements allow, no more in memory than the inbox may hold."""
    evaluations = Counter[str]()

    def counted(e_step: EStep, search: Search) -> Identified:
        evaluations["done"] += 1
        return identify(e_step, search)

    monkeypatch.setattr(particle_em, "identify", counted)
    monkeypatch.setattr(stream, "MOST", 500)
    pipeline = Pipeline(Config(method="particle_em", iterations=1, particles=2, window=30, step=20), 1)
    rng = np.random.default_rng(1)
    sizes = []
    for number in range(6_000):
        after_ns = FLOODS[stamps](number)
        if pressures:
            pipeline.push(PressureSample(START_NS + after_ns, 410e3))
        place = 70.0 * after_ns * 1e-9 + 0.5 * rng.standard_normal()
        pipeline.push(PositionSample(START_NS + after_ns, place, 0.25))
        if number % 2_000 == 1_999:
            inbox = pipeline.state.inbox
            kept = (pipeline.state.window, inbox.anchors, [*inbox.others.values()], inbox.suspects)
            sizes.append(len(pickle.dumps(kept)))
    steps = pipeline.accepted / pipeline.config.step
    assert evaluations["done"] <= steps + pipeline.state.counts[Outcome.RESET] + 1
    assert sizes[-1] < 1.5 * sizes[0], sizes
