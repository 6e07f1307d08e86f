# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The ATP monitor as a node: what it says to which messages, and that silence is no comfort."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import messages
import numpy as np
import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

from adhesion_node.core.atp.received import StampedCurve
from adhesion_node.core.atp.supervision import Level
from adhesion_node.core.physics.braking import BrakingCurve
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics
from adhesion_node.wire.messages.parts import stamp_ns

NAMESPACE = "/atp_test"
REFUSED = "/atp_test_refused"
"""A node that fails to start lives until it is garbage collected: its topics must not disturb other tests."""

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


@pytest.fixture
def line(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Line:
    return supervised(context, executor, spin_until)


def t_ns(offset_s: float = 0.0) -> int:
    return round((START_S + offset_s) * 1e9)


def state(position_m: float, speed_mps: float = 40.0, offset_s: float = 0.0) -> Any:
    return messages.state_message(t_ns(offset_s), position_m, 0.01, speed_mps, 0.01)


def curve(offset_s: float = 0.0, position_m: float = 0.0) -> Any:
    return messages.curve_message(t_ns(offset_s), constant_curve(45.0, 0.8), position_m)


def values(status: DiagnosticStatus) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}


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
    spin_until(executor, lambda: len(heard) >= 2)
    assert monitor.get_clock().now().nanoseconds == 0
    (status,) = heard[-1].status
    assert (values(status)["level"], status.level) == ("EMERGENCY_BRAKE", DiagnosticStatus.ERROR)
    assert "the clock has stood still for" in status.message


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


def test_a_stamp_ahead_of_the_clock_is_an_emergency_that_ends_with_it(line: Line) -> None:
    assert values(line.send_pair(0.0))["level"] == "NORMAL"
    assert "state: is stamped 1.9 s ahead of the clock, at most 0.1 s" in line.send_pair(0.0, 40.0, 1.9).message
    assert values(line.send_pair(0.0, 40.0, 0.1))["level"] == "NORMAL"


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


def test_states_without_curves_are_judged_by_the_watchdog_however_many_come(line: Line) -> None:
    line.send_pair(0.0)
    for step in range(1, 13):
        line.set_time(START_S + step / 4)
        line.send_state(state(10.0 * step, offset_s=step / 4))
    (status,) = line.heard[-1].status
    assert values(status)["level"] == "EMERGENCY_BRAKE"
    assert "braking curve expired" in status.message


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
