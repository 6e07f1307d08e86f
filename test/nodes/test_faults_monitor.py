# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The monitor behind the estimator, over DDS: sensors that mislead must not leave the train without a brake."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import messages
import pytest
from conftest import SpinUntil
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core.atp.supervision import Level
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics

START_NS, STEP_NS = 1000 * 10**9, 10**8
RELEASED_PA = 101_325.0
QUIET = {"use_sim_time": True, "clock_timeout_s": 3600.0}


class Told(NamedTuple):
    """What the monitor said last at a time of the run, s."""

    t_s: float
    level: Level | None
    why: str


class Train(NamedTuple):
    """Plays the sensors of a coasting train to an estimator, and listens to the monitor behind it."""

    executor: SingleThreadedExecutor
    spin_until: SpinUntil
    estimator: Estimator
    monitor: AtpMonitor
    driver: Node
    frame: str = "track"

    @property
    def values(self) -> dict[str, str]:
        """The numbers behind what the monitor said last."""
        return self.monitor._told()[1]

    def run(self, measured_m: Callable[[float], float], duration_s: float) -> list[Told]:
        """Publish ten positions a second, of `measured_m` over time."""
        clock = qos.advertise(self.driver, topics.CLOCK, qos.SENSOR_PUBLISHER)
        position = qos.advertise(self.driver, topics.POSITION, qos.SENSOR_PUBLISHER)
        pressure = qos.advertise(self.driver, topics.BRAKE_PRESSURE, qos.SENSOR_PUBLISHER)
        heard: list[str] = []
        qos.subscribe(self.driver, topics.ATP_STATUS, lambda status: heard.append(status.status[0].message))
        self.spin_until(self.executor, lambda: position.get_subscription_count() == 1)
        self.spin_until(self.executor, lambda: pressure.get_subscription_count() == 1)
        self.spin_until(self.executor, lambda: self.monitor._status.get_subscription_count() == 1)
        told = []
        for step in range(round(duration_s * 10)):
            now_ns = START_NS + step * STEP_NS
            while any(node.get_clock().now().nanoseconds != now_ns for node in (self.estimator, self.monitor)):
                clock.publish(messages.clock(now_ns))
                self.executor.spin_once(timeout_sec=0.05)
            pressure.publish(messages.brake_pressure(now_ns, RELEASED_PA, 100.0))
            place = messages.position(now_ns, measured_m(step / 10), 0.5)
            place.header.frame_id = self.frame
            position.publish(place)
            self.spin_until(self.executor, partial(self.at_rest, step + 1, heard))
            told.append(Told(step / 10, self.monitor._level, heard[-1] if heard else ""))
        return told

    def at_rest(self, sent: int, heard: list[str]) -> bool:
        """Whether everybody has taken what the others said."""
        results = (topics.STATE, topics.BRAKING_CURVE)
        return (
            self.estimator.heard[topics.POSITION] == sent
            and all(self.monitor.heard[topic] == self.estimator.published[topic] for topic in results)
            and len(heard) == self.monitor.published[topics.ATP_STATUS]
        )


@pytest.fixture
def train(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Train:
    def overrides(**values: object) -> list[Parameter]:
        return [Parameter(name, value=value) for name, value in {**QUIET, **values}.items()]

    estimator = Estimator(context=context, parameter_overrides=overrides(sensor_timeout_s=3600.0))
    target = overrides(target_position_m=6000.0, target_speed_kmh=0.0)
    monitor = AtpMonitor(context=context, parameter_overrides=target)
    driver = Node("driver", context=context)
    for node in (estimator, monitor, driver):
        executor.add_node(node)
    return Train(executor, spin_until, estimator, monitor, driver)


def known(told: list[Told]) -> list[float]:
    """Times at which a distance was read off."""
    return [one.t_s for one in told if "no safe distance is known" not in one.why]


def test_a_frozen_position_is_believed_for_two_seconds_at_most(train: Train) -> None:
    """A train that goes on, accelerating, behind a sensor that stands still: the estimator moves it on for ever."""
    told = train.run(lambda t: 30.0 * min(t, 10.0), 40.0)
    assert [one.level for one in told[30:95]] == [Level.NORMAL] * 65
    last = max(known(told))
    assert 10.0 < last <= 12.0
    assert {one.level for one in told if one.t_s > last} == {Level.EMERGENCY_BRAKE}
    assert "state is too unsure: its position has a standard deviation of" in told[-1].why


def test_a_falling_chainage_is_told_within_two_seconds_and_for_good(train: Train) -> None:
    told = train.run(lambda t: 9000.0 - 80.0 * t, 40.0)
    assert max(known(told), default=0.0) <= 2.0
    assert told[-1].level is Level.EMERGENCY_BRAKE
    assert "the train runs back" in told[-1].why
    assert "positions must grow in the direction of travel" in told[-1].why


def test_a_train_met_at_speed_is_supervised_from_its_first_estimate(train: Train) -> None:
    told = train.run(lambda t: -14000.0 + 70.0 * t, 6.0)  # a way that the least adhesion is enough for
    assert min(known(told)) <= 0.7  # the first one knows the speed to 5 m/s only
    assert {one.level for one in told if one.t_s >= 0.7} == {Level.NORMAL}
