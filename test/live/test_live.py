# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The live page behind its address: what is served and sent."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import pairwise
from typing import Any
from urllib.request import urlopen

import messages
import pytest
from conftest import SpinUntil
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from adhesion_node.core.physics.braking import curve
from adhesion_node.core.physics.train import CRH3
from adhesion_node.live.node import Live
from adhesion_node.nodes.ros import qos
from adhesion_node.nodes.ros.types import new
from adhesion_node.wire import topics
from adhesion_node.wire.topic import Topic

pytest.importorskip("aiohttp", reason="the extra `live` is not installed")
viewer, server = (pytest.importorskip(name) for name in ("viewer", "adhesion_node.live.server"))

S = 10**9
TIMEOUT_S = 20.0


@pytest.fixture
def live(context: Context, executor: SingleThreadedExecutor) -> Iterator[Live]:
    node = Live("127.0.0.1", 0, context=context)
    executor.add_node(node)
    yield node
    node.close()


def publish_run(executor: SingleThreadedExecutor, context: Context) -> Node:
    """Publish what a line says of one estimate."""
    node = Node("line", context=context)
    executor.add_node(node)
    regime = DiagnosticStatus(message="it is identified", values=[KeyValue(key="regime", value="ADHESION_LIMITED")])
    level = DiagnosticStatus(message="brake", values=[KeyValue(key="level", value="WARNING")])
    for topic, message, profile in (
        (topics.MU, messages.mu_message(0.08), qos.RESULT),
        (topics.MU_LOWER, messages.mu_message(0.075), qos.RESULT),
        (topics.STATE, messages.state_message(5 * S, 1200.0, 1.0, 50.0, 1.0), qos.RESULT),
        (topics.BRAKING_CURVE, messages.curve_message(5 * S, curve(CRH3, 50.0, 0.075), 1200.0), qos.LATCHED),
        (topics.DIAGNOSTICS, DiagnosticArray(header=messages.header(5 * S), status=[regime]), qos.RESULT),
        (topics.ATP_STATUS, DiagnosticArray(header=messages.header(5 * S), status=[level]), qos.RESULT),
    ):
        publisher = qos.advertise(node, topic, profile)
        deadline = time.monotonic() + TIMEOUT_S
        while not publisher.get_subscription_count():
            assert time.monotonic() < deadline, topic
            executor.spin_once(timeout_sec=0.01)
        publisher.publish(message)
        executor.spin_once(timeout_sec=0.1)
    return node


def test_what_the_nodes_say_reaches_the_browser(
    live: Live, executor: SingleThreadedExecutor, context: Context, spin_until: SpinUntil
) -> None:
    with viewer.watching(live.server.url) as watcher:
        watcher.receive()
        first = dict(watcher.parts)
        assert first["train"] is first["adhesion"] is first["supervision"] is None
        publish_run(executor, context)
        spin_until(executor, lambda: live.view.parts(0.0)["supervision"] and live.view.parts(0.0)["adhesion"])
        seen = watcher.until(lambda parts: parts["supervision"] and parts["adhesion"] and parts["curves"])
    assert (seen["train"]["speed"], seen["train"]["position"]) == (180.0, 1200.0)
    assert seen["adhesion"] == {"mu": 0.08, "mu_lower": 0.075, "kind": "identified"}
    assert (seen["supervision"]["level"], seen["estimator"]["regime"]) == ("WARNING", "adhesion_limited")
    assert (seen["curves"]["safe"]["x"][0], seen["curves"]["safe"]["y"][0]) == (1200.0, 180.0)


def told(name: str, message: str, **values: str) -> DiagnosticArray:
    keys = [KeyValue(key=key, value=value) for key, value in values.items()]
    return DiagnosticArray(status=[DiagnosticStatus(name=name, message=message, values=keys)])


@pytest.mark.parametrize("own", ["", "train_a", "line1/train_a"])
def test_a_page_shows_what_the_nodes_of_its_own_train_tell(
    executor: SingleThreadedExecutor, context: Context, spin_until: SpinUntil, own: str
) -> None:
    """/diagnostics is shared: the regimes and creep curves of all trains followed each other there."""
    node, page = Node("trains", context=context), Live("127.0.0.1", 0, context=context, namespace=f"/{own}")
    executor.add_node(node)
    executor.add_node(page)
    publisher = qos.advertise(node, topics.DIAGNOSTICS)
    spin_until(executor, publisher.get_subscription_count)
    curve_told = {"p1": "80", "p2": "100", "mu_max": "0.2", "lambda_m": "0.1", "withheld": "false"}
    for namespace in (own, "train_b", "line1", own):
        entry = namespace and f"{namespace}/"
        regime, peak = ("COASTING", "0.2") if namespace == own else ("BRAKE_LIMITED", "0.3")
        publisher.publish(told(f"{entry}estimator/adhesion", "of " + namespace, regime=regime))
        publisher.publish(told(f"{entry}creep_estimator/peak", "", **(curve_told | {"mu_max": peak})))
    publisher.publish(told(f"{own}/estimator/adhesion".lstrip("/"), "the end", regime="COASTING"))
    seen: list[dict[str, Any]] = []

    def at_the_end() -> bool:
        seen.append(page.view.parts(0.0))
        return bool(seen[-1]["estimator"] and seen[-1]["estimator"]["message"] == "the end")

    spin_until(executor, at_the_end)
    page.close()
    assert {parts["estimator"]["regime"] for parts in seen if parts["estimator"]} == {"coasting"}
    assert {parts["creep"]["peak"][1] for parts in seen if parts["creep"]} == {0.2}


def test_a_message_that_cannot_be_shown_is_said_and_shown_nowhere(
    live: Live, executor: SingleThreadedExecutor, context: Context, spin_until: SpinUntil
) -> None:
    node = Node("stranger", context=context)
    executor.add_node(node)
    publisher = qos.advertise(node, topics.STATE, qos.RESULT)
    spin_until(executor, publisher.get_subscription_count)
    publisher.publish(messages.state_message(5 * S, float("nan"), 1.0, 50.0, 1.0))
    spin_until(executor, lambda: live.view.parts(0.0)["inputs"][topics.STATE.name]["state"] == "refused")
    assert "position x = nan" in live.view.parts(0.0)["inputs"][topics.STATE.name]["why"]
    assert live.view.parts(0.0)["train"] is None


@pytest.mark.parametrize("topic", [topics.FIX, topics.ODOMETRY], ids=lambda topic: topic.name)
def test_every_source_of_the_position_is_heard(
    live: Live, executor: SingleThreadedExecutor, context: Context, spin_until: SpinUntil, topic: Topic
) -> None:
    node = Node("receiver", context=context)
    executor.add_node(node)
    publisher = qos.advertise(node, topic, qos.SENSOR_PUBLISHER)
    spin_until(executor, publisher.get_subscription_count)
    publisher.publish(topic.build(new, 5 * S, (47.0, 8.0, 400.0), 1.0))
    spin_until(executor, lambda: live.view.parts(time.monotonic())["inputs"]["position"]["state"] == "heard")


def test_only_what_changed_is_sent_again(live: Live) -> None:
    with viewer.watching(live.server.url) as watcher:
        first = watcher.receive()
        assert first is not None
        assert set(first["all"]) == set(live.view.parts(0.0))
        live.view.place(77.0)
        while "set" not in (news := watcher.receive() or {}):
            assert set(news) <= {"now", "change"}, "a sign of life holds nothing else"
        assert news["set"] == {"place_m": 77.0}


def test_a_viewer_that_goes_is_forgotten(live: Live) -> None:
    with viewer.watching(live.server.url) as watcher:
        watcher.receive()
        assert live.server.viewers == 1
    deadline = time.monotonic() + TIMEOUT_S
    while live.server.viewers:
        assert time.monotonic() < deadline


def test_the_page_is_whole_and_only_this_machine_gets_it(live: Live) -> None:
    assert live.server.url.startswith("http://127.0.0.1:")
    with urlopen(live.server.url, timeout=TIMEOUT_S) as response:
        html = response.read().decode()
    assert "connect-src 'self'" in html
    assert "$" not in html.split("<script>")[0], "a placeholder is left"
    assert 'src="' not in html


def test_a_second_viewer_costs_no_second_comparison() -> None:
    looks: list[int] = []

    def parts() -> dict[str, Any]:
        looks.append(1)
        return {"now": float(len(looks)), "run": 1}

    served = server.Server("127.0.0.1", 0, parts, 0.05)
    try:
        with viewer.watching(served.url) as first, viewer.watching(served.url) as second:
            told = [[watcher.receive()["now"] for _ in range(6)] for watcher in (first, second)]
    finally:
        served.close()
    most = server.BEAT_S / 0.05 + 1  # a viewer is sent a sign of life after so many looks, however slow the server is
    for nows in told:
        assert all(later - earlier <= most for earlier, later in pairwise(nows[1:]))
