# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Life cycle of estimator and monitor, through DDS: what works in which state, what is kept, what is forgotten."""

from __future__ import annotations

import gc
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import messages
import pytest
from conftest import SpinUntil
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from adhesion_node.nodes.atp_monitor import AtpMonitor
from adhesion_node.nodes.creep_estimator import CreepEstimator
from adhesion_node.nodes.estimator import Estimator
from adhesion_node.nodes.ros import qos
from adhesion_node.wire import topics
from adhesion_node.wire.topic import Topic

S = 10**9
QUICK = {"diagnostics_period_s": 0.1}
NODES: dict[str, tuple[Callable[..., Node], Topic, Topic]] = {
    "estimator": (Estimator, topics.POSITION, topics.STATE),
    "creep_estimator": (CreepEstimator, topics.WHEEL_SPEED, topics.CREEP_MU_MAX),
    "atp_monitor": (AtpMonitor, topics.STATE, topics.ATP_STATUS),
}


class Managed:
    """A node, its manager, and what it publishes."""

    def __init__(
        self, executor: SingleThreadedExecutor, spin_until: SpinUntil, make: Callable[..., Node], **given: Any
    ) -> None:
        overrides = [Parameter(name, value=value) for name, value in (QUICK | given).items()]
        self.executor, self.spin_until = executor, spin_until
        self.node: Any = make(context=executor.context, parameter_overrides=overrides)
        self.manager = Node("manager", context=executor.context)
        self.told: list[str] = []
        qos.subscribe(self.manager, topics.DIAGNOSTICS, lambda array: self.told.append(array.status[0].message))
        executor.add_node(self.node)
        executor.add_node(self.manager)

    def wait(self, done: Callable[[], object]) -> None:
        self.spin_until(self.executor, done)

    def call(self, kind: type[Any], name: str, request: Any) -> Any:
        client = self.manager.create_client(kind, f"{self.node.get_name()}/{name}")
        self.wait(client.service_is_ready)
        future = client.call_async(request)
        self.wait(future.done)
        return future.result()

    def change(self, transition: str) -> bool:
        return bool(
            self.call(ChangeState, "change_state", ChangeState.Request(transition=Transition(label=transition))).success
        )

    @property
    def state(self) -> str:
        return str(self.call(GetState, "get_state", GetState.Request()).current_state.label)

    def wait_until_said(self, words: str) -> None:
        self.told.clear()
        self.wait(lambda: any(words in text for text in self.told))

    def there(self, taken: Topic, given: Topic) -> tuple[int, int]:
        """How often the node subscribes the one and publishes the other."""
        return self.manager.count_subscribers(taken.name), self.manager.count_publishers(given.name)

    def seen(self, taken: Topic, given: Topic, count: int) -> bool:
        return self.there(taken, given) == (count, count)

    def positions(self, from_s: float, count: int = 20) -> None:
        output = qos.advertise(self.manager, topics.POSITION)
        (there,) = (one for one in self.node.subscriptions if one.topic_name == output.topic_name)
        self.wait(lambda: output.get_subscription_count() and there.get_publisher_count())
        for step in range(count):
            at_s = from_s + step / 10
            output.publish(messages.position(round(at_s * S), 30.0 * at_s, 0.5))
            self.wait(partial(self.has_heard, self.node.heard[topics.POSITION] + 1))
        self.manager.destroy_publisher(output)

    def has_heard(self, count: int) -> bool:
        return bool(self.node.heard[topics.POSITION] >= count)


@pytest.fixture
def make_managed(executor: SingleThreadedExecutor, spin_until: SpinUntil) -> Callable[..., Managed]:
    return lambda make, **given: Managed(executor, spin_until, make, **given)


@pytest.mark.parametrize("name", NODES)
def test_by_default_a_node_is_active_at_once(make_managed: Callable[..., Managed], name: str) -> None:
    managed = make_managed(NODES[name][0])
    assert managed.state == "active"


@pytest.mark.parametrize("name", NODES)
def test_a_manager_brings_a_node_up_and_takes_it_down(make_managed: Callable[..., Managed], name: str) -> None:
    make, taken, given = NODES[name]
    managed = make_managed(make, autostart=False)
    managed.wait_until_said("unconfigured: nothing is subscribed or published; configure and activate this node")
    assert (managed.state, managed.there(taken, given)) == ("unconfigured", (0, 0))
    for transition, state, words in (
        ("configure", "inactive", "inactive: nothing is taken in or published; activate this node"),
        ("activate", "active", ""),
        ("deactivate", "inactive", "inactive: "),
        ("activate", "active", ""),
        ("deactivate", "inactive", "inactive: "),
        ("cleanup", "unconfigured", "unconfigured: "),
        ("configure", "inactive", "inactive: "),
    ):
        assert managed.change(transition)
        assert managed.state == state
        managed.wait_until_said(words)
        assert managed.told[-1].startswith(words)
        managed.wait(partial(managed.seen, taken, given, int(state != "unconfigured")))
    assert managed.change("shutdown")
    assert managed.state == "finalized"
    managed.wait_until_said("finalized: this node is at its end; start it anew")


@pytest.mark.parametrize("asked", [Transition.TRANSITION_ACTIVATE, 77])
def test_a_transition_that_the_state_does_not_have_is_refused_and_the_node_lives(
    make_managed: Callable[..., Managed], capfd: pytest.CaptureFixture[str], asked: int
) -> None:
    managed = make_managed(AtpMonitor)
    answer = managed.call(ChangeState, "change_state", ChangeState.Request(transition=Transition(id=asked)))
    assert not answer.success
    assert f"transition {asked}: not from here: ask for 4 deactivate, 7 shutdown" in capfd.readouterr().err
    assert not managed.change("activate"), "by its label"
    assert managed.state == "active"


@pytest.mark.parametrize("name", NODES)
def test_a_node_that_is_destroyed_has_left_the_graph(make_managed: Callable[..., Managed], name: str) -> None:
    managed = make_managed(NODES[name][0])
    managed.wait(lambda: name in managed.manager.get_node_names())
    managed.executor.remove_node(managed.node)
    gc.disable()
    try:
        managed.node.destroy_node()
        managed.wait(lambda: name not in managed.manager.get_node_names())
    finally:
        gc.enable()


def test_what_is_known_is_kept_while_inactive_and_forgotten_by_a_cleanup(make_managed: Callable[..., Managed]) -> None:
    managed = make_managed(Estimator)
    estimator = managed.node
    managed.positions(100.0)
    assert managed.change("deactivate")
    accepted, known = estimator.pipeline.accepted, estimator.latest
    assert accepted == 20
    published = estimator.published[topics.STATE]
    managed.positions(102.0)
    managed.wait_until_said("inactive")
    assert (estimator.pipeline.accepted, estimator.latest) == (accepted, known)
    assert estimator.published[topics.STATE] == published
    assert managed.change("activate")
    managed.positions(104.0)
    assert estimator.pipeline.accepted == accepted + 20
    assert estimator.latest.position_m == pytest.approx(30.0 * 105.9, abs=30.0)
    managed.change("deactivate")
    managed.change("cleanup")
    managed.change("configure")
    managed.change("activate")
    assert (estimator.pipeline.accepted, estimator.latest) == (0, None)
    managed.positions(106.0)
    assert estimator.pipeline.accepted == 20


def test_a_monitor_that_is_activated_knows_nothing_of_before(make_managed: Callable[..., Managed]) -> None:
    managed = make_managed(AtpMonitor, check_rate_hz=50.0, target_position_m=1e6)
    managed.wait_until_said("no safe distance is known")
    assert managed.change("deactivate")
    managed.wait_until_said("inactive")
    silent = managed.node.published[topics.ATP_STATUS]
    managed.told.clear()
    managed.wait(lambda: len(managed.told) > 3)
    assert managed.node.published[topics.ATP_STATUS] == silent
    assert managed.change("activate")
    managed.wait(lambda: managed.node.published[topics.ATP_STATUS] > silent)
    managed.wait_until_said("state: none received yet")


def test_a_target_may_be_set_before_the_monitor_is_configured(make_managed: Callable[..., Managed]) -> None:
    managed = make_managed(AtpMonitor, autostart=False)
    assert managed.node.set_parameters_atomically([Parameter("target_position_m", value=900.0)]).successful
    assert managed.change("configure")
    assert managed.node._config.target_position_m == 900.0


def test_a_clock_that_is_switched_on_on_the_way_is_followed_after_a_cleanup(
    make_managed: Callable[..., Managed],
) -> None:
    """The cleanup took the subscription of /clock with it: time stood still for the monitor."""
    managed = make_managed(AtpMonitor)
    assert managed.node.set_parameters_atomically([Parameter("use_sim_time", value=True)]).successful
    for transition in ("deactivate", "cleanup", "configure", "activate"):
        assert managed.change(transition)
    clock = qos.advertise(managed.manager, topics.CLOCK)
    managed.wait(clock.get_subscription_count)
    clock.publish(messages.clock(7 * S))
    managed.wait(lambda: managed.node.get_clock().now().nanoseconds == 7 * S)


def test_what_stands_against_a_configuration_is_told_and_the_node_stays_as_it_was(
    make_managed: Callable[..., Managed], capfd: pytest.CaptureFixture[str]
) -> None:
    managed = make_managed(Estimator, autostart=False, step=10, window=5)
    assert not managed.change("configure")
    assert managed.state == "unconfigured"
    assert "not configured: step = 10: choose less than the window, 5" in capfd.readouterr().err
    managed.wait_until_said("unconfigured")


def test_a_node_is_configured_once_what_stood_against_it_is_mended(
    make_managed: Callable[..., Managed], tmp_path: Path
) -> None:
    way = tmp_path / "line.csv"
    managed = make_managed(Estimator, autostart=False, track_line=str(way))
    assert not managed.change("configure")
    assert managed.there(topics.FIX, topics.STATE) == (0, 0), "nothing is left of the attempt"
    way.write_text("lat,lon\n50.0,8.0\n50.1,8.0\n")
    assert managed.change("configure")
    assert managed.change("activate")


def test_parameters_that_change_may_do_so_before_and_hold_after_a_configuration(
    make_managed: Callable[..., Managed],
) -> None:
    managed = make_managed(Estimator, autostart=False)
    assert managed.node.set_parameters_atomically([Parameter("confidence", value=0.9)]).successful
    assert managed.change("configure")
    assert managed.node.config.confidence == 0.9
