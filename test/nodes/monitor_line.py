# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A monitor as a node, and who plays clock and estimator for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import messages
import numpy as np
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics
from adhesion_node.wire.messages.parts import stamp_ns

NAMESPACE = "/atp_test"

START_S = 1000.0
SETTINGS = {
    "target_position_m": 5000,  # an integer on purpose
    "target_speed_kmh": 0.0,
    "emergency_build_up_s": 2.0,
    "service_build_up_s": 3.0,
    "service_deceleration_mps2": 5.0,
    "acceleration_mps2": 0.0,
    "speed_margin_mps": 0.0,
    "position_margin_m": 10.0,
    "margin_sigma": 0.0,
    "valid_for_s": 2.0,
    "check_rate_hz": 2.0,
    "clock_timeout_s": 3600.0,  # the tests' clock stands between their steps
    "use_sim_time": True,
}
# 40 m/s to a stand at 0.8 m/s^2: 1000 m; 2 s of build-up at 40 m/s: 80 m; 10 m of position margin.
NEEDED_M = 1000.0 + 80.0 + 10.0


def constant_curve(first_mps: float, deceleration_mps2: float) -> BrakingCurve:
    speed = np.linspace(first_mps, 0.0, 64)
    return BrakingCurve(
        distance_m=(first_mps**2 - speed**2) / (2 * deceleration_mps2),
        speed_mps=speed,
        deceleration_mps2=np.full_like(speed, deceleration_mps2),
        time_s=(first_mps - speed) / deceleration_mps2,
    )


@dataclass
class Line:
    """A monitor, and a driver node that plays clock and estimator and listens."""

    executor: SingleThreadedExecutor
    spin_until: SpinUntil
    monitor: AtpMonitor
    driver: Node
    heard: list[DiagnosticArray] = field(default_factory=list)
    pairs: int = 0

    def __post_init__(self) -> None:
        qos.subscribe(self.driver, topics.ATP_STATUS, self.heard.append, qos.RESULT)
        self.clock = self.driver.create_publisher(Clock, "/clock", 10)
        self.state = qos.advertise(self.driver, topics.STATE, qos.RESULT)
        self.curve = qos.advertise(self.driver, topics.BRAKING_CURVE, qos.LATCHED)
        ends = (self.state, self.curve, self.monitor._status)
        self.spin_until(self.executor, lambda: all(end.get_subscription_count() == 1 for end in ends))

    def set_time(self, time_s: float) -> None:
        wanted_ns = round(time_s * 1e9)

        def arrived() -> bool:
            if self.monitor.get_clock().now().nanoseconds == wanted_ns:
                return True
            self.clock.publish(Clock(clock=messages.header(wanted_ns).stamp))  # again: it is best effort
            return False

        self.spin_until(self.executor, arrived)

    def send_curve(self, message: Any) -> None:
        """Publish a curve and wait until the monitor has it: the state that follows must not overtake it."""
        before = self.monitor._known.curve
        self.curve.publish(message)
        self.spin_until(self.executor, lambda: self.monitor._known.curve is not before)

    def send_state(self, message: Any) -> DiagnosticStatus:
        """Publish a state; return what the monitor says once it has it."""
        before = self.monitor._known.state
        self.state.publish(message)
        self.spin_until(self.executor, lambda: self.monitor._known.state is not before)
        self.spin_until(self.executor, lambda: stamp_ns(self.heard[-1].header) == self.monitor._stamp_ns)
        (status,) = self.heard[-1].status
        return status

    def send_pair(self, position_m: float, speed_mps: float = 40.0, offset_s: float = 0.0) -> DiagnosticStatus:
        """Publish a curve and a state of one stamp, a nanosecond behind the pair before."""
        self.pairs += 1
        stamp_s = offset_s - 1e-6 + 1e-9 * self.pairs
        self.send_curve(curve(stamp_s, position_m))
        return self.send_state(state(position_m, speed_mps, stamp_s))

    def tick_twice(self, offset_s: float) -> DiagnosticStatus:
        """Let the watchdog pass by once and then speak, 1.2 s behind `offset_s`; return what it says."""
        self.monitor._known = self.monitor._known._replace(judged=True)
        self.set_time(START_S + offset_s + 0.6)
        self.spin_until(self.executor, lambda: not self.monitor._known.judged)
        return self.next_status(lambda: self.set_time(START_S + offset_s + 1.2))

    def next_status(self, act: Callable[[], None]) -> DiagnosticStatus:
        count = len(self.heard)
        act()
        self.spin_until(self.executor, lambda: len(self.heard) > count)
        (status,) = self.heard[-1].status
        return status


def supervised(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil, **values: Any) -> Line:
    """Return a line whose monitor has judged once."""
    overrides = [Parameter(name, value=value) for name, value in {**SETTINGS, **values}.items()]
    monitor = AtpMonitor(context=context, namespace=NAMESPACE, parameter_overrides=overrides)
    driver = Node("driver", context=context, namespace=NAMESPACE)
    executor.add_node(monitor)
    executor.add_node(driver)
    made = Line(executor, spin_until, monitor, driver)
    made.next_status(lambda: made.set_time(START_S))  # the watchdog's first
    return made


def t_ns(offset_s: float = 0.0) -> int:
    return round((START_S + offset_s) * 1e9)


def state(position_m: float, speed_mps: float = 40.0, offset_s: float = 0.0) -> Any:
    return messages.state_message(t_ns(offset_s), position_m, 0.01, speed_mps, 0.01)


def curve(offset_s: float = 0.0, position_m: float = 0.0) -> Any:
    return messages.curve_message(t_ns(offset_s), constant_curve(45.0, 0.8), position_m)


def values(status: DiagnosticStatus) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}
