# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Several trains in one process: an estimator for each on one executor, fed through DDS at the pace of the clock."""

import gc
import time
from collections.abc import Callable, Iterator, Mapping
from itertools import chain, islice
from types import MappingProxyType
from typing import Any

import numpy as np
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from ..core.intake.samples import PositionSample, PressureSample
from ..nodes.estimator import Estimator
from ..nodes.ros import qos
from ..nodes.ros.types import new
from ..run.pipeline import Pipeline
from ..wire.line import ATMOSPHERE_PA, FRAME
from ..wire.topics import BRAKE_PRESSURE, POSITION
from .scene import CRUISE_S, journey
from .step import CONFIG
from .timing import figures

WARM_S = 5.0
"""Until all trains brake; what they take before is not counted."""

FOUND_S = 30.0
"""Longest wait for discovery."""

EXECUTORS: Mapping[str, Callable[..., Executor]] = MappingProxyType(
    {"EventsExecutor": EventsExecutor, "SingleThreadedExecutor": SingleThreadedExecutor}
)
"""The one is woken by what happens, the other asks every entity of every node before each callback."""

Pairs = Iterator[tuple[PressureSample, PositionSample]]


class _Train(Estimator):
    """An estimator that notes when it has used a position, and what that took of the processor."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.used_s: dict[int, float] = {}
        self.work_s: list[float] = []

    def take(self, sample: Any) -> Any:
        begun_s = time.thread_time()
        events = super().take(sample)
        if isinstance(sample, PositionSample):
            self.used_s[sample.t_ns] = time.perf_counter()
            self.work_s.append(time.thread_time() - begun_s)
        return events


class _Driver(Node):
    """Publishes the sensors of all trains, one train after the other, each at `rate_hz`."""

    def __init__(self, count: int, rate_hz: float, seed: int, context: Context) -> None:
        super().__init__("driver", namespace="bench", context=context)
        self.due_s: list[dict[int, float]] = [{} for _ in range(count)]
        self._journeys = [_from_before_the_brake(rate_hz, k / count, seed + k) for k in range(count)]
        self.outputs = [
            [qos.advertise(self, one._replace(name=f"train{k}/{one.name}")) for one in (BRAKE_PRESSURE, POSITION)]
            for k in range(count)
        ]
        self._period_s, self._begun_s, self._number = 1.0 / rate_hz / count, time.perf_counter(), 0
        self.create_timer(self._period_s / 2.0, self._publish_due, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def begin(self) -> None:
        """Publish from now on."""
        self._begun_s, self._number = time.perf_counter(), 0

    def _publish_due(self) -> None:
        while (due_s := self._begun_s + self._number * self._period_s) <= time.perf_counter():
            train = self._number % len(self._journeys)
            pressure, position = next(self._journeys[train])
            by_pressure, by_position = self.outputs[train]
            self.due_s[train][position.t_ns] = due_s
            absolute = (pressure.pressure_pa + ATMOSPHERE_PA,)
            by_pressure.publish(BRAKE_PRESSURE.build(new, pressure.t_ns, absolute, 0.0, FRAME))
            by_position.publish(POSITION.build(new, position.t_ns, (position.position_m,), position.variance_m2, FRAME))
            self._number += 1


def share(kind: str, count: int, rate_hz: float, seconds: float, seed: int) -> dict[str, Any]:
    """What braking trains take: of a core, and from when a position is due until its estimate is published, ms."""
    _compile(rate_hz, seed)
    context = Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    executor = EXECUTORS[kind](context=context)
    set_logger_level("bench", LoggingSeverity.ERROR)
    try:
        driver = _Driver(count, rate_hz, seed, context)
        trains = [_Train(namespace=f"bench/train{k}", context=context) for k in range(count)]
        for node in (driver, *trains):
            executor.add_node(node)
        return {"executor": kind, **_measured(executor, driver, trains, seconds)}
    finally:
        gc.unfreeze()
        nodes = list(executor.get_nodes())
        executor.shutdown()
        for node in nodes:
            node.destroy_node()
        context.try_shutdown()


def _measured(executor: Executor, driver: _Driver, trains: list[_Train], seconds: float) -> dict[str, Any]:
    ends = [end for pair in driver.outputs for end in pair]
    _spin(executor, FOUND_S, lambda: all(end.get_subscription_count() for end in ends))
    gc.freeze()  # as the programs of the nodes do
    driver.begin()
    _spin(executor, WARM_S)
    before = [set(sent) for sent in driver.due_s]
    used = sum(len(train.used_s) for train in trains)
    for train in trains:
        train.work_s.clear()
    cpu_s, begun_s = time.process_time(), time.perf_counter()
    _spin(executor, seconds)
    cpu_s, elapsed_s = time.process_time() - cpu_s, time.perf_counter() - begun_s
    used = sum(len(train.used_s) for train in trains) - used
    sent = [
        (train.used_s.get(t_ns), at_s)
        for train, stamps, warm in zip(trains, driver.due_s, before, strict=True)
        for t_ns, at_s in stamps.items()
        if t_ns not in warm
    ]
    work = figures(chain.from_iterable(train.work_s for train in trains))
    took = [used_s - at_s for used_s, at_s in sent if used_s is not None]
    return {
        "trains": len(trains),
        "cores": cpu_s / elapsed_s,
        "cpu_ms_per_position": 1e3 * cpu_s / max(used, 1),
        "cpu_p99_ms": work["p99_ms"],
        "cpu_max_ms": work["max_ms"],
        **figures(took),
        "unused": len(sent) - len(took),
    }


def _spin(executor: Executor, seconds: float, done: Any = None) -> None:
    end_s = time.perf_counter() + seconds
    while time.perf_counter() < end_s and not (done and done()):
        executor.spin_once(timeout_sec=0.05)


def _from_before_the_brake(rate_hz: float, share_: float, seed: int) -> Pairs:
    """A journey from up to `WARM_S` before its first brake on; the trains do not brake all at once."""
    return islice(journey(rate_hz, np.random.default_rng(seed)), round((CRUISE_S - WARM_S * share_) * rate_hz), None)


def _compile(rate_hz: float, seed: int) -> None:
    """Let everything be loaded and compiled that a braking needs."""
    pipeline = Pipeline(CONFIG, seed)
    for pair in islice(_from_before_the_brake(rate_hz, 1.0, seed), round(2.0 * WARM_S * rate_hz)):
        for sample in pair:
            pipeline.push(sample)
