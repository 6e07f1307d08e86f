# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Silence and what DDS tells of the other side: told to the operator, with the remedy."""

from __future__ import annotations

import time
from typing import Any

import messages
from diagnostic_msgs.msg import DiagnosticStatus
from faulty import S
from rclpy.qos import QoSProfile, ReliabilityPolicy
from test_faults_estimator import MakeLine, assert_published_is_sound, is_stale, last, make_line, play, said, ticks

from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics
from adhesion_node.wire.topic import Topic

__all__ = ["make_line"]


def test_silence_is_stale_within_the_timeout_and_a_tick(make_line: MakeLine) -> None:
    line = make_line(sensor_timeout_s=0.2)
    play(line, ticks("none", end_s=17.0))
    before = line.estimator.published[topics.DIAGNOSTICS]  # a busy machine may have been silent meanwhile, too
    told = line.heard[topics.DIAGNOSTICS]
    line.spin_until(line.executor, lambda: len(told) > before and is_stale(line)())
    first = next(m for m in told[before:] if m.status[0].level == DiagnosticStatus.STALE)
    assert first.status[0].message.startswith("/position: nothing for 0.2 s: is the sensor alive?")
    before = line.estimator.published[topics.DIAGNOSTICS]
    play(line, ticks("none", begin_s=17.2, end_s=18.4))
    line.hear_all()
    assert DiagnosticStatus.OK in [message.status[0].level for message in told[before:]]
    assert_published_is_sound(line)


def test_a_sensor_never_heard_is_stale(make_line: MakeLine) -> None:
    line = make_line(sensor_timeout_s=0.1)
    line.spin_until(line.executor, is_stale(line))
    assert "/position or /odometry: nothing received yet, publishers: 2" in last(line).message


def test_with_sim_time_silence_is_measured_by_the_clock(make_line: MakeLine) -> None:
    line = make_line(use_sim_time=True)
    clock = qos.advertise(line.driver, topics.CLOCK, qos.SENSOR_PUBLISHER)
    estimator_clock = line.estimator.get_clock()

    def turn_to(t_s: int) -> None:
        clock.publish(messages.clock(t_s * S))
        line.spin_until(line.executor, lambda: estimator_clock.now().nanoseconds == t_s * S)

    line.spin_until(line.executor, clock.get_subscription_count)
    turn_to(100)
    line.send(topics.POSITION, messages.position(S, 1.0, 0.5))
    turn_to(107)
    line.spin_until(line.executor, said(line, "/position: nothing for 7.0 s"))


def test_a_second_clock_is_told(make_line: MakeLine) -> None:
    line = make_line(use_sim_time=True)
    clocks = [qos.advertise(line.driver, topics.CLOCK, qos.SENSOR_PUBLISHER) for _ in range(2)]
    line.spin_until(line.executor, lambda: line.estimator.count_publishers("/clock") == 2)
    for clock in clocks:
        clock.publish(messages.clock(S))
    line.spin_until(line.executor, lambda: line.estimator.get_clock().now().nanoseconds == S)
    play(line, ticks("none", end_s=16.5))
    line.hear_all()
    assert "2 publishers of /clock" in last(line).message


AT_ONCE = {"diagnostics_period_s": 3600.0}
"""What is told is told for itself, not because it is time again to tell something."""

RELIABLE = {"qos_overrides./position.subscription.reliability": "reliable"}


def test_a_publisher_that_offers_too_little_is_told_with_the_remedy(make_line: MakeLine) -> None:
    line = make_line(**RELIABLE, **AT_ONCE)
    line.driver.create_publisher(
        messages.message_class(topics.POSITION),
        "position",
        QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT),
    )
    told = said(line, "less reliability", "-p qos_overrides./position.subscription.reliability:=best_effort")
    line.spin_until(line.executor, told)


def test_a_subscriber_that_asks_too_much_is_told(make_line: MakeLine) -> None:
    line = make_line(**AT_ONCE)
    line.driver.create_subscription(messages.message_class(topics.MU), topics.MU.name, print, qos.LATCHED)
    line.spin_until(line.executor, said(line, "/adhesion/mu: a subscriber asks for more durability"))


def test_a_missed_deadline_is_told(make_line: MakeLine) -> None:
    deadline = {f"qos_overrides./position.{end}.deadline": S // 10 for end in ("subscription", "publisher")}
    line = make_line(**deadline, **AT_ONCE)
    line.send(topics.POSITION, messages.position(S, 1.0, 0.5))
    line.spin_until(line.executor, said(line, "/position: deadline missed"))


def test_a_publisher_that_shows_no_life_is_told(make_line: MakeLine) -> None:
    """It promised to assert its liveliness every 0.1 s and does so by publishing only."""
    promise: dict[str, Any] = {}
    for end in ("subscription", "publisher"):
        promise[f"qos_overrides./position.{end}.liveliness"] = "manual_by_topic"
        promise[f"qos_overrides./position.{end}.liveliness_lease_duration"] = S // 10
    line = make_line(**promise, **AT_ONCE)
    line.send(topics.POSITION, messages.position(S, 1.0, 0.5))
    line.spin_until(line.executor, said(line, "/position: a publisher shows no life, 0 left"))


def test_a_publisher_that_goes_is_told_and_stands_for_as_long_as_the_silence(make_line: MakeLine) -> None:
    line = make_line(sensor_timeout_s=0.1, **AT_ONCE)
    line.send(topics.POSITION, messages.position(S, 1.0, 0.5))
    line.driver.destroy_publisher(line.outputs[topics.POSITION])
    line.spin_until(line.executor, said(line, "/position: a publisher has gone, 0 left"))
    line.spin_until(line.executor, said(line, "/position: nothing for 0.1 s", "/position: a publisher has gone"))


def test_who_comes_late_gets_no_old_curve(make_line: MakeLine) -> None:
    """The safe curve lives for 0.1 s here and the nominal one, the control, for an hour."""
    lives = {topics.BRAKING_CURVE: S // 10, topics.BRAKING_CURVE_NOMINAL: 3600 * S}
    line = make_line(**{f"qos_overrides./{topic.name}.publisher.lifespan": ns for topic, ns in lives.items()})
    play(line, ticks("none", end_s=22.0))
    line.hear_all()
    expired = time.monotonic() + 0.2
    line.spin_until(line.executor, lambda: time.monotonic() > expired)
    late: dict[Topic, list[Any]] = {topics.BRAKING_CURVE: [], topics.BRAKING_CURVE_NOMINAL: []}
    for topic, heard in late.items():
        line.driver.create_subscription(messages.message_class(topic), topic.name, heard.append, qos.LATCHED)
    line.spin_until(line.executor, lambda: late[topics.BRAKING_CURVE_NOMINAL])
    assert late[topics.BRAKING_CURVE] == []
