# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The ATP monitor as a node: silence is no comfort, of the clock, of curves, of states."""

from __future__ import annotations

import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from monitor_line import NAMESPACE, NEEDED_M, SETTINGS, START_S, Line, state, supervised, values
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics
from adhesion_node.wire.messages.parts import stamp_ns


@pytest.fixture
def line(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Line:
    return supervised(context, executor, spin_until)


def test_a_clock_that_stands_still_is_an_emergency(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    quick = {**SETTINGS, "clock_timeout_s": 0.1, "check_rate_hz": 20.0}
    overrides = [Parameter(name, value=value) for name, value in quick.items()]
    monitor = AtpMonitor(context=context, namespace=NAMESPACE, parameter_overrides=overrides)
    heard: list[DiagnosticArray] = []
    driver = Node("driver", context=context, namespace=NAMESPACE)
    qos.subscribe(driver, topics.ATP_STATUS, heard.append, qos.RESULT)
    executor.add_node(monitor)
    executor.add_node(driver)
    # No /clock at all, so that no timer of the ROS clock ever fires.
    spin_until(executor, lambda: heard and "the clock has stood still for" in heard[-1].status[0].message)
    assert monitor.get_clock().now().nanoseconds == 0
    (status,) = heard[-1].status
    assert (values(status)["level"], status.level) == ("EMERGENCY_BRAKE", DiagnosticStatus.ERROR)


def test_a_clock_that_stops_after_the_last_judgement_is_seen(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    made = supervised(context, executor, spin_until, clock_timeout_s=0.5, check_rate_hz=10.0)
    made.set_time(START_S + 0.05)  # less than a tick of the watchdog: nothing judges at this time
    told: list[str] = []

    def stands() -> bool:
        told[:] = [status.message for message in made.heard for status in message.status]
        return "the clock has stood still" in told[-1]

    spin_until(executor, stands)


def test_the_clock_moving_again_ends_the_emergency_of_its_standing(line: Line) -> None:
    line.monitor._clock_timeout_s = -1.0  # as if it had stood for long
    assert "stood still" in line.send_pair(0.0).message
    line.monitor._clock_timeout_s = 3600.0
    assert values(line.send_pair(0.0))["level"] == "NORMAL"


def test_without_a_curve_the_train_must_stop(line: Line) -> None:
    status = line.send_state(state(0.0))
    assert (values(status)["level"], status.level) == ("EMERGENCY_BRAKE", DiagnosticStatus.ERROR)
    assert "braking curve: none received yet" in status.message
    assert not {"margin_m", "permitted_mps"} & set(values(status))


def test_the_watchdog_speaks_in_silence_and_says_what_has_expired(line: Line) -> None:
    assert values(line.send_pair(0.0))["level"] == "NORMAL"
    # 0.5 s per tick; the tick after a judgement stays silent, the next one speaks.
    count = len(line.heard)
    status = line.tick_twice(0.0)
    assert len(line.heard) == count + 1
    assert values(status)["level"] == "NORMAL"
    assert float(values(status)["margin_m"]) == pytest.approx(5000.0 - 40.0 * 1.2 - NEEDED_M, abs=1.0)
    line.next_status(lambda: line.set_time(START_S + 1.7))
    status = line.next_status(lambda: line.set_time(START_S + 2.3))
    assert (values(status)["level"], status.level) == ("EMERGENCY_BRAKE", DiagnosticStatus.ERROR)
    assert "state expired: 2.3 s old, valid for 2 s" in status.message
    stamps = [stamp_ns(message.header) for message in line.heard]
    assert stamps == sorted(set(stamps))


def test_a_curve_expires_while_states_still_come(line: Line) -> None:
    line.send_pair(0.0)
    line.set_time(START_S + 3.0)
    line.send_state(state(100.0, offset_s=3.0))
    assert "braking curve expired: 4.2 s old" in line.tick_twice(3.0).message
    assert values(line.send_pair(150.0, offset_s=4.2))["level"] == "NORMAL"


def test_a_clock_that_jumps_back_leaves_no_curve_from_the_future(line: Line) -> None:
    line.send_pair(0.0)
    line.set_time(START_S - 100.0)
    line.send_state(state(100.0, offset_s=-100.0))
    assert "none since the clock went back by 1" in line.tick_twice(-100.0).message


def test_a_stamp_ahead_of_the_clock_is_an_emergency_that_ends_with_it(line: Line) -> None:
    assert values(line.send_pair(0.0))["level"] == "NORMAL"
    assert "state: is stamped 1.9 s ahead of the clock, at most 0.1 s" in line.send_pair(0.0, 40.0, 1.9).message
    assert values(line.send_pair(0.0, 40.0, 0.1))["level"] == "NORMAL"


def test_states_without_curves_are_judged_by_the_watchdog_however_many_come(line: Line) -> None:
    line.send_pair(0.0)
    for step in range(1, 13):
        line.set_time(START_S + step / 4)
        line.send_state(state(10.0 * step, offset_s=step / 4))
    (status,) = line.heard[-1].status
    assert values(status)["level"] == "EMERGENCY_BRAKE"
    assert "braking curve expired" in status.message
