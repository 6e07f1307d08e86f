# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The ATP monitor as a node: what it says to which messages, and how it is set up."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import messages
import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticStatus
from monitor_line import NAMESPACE, NEEDED_M, Line, constant_curve, curve, state, supervised, t_ns, values
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.core.atp.received import StampedCurve
from adhesion_node.core.atp.supervision import Level
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics
from adhesion_node.wire.messages.parts import stamp_ns

REFUSED = "/atp_test_refused"
"""A node that fails to start lives until it is garbage collected: its topics must not disturb other tests."""


@pytest.fixture
def line(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Line:
    return supervised(context, executor, spin_until)


@pytest.mark.parametrize(
    ("margin_m", "level", "diagnostic"),
    [  # T_bs = 3 s, T_warning = 2 s, T_driver = 4 s, T_indication = 9 s: 120, 80, 160, 360 m at 40 m/s
        (1000.0, "NORMAL", DiagnosticStatus.OK),
        (400.0, "INDICATION", DiagnosticStatus.OK),
        (250.0, "OVERSPEED", DiagnosticStatus.WARN),
        (150.0, "WARNING", DiagnosticStatus.WARN),
        (50.0, "SERVICE_BRAKE", DiagnosticStatus.ERROR),
        (-50.0, "EMERGENCY_BRAKE", DiagnosticStatus.ERROR),
    ],
)
def test_the_level_follows_the_margin(line: Line, margin_m: float, level: str, diagnostic: bytes) -> None:
    line.send_pair(0.0)  # ends the emergency of the time without a curve
    status = line.send_pair(5000.0 - NEEDED_M - margin_m)
    assert (status.name, status.level) == ("atp_test/atp_monitor/supervision", diagnostic)
    told = values(status)
    assert told["level"] == level
    assert float(told["margin_m"]) == pytest.approx(margin_m, abs=1.0)
    assert float(told["braking_distance_m"]) == pytest.approx(1000.0, abs=1.0)
    assert (told["target_position_m"], told["target_speed_mps"]) == ("5000.000", "0.000")
    assert float(told["distance_to_target_m"]) == pytest.approx(NEEDED_M + margin_m, abs=0.01)
    assert (told["curve_age_s"], told["state_age_s"]) == ("0.000", "0.000")
    limits = [float(told[f"{name}_mps"]) for name in ("indication", "permitted", "warning", "sbi", "ebi")]
    assert limits == sorted(limits)
    assert sum(limit < 40.0 for limit in limits) == [name.name for name in Level].index(level)
    assert stamp_ns(line.heard[-1].header) == t_ns() + 3  # spoken on the watchdog, the curve alone, the pair


def test_an_intervention_holds_until_the_permitted_speed_is_kept(line: Line) -> None:
    levels = [values(line.send_pair(5000.0 - NEEDED_M - margin))["level"] for margin in (900, -50, 250, 300)]
    assert levels == ["NORMAL", "EMERGENCY_BRAKE", "EMERGENCY_BRAKE", "INDICATION"]


def test_a_refused_curve_replaces_the_good_one(line: Line) -> None:
    assert values(line.send_pair(0.0))["level"] == "NORMAL"
    broken = curve()
    broken.points[5].velocities = [math.nan]
    count = len(line.heard)
    line.send_curve(broken)
    line.spin_until(line.executor, lambda: len(line.heard) > count)
    (status,) = line.heard[-1].status
    assert values(status)["level"] == "EMERGENCY_BRAKE"
    assert "braking curve: refused: braking curve point 5" in status.message


def test_a_refused_state_is_an_emergency(line: Line) -> None:
    line.send_pair(0.0)
    status = line.send_state(state(math.nan))
    assert values(status)["level"] == "EMERGENCY_BRAKE"
    assert "state: refused: position x = nan" in status.message


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda point: setattr(point, "positions", [point.positions[0] / 1000.0]), "give positions in m"),
        (lambda point: setattr(point, "velocities", [point.velocities[0] * 3.6]), "velocities in m/s"),
        (lambda point: setattr(point, "positions", [3000.0]), "refused: braking curve: v^2 falls by"),
        (lambda point: setattr(point, "positions", [point.positions[0] - 3000.0]), "begins at 0 m"),
    ],
)
def test_a_curve_in_other_units_or_from_another_place_is_an_emergency(
    line: Line, spoil: Callable[[Any], None], message: str
) -> None:
    assert values(line.send_pair(3000.0))["level"] == "NORMAL"
    impossible = curve(position_m=3000.0)
    for point in impossible.points:
        spoil(point)
    line.send_curve(impossible)
    status = line.send_state(state(3000.0))
    assert (values(status)["level"], status.level) == ("EMERGENCY_BRAKE", DiagnosticStatus.ERROR)
    assert message in status.message


def test_a_state_is_judged_with_its_own_curve(line: Line) -> None:
    """A speed may jump by more than the curve before covers: no emergency until the next one is there."""
    assert values(line.send_pair(0.0, 40.0))["level"] == "NORMAL"
    count = len(line.heard)
    line.send_state(state(0.0, 56.0))
    assert len(line.heard) == count
    line.curve.publish(messages.curve_message(t_ns(), constant_curve(56.0, 0.8), 0.0))
    line.spin_until(line.executor, lambda: len(line.heard) > count)
    (status,) = line.heard[-1].status
    assert values(status)["level"] == "NORMAL"
    assert float(values(status)["supervised_mps"]) == 56.0


def test_a_curve_from_before_the_monitor_started_is_used(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    early = Node("early", context=context, namespace=NAMESPACE)
    executor.add_node(early)
    now_ns = early.get_clock().now().nanoseconds
    latched = qos.advertise(early, topics.BRAKING_CURVE, qos.LATCHED)
    latched.publish(messages.curve_message(now_ns, constant_curve(50.0, 0.8), 0.0))
    monitor = AtpMonitor(context=context, namespace=NAMESPACE)
    executor.add_node(monitor)
    spin_until(executor, lambda: isinstance(monitor._known.curve, StampedCurve) and monitor._known.curve.t_ns == now_ns)


def test_times_in_the_wrong_order_are_refused(context: Context) -> None:
    overrides = [Parameter("driver_time_s", value=1.0)]
    with pytest.raises(ValueError, match=r"driver_time_s = 1\.0: give at least warning_time_s = 2\.0"):
        AtpMonitor(context=context, namespace=REFUSED, parameter_overrides=overrides)


def test_quality_of_service_follows_the_parameters_of_its_own_topic_only(
    context: Context, executor: SingleThreadedExecutor
) -> None:
    name = f"qos_overrides.{NAMESPACE}/adhesion/braking_curve.subscription.durability"
    overrides = [Parameter(name, value="volatile")]
    monitor = AtpMonitor(context=context, namespace=NAMESPACE, parameter_overrides=overrides)
    executor.add_node(monitor)
    durability = {
        subscription.topic_name: subscription.qos_profile.durability.name for subscription in monitor.subscriptions
    }
    assert durability[f"{NAMESPACE}/adhesion/braking_curve"] == "VOLATILE"
    assert qos.LATCHED.durability.name == "TRANSIENT_LOCAL"


@pytest.mark.parametrize(
    ("policy", "value"),
    [("reliability", "sometimes"), ("reliability", 1), ("depth", "deep"), ("depth", 0), ("depth", -1)],
)
def test_a_bad_quality_of_service_is_refused_with_the_remedy(context: Context, policy: str, value: object) -> None:
    name = f"qos_overrides.{REFUSED}/adhesion/state.subscription.{policy}"
    message = rf"qos_overrides\.{REFUSED}/adhesion/state\.subscription: .*{policy} = {value}.*: give reliability"
    with pytest.raises(ValueError, match=message):
        AtpMonitor(context=context, namespace=REFUSED, parameter_overrides=[Parameter(name, value=value)])
