# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The pace of the simulator: who listens misses nothing, and a late timer catches up in bounded bursts."""

from __future__ import annotations

import math
import time
from collections import defaultdict
from typing import Any

import pytest
from conftest import SpinUntil
from messages import message_class
from published import ROS_OWN, Sent, by_topic, sent
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from test_simulator import _destroy, _nanoseconds, _simulator

from adhesion_node.nodes.ros.qos import subscribe
from adhesion_node.wire.topics import BRAKE_PRESSURE, CLOCK, POSITION, SPEED, TRUTH_MU, TRUTH_STATE
from sim_node.nodes.pace import MAX_BURST, due_s
from sim_node.nodes.simulator import Simulator
from sim_node.settings import SLOWEST

__all__ = ["sent"]


class _Listener(Node):
    """Subscribes reliably to everything the simulator publishes."""

    def __init__(self, context: Context) -> None:
        super().__init__("listener", context=context)
        self.heard: dict[str, list[Any]] = defaultdict(list)
        for topic in (CLOCK, TRUTH_STATE, TRUTH_MU, POSITION, BRAKE_PRESSURE, SPEED):
            self.create_subscription(message_class(topic), topic.name, self.heard[topic.name].append, 100)


RUN_OF_61: dict[str, Any] = {"scenario": "cruise", "rate_hz": 1.0, "real_time_factor": 0.0, "speed_std_mps": 0.1}


def test_a_whole_run_arrives_and_ends_the_program(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """Timer and DDS, from the first sample to the last."""
    simulator = _simulator(context, paced=True, wait_for=1, **RUN_OF_61)
    listener = _Listener(context)
    executor.add_node(listener)
    spin_until(executor, lambda: all(p.get_subscription_count() for p in _outputs(simulator)))
    executor.add_node(simulator)
    spin_until(executor, lambda: simulator.finished and all(len(got) == 61 for got in listener.heard.values()))
    assert len(listener.heard) == 6
    expected = [(1000 + k) * 10**9 for k in range(61)]
    assert [_nanoseconds(m.header.stamp) for m in listener.heard["position"]] == expected
    assert [_nanoseconds(m.clock) for m in listener.heard["/clock"]] == expected


def _outputs(simulator: Simulator) -> list[Publisher]:
    return [p for p in simulator.publishers if p.topic_name not in ROS_OWN]


def test_nothing_is_published_before_the_subscribers_are_there(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil, sent: Sent
) -> None:
    simulator = _simulator(context, paced=True, wait_for=1, **RUN_OF_61)
    executor.add_node(simulator)
    calls = _count_calls(simulator)
    spin_until(executor, lambda: len(calls) >= 5)
    assert sent == []
    executor.add_node(_Listener(context))
    spin_until(executor, lambda: simulator.finished)
    assert len(by_topic(sent)["/position"]) == 61


def test_who_is_found_a_little_later_misses_nothing(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """The position is subscribed, the pressure not yet: discovery comes topic by topic."""
    simulator = _simulator(context, paced=True, wait_for=1, **RUN_OF_61)
    executor.add_node(simulator)
    listener = Node("listener", context=context)
    executor.add_node(listener)
    calls = _count_calls(simulator)
    heard: list[int] = []
    subscribe(listener, POSITION, lambda _: None)
    spin_until(executor, lambda: simulator.count_subscribers("position") == 1)
    calls.clear()
    spin_until(executor, lambda: len(calls) >= 5)
    subscribe(listener, BRAKE_PRESSURE, lambda message: heard.append(_nanoseconds(message.header.stamp)))
    spin_until(executor, lambda: simulator.finished and len(heard) == 61)
    assert heard[0] == 1000 * 10**9


def _count_calls(node: Node) -> list[None]:
    """A list that grows with every round of the executor in which a timer beside the simulator's has fired."""
    calls: list[None] = []
    node.create_timer(0.005, lambda: calls.append(None))
    return calls


def test_the_node_lives_on_when_told_to(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil, sent: Sent
) -> None:
    simulator = _simulator(context, paced=True, exit_at_end=False, **RUN_OF_61)
    executor.add_node(simulator)
    spin_until(executor, lambda: sum(not timer.is_canceled() for timer in simulator.timers) == 1)
    assert len(by_topic(sent)["/position"]) == 61
    assert not simulator.finished


def test_a_run_without_a_timer_finishes_too(context: Context) -> None:
    simulator = _simulator(context, **RUN_OF_61)
    assert sum(1 for _ in iter(simulator.tick, False)) == 61
    assert simulator.finished
    assert list(simulator.timers) == []
    _destroy(simulator)


def test_the_real_time_factor_sets_the_pace(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    """60 s at a factor of 100 last 0.6 s; half a sample, 5 ms, is the rounding."""
    simulator = _simulator(context, paced=True, **{**RUN_OF_61, "real_time_factor": 100.0})
    executor.add_node(simulator)
    begun = time.monotonic()
    spin_until(executor, lambda: simulator.finished)
    assert time.monotonic() - begun > 0.59


def test_the_slowest_pace_publishes_the_first_sample(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    simulator = _simulator(context, paced=True, **{**RUN_OF_61, "rate_hz": 0.1, "real_time_factor": SLOWEST})
    executor.add_node(simulator)
    spin_until(executor, lambda: simulator._begun_ns > 0)
    simulator._on_timer()
    assert simulator.samples == 1


def test_use_sim_time_does_not_stop_the_clock_that_the_node_itself_drives(
    context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    simulator = _simulator(context, paced=True, use_sim_time=True, **RUN_OF_61)
    executor.add_node(simulator)
    spin_until(executor, lambda: simulator.finished)


@pytest.mark.parametrize("late_s", [0.0, 0.03, 0.35, 5.0])
def test_a_late_timer_catches_up_in_bounded_bursts(late_s: float) -> None:
    """After a pause the calls publish at most MAX_BURST each until the run is on time again, and none is lost."""
    published = 0
    for call in range(200):
        elapsed_s = call * 0.1 + (late_s if call >= 20 else 0.0)
        until_s = due_s(round(elapsed_s * 1e9), 1.0, 0.1)
        published += sum(0.1 * k <= until_s for k in range(published, published + MAX_BURST))
    assert published == pytest.approx(200 + late_s / 0.1, abs=0.51)


@pytest.mark.parametrize("jitter_s", [-0.04, 0.04])
def test_a_jittering_timer_still_publishes_one_sample_per_call(jitter_s: float) -> None:
    until_s = [due_s(round((k * 0.1 + jitter_s * (k % 2)) * 1e9), 1.0, 0.1) for k in range(50)]
    assert all(0.1 * k <= until < 0.1 * (k + 1) for k, until in enumerate(until_s))


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (
            {"scenario": "tunel"},
            "scenario = 'tunel': choose one of tunnel_entry, tunnel_exit, cruise, dry_braking, low_ad",
        ),
        ({"rate_hz": 0.0}, r"rate_hz = 0\.0: give a value from 0\.1 to 1000 Hz"),
        ({"real_time_factor": -1.0}, r"real_time_factor = -1\.0: give"),
        ({"real_time_factor": math.nan}, "real_time_factor = nan: give a value from 0 to 1000"),
        ({"real_time_factor": 1e12}, r"real_time_factor = 1000000000000\.0: give a value from 0 to 1000"),
        ({"real_time_factor": 1e-12}, r"real_time_factor = 1e-12: give 0 \(any speed\) or at least 0\.001"),
        ({"position_std_m": 0.0}, r"position_std_m = 0\.0: give"),
        ({"outlier_fraction": 1.5}, r"outlier_fraction = 1\.5: give"),
        ({"student_dof": 0.5}, r"student_dof = 0\.5: give 0 \(Gaussian\) or at least 1"),
        ({"seed": -1}, "seed = -1: give"),
    ],
)
def test_bad_parameters_are_refused_with_name_value_and_remedy(
    context: Context, parameters: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        _simulator(context, **parameters)
