# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""/diagnostics of every node: steady in silence too, by the node's clock, under a name that tells trains apart."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import Any

import messages
import pytest
import rclpy
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from recorded import write_steps
from std_msgs.msg import String

from adhesion_node.bag import BagReader, select
from adhesion_node.live.node import Live
from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.creep_estimator import CreepEstimator
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.player import Replay
from adhesion_node.nodes.recorder import Recorder
from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics
from adhesion_node.wire.messages.parts import stamp_ns
from adhesion_node.wire.topic import Topic
from sim_node.nodes.simulator import Simulator
from sim_node.nodes.slip_simulator import SlipSimulator

S = 10**9
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


class Line:
    """A node, what it says, and a driver that publishes to it."""

    def __init__(
        self, executor: SingleThreadedExecutor, spin_until: SpinUntil, make: Callable[..., Node], **given: Any
    ) -> None:
        context, namespace = executor.context, given.pop("namespace", None)
        overrides = [Parameter(name, value=value) for name, value in given.items()]
        self.executor, self.spin_until = executor, spin_until
        self.node: Any = make(context=context, namespace=namespace, parameter_overrides=overrides)
        self.driver = Node("driver", context=context, namespace=namespace)
        self.told: list[DiagnosticArray] = []
        qos.subscribe(self.driver, topics.DIAGNOSTICS, self.told.append)
        for node in (self.node, self.driver):
            executor.add_node(node)
        own = sum(end.topic_name == topics.DIAGNOSTICS.name for end in self.node.subscriptions)
        spin_until(executor, lambda: self.node.count_subscribers(topics.DIAGNOSTICS.name) == 1 + own)

    def outlet(self, topic: Topic) -> Any:
        output = qos.advertise(self.driver, topic)
        self.spin_until(self.executor, output.get_subscription_count)
        return output

    def wait(self, done: Callable[[], object], timeout_s: float = 10.0) -> None:
        self.spin_until(self.executor, done, timeout_s)

    def wait_until_said(self, words: str) -> None:
        """Wait for a message with these words that is said from now on."""
        self.told.clear()
        self.wait(lambda: any(words in array.status[0].message for array in self.told))

    def wait_for_values(self, **wanted: str) -> None:
        """Wait for these values among those that are told."""
        self.wait(lambda: self.told and wanted.items() <= self.values.items())

    @property
    def values(self) -> dict[str, str]:
        return {pair.key: pair.value for pair in self.last.values}

    @property
    def last(self) -> DiagnosticStatus:
        (status,) = self.told[-1].status
        return status


@pytest.fixture
def make_line(executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Callable[..., Line]:
    return lambda make, **given: Line(executor, spin_until, make, **given)


@pytest.fixture
def beside(tmp_path: Path) -> Iterator[dict[Any, Callable[..., Node]]]:
    """The nodes that take more than parameters, with it; closed at the end. The player has 40 steps."""
    write_steps(tmp_path / "played", 40)
    with ExitStack() as stack:
        reader = stack.enter_context(BagReader(tmp_path / "played"))

        def closed(make: Callable[..., Any], *given: Any, **others: Any) -> Any:
            return stack.enter_context(closing(make(*given, **others)))

        yield {
            Recorder: partial(closed, Recorder, tmp_path / "bag"),
            Replay: partial(Replay, reader, select(reader.topics), 0.0, 0),
            Live: partial(closed, Live, "127.0.0.1", 0),
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


def test_the_recorder_tells_what_it_has_written(
    make_line: Callable[..., Line], beside: dict[Any, Callable[..., Node]], tmp_path: Path
) -> None:
    line = make_line(beside[Recorder], diagnostics_period_s=0.1)
    line.outlet(topics.MU).publish(messages.mu_message(0.08))
    line.wait(lambda: line.node.counts.get("/adhesion/mu") == 1)
    line.wait(lambda: line.told and int(line.values["written"]) > 0)
    assert int(line.values["bytes"]) > 0
    assert line.last.level == DiagnosticStatus.OK
    assert Path(line.values["file"]).parent == tmp_path / "bag"
    assert Path(line.values["file"]).exists()
    assert 0 < int(line.values["written"]) <= sum(line.node.counts.values())
    assert line.values["dropped"] == "0"


def test_the_recorder_tells_that_there_is_no_clock(
    make_line: Callable[..., Line], beside: dict[Any, Callable[..., Node]]
) -> None:
    line = make_line(beside[Recorder], diagnostics_period_s=0.1, use_sim_time=True)
    line.wait_until_said("no /clock yet")
    assert line.last.level == DiagnosticStatus.WARN
    line.outlet(topics.CLOCK).publish(messages.clock(1000 * S))
    line.wait(lambda: line.last.level == DiagnosticStatus.OK)


def test_the_player_tells_how_much_is_left(
    make_line: Callable[..., Line], beside: dict[Any, Callable[..., Node]]
) -> None:
    line = make_line(beside[Replay], diagnostics_period_s=0.1)
    line.wait_until_said("the end of the recording")
    assert (line.values["published"], line.values["left"], line.values["next_ns"]) == ("80", "0", "none")


def test_a_player_that_waits_tells_for_whom(make_line: Callable[..., Line], tmp_path: Path) -> None:
    write_steps(tmp_path / "bag", 3)
    with BagReader(tmp_path / "bag") as reader:
        line = make_line(partial(Replay, reader, select(reader.topics)), diagnostics_period_s=0.1)
        line.wait_until_said("waiting for 1 subscriber(s) to /position")
    assert (line.values["published"], line.values["left"]) == ("0", "6")


def test_the_page_tells_who_looks_and_how_old_is_what_it_shows(
    make_line: Callable[..., Line], beside: dict[Any, Callable[..., Node]]
) -> None:
    line = make_line(beside[Live], diagnostics_period_s=0.1)
    line.wait_for_values(viewers="0")
    assert line.last.message == f"open {line.node.server.url}"
    assert "age_s.adhesion/mu" not in line.values
    line.outlet(topics.MU).publish(messages.mu_message(0.08))
    line.wait(lambda: "age_s.adhesion/mu" in line.values)
    assert 0.0 <= float(line.values["age_s.adhesion/mu"]) < 10.0


@pytest.mark.parametrize(
    ("fault", "begins_s", "active"), [("loss", 0.0, True), ("loss", 1e5, False), ("mass", 0.0, True)]
)
def test_the_simulator_tells_its_fault(
    make_line: Callable[..., Line], fault: str, begins_s: float, active: bool
) -> None:
    line = make_line(Simulator, diagnostics_period_s=0.1, fault=fault, fault_start_s=begins_s)
    line.wait(lambda: line.told and int(line.values["samples"]) > 1)
    assert line.last.level == (DiagnosticStatus.WARN if active else DiagnosticStatus.OK)
    assert (f"fault {fault}" in line.last.message) is active
    assert (line.values["fault"], line.values["fault_active"]) == (fault, str(active).lower())
    assert line.values["scenario"] == "tunnel_entry"
    assert float(line.values["simulated_s"]) > 1000.0


def test_a_simulator_that_waits_tells_for_whom(make_line: Callable[..., Line]) -> None:
    line = make_line(SlipSimulator, diagnostics_period_s=0.1, wait_for=1)
    line.wait_until_said("waiting for 1 subscriber(s) to wheel_speed")
    assert line.values["samples"] == "0"
