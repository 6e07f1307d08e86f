# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""/diagnostics of every node: steady in silence too, by the node's clock, under a name that tells trains apart."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import messages
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.context import Context
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger
from told_line import Line, S, beside, make_line

from adhesion_node.live.node import Live
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.creep_estimator import CreepEstimator
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.player import Replay
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.wire import topics
from adhesion_node.wire.messages.parts import stamp_ns
from adhesion_node.wire.topic import Topic
from sim_node.nodes.simulator import Simulator
from sim_node.nodes.slip_simulator import SlipSimulator

__all__ = ["beside", "make_line"]

NODES: dict[str, Callable[..., Node]] = {
    "estimator/adhesion": Estimator,
    "creep_estimator/peak": CreepEstimator,
    "atp_monitor/supervision": AtpMonitor,
    "recorder/recording": Recorder,
    "replay/playing": Replay,
    "live/page": Live,
    "simulator/run": Simulator,
    "slip_simulator/run": SlipSimulator,
}


@pytest.mark.parametrize("use_sim_time", [False, True], ids=["system time", "no /clock"])
@pytest.mark.parametrize("entry", NODES)
def test_every_node_speaks_without_being_spoken_to(
    make_line: Callable[..., Line], beside: dict[Any, Callable[..., Node]], entry: str, use_sim_time: bool
) -> None:
    """No sensor ever, a /clock that is not there; the silence of the sensors alone would be told once an hour."""
    own = {"sensor_timeout_s": 3600.0} if "estimator" in entry else {}
    make = beside.get(NODES[entry], NODES[entry])
    line = make_line(make, use_sim_time=use_sim_time, diagnostics_period_s=0.11, namespace="/train1", **own)
    assert 110_000_000 in {timer.timer_period_ns for timer in line.node.timers}, "no other timer has this period"
    line.wait(lambda: len(line.told) > 5)
    assert (line.last.name, line.last.hardware_id) == (f"train1/{entry}", "train1")
    assert line.last.message


@pytest.mark.parametrize(("given", "hardware_id"), [({}, "train"), ({"hardware_id": "194 101"}, "194 101")])
def test_the_train_has_a_name(make_line: Callable[..., Line], given: dict[str, str], hardware_id: str) -> None:
    line = make_line(Estimator, diagnostics_period_s=0.1, **given)
    line.wait(lambda: line.told)
    assert (line.last.name, line.last.hardware_id) == ("estimator/adhesion", hardware_id)


def test_stamps_are_the_clock_of_the_node_and_those_of_the_data_are_values(make_line: Callable[..., Line]) -> None:
    line = make_line(Estimator, use_sim_time=True, diagnostics_period_s=0.1)
    clock, position = line.outlet(topics.CLOCK), line.outlet(topics.POSITION)
    clock.publish(messages.clock(1000 * S))
    line.wait(lambda: line.node.get_clock().now().nanoseconds == 1000 * S)
    line.told.clear()
    line.wait(lambda: len(line.told) > 1)
    assert line.values["stamp_ns"] == "none"
    for step in range(20):
        position.publish(messages.position(7 * S + step * S // 10, 3.0 * step, 0.5))
    line.wait(lambda: line.node.heard[topics.POSITION] == 20)  # from here on the newest estimate stays the same
    line.told.clear()
    line.wait_for_values(stamp_ns=str(line.node.latest.t_ns))
    assert 7 * S < line.node.latest.t_ns < 10 * S
    assert all(1000 * S <= stamp_ns(array.header) < 1000 * S + 1000 for array in line.told)


def test_an_emergency_of_the_monitor_is_an_error(make_line: Callable[..., Line]) -> None:
    line = make_line(AtpMonitor, diagnostics_period_s=0.1)
    line.wait_until_said("no safe distance is known")
    assert line.last.level == DiagnosticStatus.ERROR
    assert line.values["level"] == "EMERGENCY_BRAKE"


def test_two_publishers_of_a_sensor_are_told(make_line: Callable[..., Line]) -> None:
    line = make_line(Estimator, diagnostics_period_s=0.1, namespace="/train1")
    _outputs = [line.outlet(topics.POSITION) for _ in range(2)]
    line.wait_until_said("2 publishers of /train1/position: stop all but one")
    assert line.last.level != DiagnosticStatus.OK


@pytest.mark.parametrize(
    ("make", "topic"),
    [
        (Estimator, topics.BRAKE_PRESSURE),
        (CreepEstimator, topics.SPEED),
        (AtpMonitor, topics.STATE),
        (Recorder, topics.MU),
    ],
)
def test_a_topic_of_another_type_is_told(
    make_line: Callable[..., Line], beside: dict[Any, Callable[..., Node]], make: Callable[..., Node], topic: Topic
) -> None:
    """A publisher of another process; nothing of it arrives, and DDS says nothing."""
    line, context = make_line(beside.get(make, make), diagnostics_period_s=0.1), Context()
    rclpy.init(context=context)
    stranger = Node("stranger", context=context)
    stranger.create_publisher(String, topic.name, 1)
    line.wait_until_said(f"/{topic.name} is published as std_msgs/msg/String: give it as {topic.type}")
    stranger.destroy_node()
    context.try_shutdown()


def test_two_estimators_of_a_monitor_are_told(make_line: Callable[..., Line]) -> None:
    line = make_line(AtpMonitor, diagnostics_period_s=0.1, namespace="/train1")
    _outputs = [line.outlet(topics.BRAKING_CURVE) for _ in range(2)]
    line.wait_until_said("2 publishers of /train1/adhesion/braking_curve: stop all but one")


@pytest.mark.parametrize(
    ("asked", "left_out"),
    [("deadline", ["deadline"]), ("liveliness_lease_duration", ["liveliness", "liveliness_lease_duration"])],
)
def test_what_no_publisher_offers_is_to_be_left_out(
    make_line: Callable[..., Line], asked: str, left_out: list[str]
) -> None:
    override = "qos_overrides./position.subscription."
    line = make_line(Estimator, diagnostics_period_s=0.1, **{override + asked: S // 10})
    line.driver.create_publisher(messages.message_class(topics.POSITION), "position", 1)
    remedy = " and ".join(override + policy for policy in left_out)
    line.wait(lambda: any(f"nothing of it arrives: leave {remedy} out" in one.status[0].message for one in line.told))


def test_a_receiver_that_sends_what_is_refused_is_silent(make_line: Callable[..., Line]) -> None:
    line = make_line(Estimator, diagnostics_period_s=0.1, sensor_timeout_s=0.5)
    position = line.outlet(topics.POSITION)

    def silent() -> bool:
        position.publish(messages.position(S, float("nan"), 0.5))
        return bool(line.told) and line.last.level == DiagnosticStatus.STALE

    line.wait(silent)
    assert "nothing that can be used for " in line.last.message.partition("position x = nan")[0]


def test_a_second_clock_is_told_by_the_name_it_really_has(make_line: Callable[..., Line]) -> None:
    remapped = ["--ros-args", "-r", "/clock:=/simulated/clock"]
    line = make_line(partial(Estimator, cli_args=remapped), use_sim_time=True)
    for _ in range(2):
        line.outlet(topics.CLOCK._replace(name="/simulated/clock"))
    line.wait_until_said("2 publishers of /simulated/clock: stop all but one")


def test_resets_again_and_again_are_told(make_line: Callable[..., Line]) -> None:
    """One reset may happen, a second one is told."""
    line = make_line(Estimator, diagnostics_period_s=0.1)
    position = line.outlet(topics.POSITION)

    def play(from_s: int) -> None:
        for step in range(20):
            position.publish(messages.position(from_s * S + step * S // 10, 3.0 * step, 0.5))

    play(1000)
    play(700)
    line.wait(lambda: line.node.pipeline.resets == 1)
    line.told.clear()
    line.wait(lambda: len(line.told) > 1)
    assert "resets so far" not in line.last.message
    play(400)
    line.wait_until_said("2 resets so far, 2 of them within 60 s: stamps or positions jump")


def test_resets_that_are_asked_for_are_no_jumps(make_line: Callable[..., Line]) -> None:
    line = make_line(Estimator, diagnostics_period_s=0.1)
    reset = line.driver.create_client(Trigger, "estimator/reset")
    line.wait(reset.service_is_ready)
    for _ in range(3):
        line.wait(reset.call_async(Trigger.Request()).done)
    line.told.clear()
    line.wait(lambda: len(line.told) > 1)
    assert line.values["resets"] == "3"
    assert line.last.message.endswith("no estimate yet"), "and no word of resets"
