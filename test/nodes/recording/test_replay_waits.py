# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Replay and its subscribers: it waits for those that come, for the slow, not for the hung, and names who may lose."""

from __future__ import annotations

import json
import math
import re
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from conftest import SpinUntil
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from recorded import write_steps
from replays import UNLIMITED, Listener, of, replay_process

from adhesion_node.bag import BagReader, select
from adhesion_node.nodes import acknowledged, player
from adhesion_node.nodes.player import Replay
from adhesion_node.nodes.ros import discovery
from adhesion_node.wire.topics import BRAKE_PRESSURE, POSITION


def turned_by_hand(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the time of the player's clock, ms, in a list to be changed."""
    now_ms = [5000]
    for module in (player, discovery):
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: now_ms[0] / 1000))
    return now_ms


def test_a_machine_that_is_held_up_is_given_more_time_for_its_discovery(
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Three ticks a second: not even the longest wait for a subscriber ends the wait for the others."""
    now_ms = turned_by_hand(monkeypatch)
    write_steps(tmp_path / "bag", 2)
    executor.add_node(Listener(context, POSITION))
    with BagReader(tmp_path / "bag") as reader:
        node = Replay(reader, select(reader.topics), 0.0, context=context)
        spin_until(executor, lambda: node.count_subscribers("/position") == 1)
        begun = []
        for now_ms[0] in range(5000, 5000 + 300 * (discovery.SETTLE_LOOKS + 3), 300):
            node.tick()
            begun.append(node.published["/position"] > 0)
        node.destroy_node()
    assert begun.index(True) == discovery.SETTLE_LOOKS + 1


def test_it_waits_for_a_subscriber_and_then_misses_nothing(
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(player, "SUBSCRIBERS_S", math.inf)  # however slow the machine is
    written = write_steps(tmp_path / "bag", 5)
    with BagReader(tmp_path / "bag") as reader:
        node = Replay(reader, select(reader.topics), 0.0, context=context)
        executor.add_node(node)
        for _ in range(50):
            executor.spin_once(timeout_sec=0.01)
        assert not node.published
        listener = Listener(context, POSITION, BRAKE_PRESSURE)
        executor.add_node(listener)
        spin_until(executor, lambda: len(listener.heard) == len(written))


def test_waiting_for_subscribers_is_bounded(
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(player, "SUBSCRIBERS_S", 0.3)
    write_steps(tmp_path / "bag", 5)
    with BagReader(tmp_path / "bag") as reader:
        node = Replay(reader, select(reader.topics), 0.0, context=context)
        executor.add_node(node)
        spin_until(executor, lambda: node.finished)
    assert node.published["/position"] == 5
    assert "/position: fewer than 1 subscribers after 0.3 s: replaying all the same" in capfd.readouterr().err


def test_at_full_speed_a_slow_subscriber_in_another_process_slows_it_down(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """More messages than the queue of the publisher holds and a subscriber that stands still for a while."""
    steps = 1500
    written = write_steps(tmp_path / "bag", steps)
    listener = Listener(context, POSITION, profile=UNLIMITED)
    executor.add_node(listener)
    with replay_process(str(tmp_path / "bag"), "--rate", "0", "--topics", "position", "--json", "-") as process:
        spin_until(executor, lambda: len(listener.heard) > 10)
        time.sleep(0.5)  # not to synchronise: meanwhile the replay publishes several queues full
        spin_until(executor, lambda: process.poll() is not None and len(listener.heard) == steps)
        out, err = process.communicate()
    assert process.returncode == 0, err
    assert json.loads(out) == {"messages": {"/position": steps}, "complete": True}
    assert listener.of(POSITION) == of(written, "/position")


def test_a_subscriber_that_hangs_is_waited_for_once(
    tmp_path: Path,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """DDS takes 5000 messages of each topic for it. What the others get is complete; the end says what it may lack."""
    monkeypatch.setattr(acknowledged, "ACKNOWLEDGED_S", 1.0)
    monkeypatch.setattr(acknowledged, "KEPT_S", 0.02)
    steps, listener = 7000, Listener(context, POSITION, BRAKE_PRESSURE, profile=UNLIMITED)
    written = write_steps(tmp_path / "bag", steps)
    hung = Listener(context, POSITION, BRAKE_PRESSURE, profile=UNLIMITED)  # nobody spins it
    executor.add_node(listener)
    with BagReader(tmp_path / "bag") as reader:
        node = Replay(reader, select(reader.topics), 0.0, subscribers=2, context=context)
        executor.add_node(node)
        spin_until(executor, lambda: node.finished)
        spin_until(executor, lambda: len(listener.heard) == len(written))
    executor.add_node(hung)  # which is destroyed with it
    assert listener.of(POSITION) == of(written, "/position")
    assert listener.of(BRAKE_PRESSURE) == of(written, "/brake_pressure")
    (told,) = [line for line in capfd.readouterr().err.splitlines() if "subscriber took nothing" in line]
    assert told.endswith("/position, /brake_pressure: a subscriber took nothing for 1 s and is not waited for any more")
    lost = re.fullmatch(r"a subscriber hung, messages may be lost to it: (.*)", str(node.failure))
    assert lost
    assert sorted(lost[1].split("; ")) == [f"/{name}, up to 2000 of 7000" for name in ("brake_pressure", "position")]


def test_a_best_effort_subscriber_at_full_speed_is_named(
    tmp_path: Path, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    written = write_steps(tmp_path / "bag", 5)
    listener = Listener(context, POSITION)
    executor.add_node(listener)
    with replay_process(str(tmp_path / "bag"), "--rate", "0") as process:
        spin_until(executor, lambda: process.poll() is not None)
        out, err = process.communicate()
    assert process.returncode == 0
    assert set(listener.of(POSITION)) <= set(of(written, "/position")), "as it says: it may have lost some"
    assert out.split() == ["5", "/brake_pressure", "5", "/position"]
    assert "listener subscribes /position best effort and may lose messages: start it with -p qos_overrides./pos" in err
