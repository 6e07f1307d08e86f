# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The main of every node as a real program: signals at every stage, exit codes, messages, the last publication."""

from __future__ import annotations

import re
import signal
from typing import IO

import pytest
from conftest import SpinUntil
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from runnable import Start, end, start, wait_for
from std_msgs.msg import Float64

from adhesion_node.command.options import DONE, FAILED
from adhesion_node.command.signals import stop_on_signals
from adhesion_node.nodes.ros import runtime

__all__ = ["start"]


BURSTS = [
    (signal.SIGINT,),
    (signal.SIGTERM,),
    (signal.SIGINT, signal.SIGINT),
    (signal.SIGTERM, signal.SIGTERM),
    (signal.SIGINT, signal.SIGTERM, signal.SIGINT),
]


@pytest.mark.parametrize("stage", ["starting", "spinning", "closing"])
@pytest.mark.parametrize("burst", BURSTS, ids=lambda burst: "+".join(number.name for number in burst))
def test_signals_end_a_node_cleanly(start: Start, stage: str, burst: tuple[signal.Signals, ...]) -> None:
    program = start(WAIT_AT=stage, TASK="finish" if stage == "closing" else "")
    wait_for(program, stage)
    for number in burst:
        program.send_signal(number)
    assert end(program) == (0, [])


def test_what_was_loaded_is_not_looked_through_again_and_again(start: Start) -> None:
    """A full collection would stop the node for 0.1 s."""
    program = start(TASK="collect", WAIT_AT="")
    stdout: IO[str] = program.stdout or pytest.fail("no pipe")
    told = next(match for line in stdout if (match := re.fullmatch(r"of (\d+) objects (\d+) are .*\n", line)))
    frozen, looked_through = map(int, told.groups())
    assert looked_through < 0.1 * frozen
    program.send_signal(signal.SIGINT)
    assert end(program) == (0, [])


def test_a_signal_ends_an_idle_node_and_closes_it(start: Start) -> None:
    program = start()
    wait_for(program, "spinning")
    program.send_signal(signal.SIGTERM)
    wait_for(program, "closing")
    program.send_signal(signal.SIGTERM)
    assert end(program) == (0, [])


def test_what_is_queued_at_the_signal_is_still_taken(
    start: Start, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    speaker = Node("speaker", context=context)
    executor.add_node(speaker)
    words = speaker.create_publisher(Float64, "first_word", 1000)
    program = start(TASK="stumble")
    wait_for(program, "stumbling")
    spin_until(executor, words.get_subscription_count)
    for number in range(200):
        words.publish(Float64(data=float(number)))
    assert words.wait_for_all_acked(Duration(seconds=10.0))  # they are in the program's queue
    program.send_signal(signal.SIGTERM)
    assert program.stdin is not None
    program.stdin.write("go on\n")
    program.stdin.flush()
    wait_for(program, "heard 200")
    assert end(program) == (0, [])


def test_a_node_may_end_itself(start: Start) -> None:
    program = start(TASK="finish")
    wait_for(program, "closing")
    assert end(program) == (0, [])


def test_the_last_messages_arrive(
    start: Start, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    listener = Node("listener", context=context)
    executor.add_node(listener)
    heard: list[float] = []

    def hear(message: Float64) -> None:
        heard.append(message.data)

    listener.create_subscription(Float64, "last_word", hear, 100)
    program = start(TASK="call")
    spin_until(executor, lambda: heard)  # both sides know each other
    program.send_signal(signal.SIGTERM)
    spin_until(executor, lambda: heard[-50:] == [float(number) for number in range(50)])
    assert end(program) == (0, [])


def test_a_full_disk_is_one_line_and_code_1(start: Start) -> None:
    assert end(start(TASK="fill the disk")) == (FAILED, ["probe: input/output: No space left on device"])


def test_without_a_signal_the_earlier_handlers_return() -> None:
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with stop_on_signals() as stop:
        assert signal.getsignal(signal.SIGINT) is not before[0]
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before
    assert not stop.requested


def test_a_fault_of_our_own_is_not_hidden() -> None:
    def make_node() -> Node:
        node = Node("faulty")
        node.create_timer(0.001, lambda: 1 / 0)
        return node

    with pytest.raises(ZeroDivisionError):
        runtime.run("faulty", make_node, [])
    assert runtime.run("finished", _Finished, []) == DONE, "the context of the failed run is still there"


class _Finished(Node):
    finished = True

    def __init__(self) -> None:
        super().__init__("finished")
