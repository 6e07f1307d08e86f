# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The main of every node as a real program: signals at every stage, exit codes, messages, the last publication."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import IO

import pytest
from conftest import PATIENCE_S, SpinUntil
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64

from adhesion_node.command.options import BAD_INPUT, DONE, FAILED
from adhesion_node.command.signals import stop_on_signals
from adhesion_node.nodes.ros import runtime
from adhesion_node.wire.files.parameters import sections, unheeded

PROGRAM = """
import gc, os, sys
from rclpy.node import Node
from std_msgs.msg import Float64
from adhesion_node.nodes.ros import runtime
from adhesion_node.core.setting import Setting
from adhesion_node.nodes.ros.params import declare

SPECS = (Setting("gain", 0.5, "a gain", "dB", 0.0, 1.0),)

def say(word):
    print(word, flush=True)
    if os.environ.get("WAIT_AT") == word:  # the test sends its signals meanwhile
        sys.stdin.readline()

class Probe(Node):
    '''A node that says what it does.'''

    def __init__(self):
        say("starting")
        super().__init__("probe", automatically_declare_parameters_from_overrides=True)
        self.values = declare(self, SPECS)
        self.words = self.create_publisher(Float64, "last_word", 100)
        self.create_timer(0.001, self.tick)
        self.heard = []
        self.create_subscription(Float64, "first_word", lambda message: self.heard.append(message.data), 1000)
        self.task = os.environ.get("TASK", "")

    def tick(self):
        if not hasattr(self, "spun"):
            self.spun = True
            say("spinning")
        if self.task == "fill the disk":
            raise OSError(28, "No space left on device")
        if self.task == "collect":
            say(f"of {gc.get_freeze_count()} objects {len(gc.get_objects())} are looked through")
            self.task = ""
        if self.task == "finish":
            self.finished = True
        if self.task == "stumble":  # the messages of the test queue up behind this
            say("stumbling")
            sys.stdin.readline()
            self.task = ""
        if self.task == "call":
            self.words.publish(Float64(data=-1.0))

    def close(self):
        say("closing")
        say(f"heard {len(self.heard)}")
        for number in range(50):
            self.words.publish(Float64(data=float(number)))

sys.exit(runtime.run("probe", Probe, parameters=SPECS))
"""

Program = subprocess.Popen[str]
Start = Callable[..., Program]


@pytest.fixture
def start(started: list[Program]) -> Start:
    """Return a function that starts the program; whatever still runs after the test is killed."""

    def _start(*args: str, **environment: str) -> Program:
        program = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *args],
            env=os.environ | environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(program)
        return program

    return _start


def wait_for(program: Program, word: str) -> None:
    stdout: IO[str] = program.stdout or pytest.fail("no pipe")
    for line in stdout:
        if line.strip() == word:
            return
    pytest.fail(f"the program ended before it said {word}: {program.communicate()[1]}")


def end(program: Program) -> tuple[int, list[str]]:
    """Wait for the end; return the exit code and what it complained about, log lines aside."""
    _, errors = program.communicate("go on\n" if program.poll() is None else None, timeout=PATIENCE_S)
    return program.returncode, [line for line in errors.splitlines() if not line.startswith("[INFO]")]


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


def test_an_integer_for_a_float_is_accepted(start: Start) -> None:
    program = start("--ros-args", "-p", "gain:=0", TASK="finish")
    assert end(program) == (0, [])


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("-p", "gain:=7"), "gain = 7: give a value from 0 to 1 dB"),
        (("-p", "gain:=loud"), "gain = 'loud': give a value of type float (a value from 0 to 1 dB)"),
        (("-p", "use_sim_time:=1"), "use_sim_time = 1: give a value of type bool (true or false)"),
        (("--params-file", "/nowhere.yaml"), "/nowhere.yaml"),
        (("-p", "gain"), "gain"),
        (("-r", "__node:=a b"), "a b"),
    ],
)
def test_bad_ros_arguments_are_one_line_and_code_2(start: Start, args: tuple[str, ...], message: str) -> None:
    code, errors = end(start("--ros-args", *args))
    assert code == BAD_INPUT
    (complaint,) = [line for line in errors if not line.startswith("[ERROR]")]  # rcl logs some of them itself
    assert complaint.startswith("probe: ")
    assert message in complaint


@pytest.mark.parametrize(
    ("section", "told"), [("prob", True), ("probe", False), ("/**", False), ("/other/probe", True)]
)
def test_a_parameter_file_for_another_node_is_told(start: Start, tmp_path: Path, section: str, told: bool) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(f"{section}:\n  ros__parameters:\n    gain: 0.25\n")
    program = start("--ros-args", "--params-file", str(file), TASK="finish")
    _, errors = program.communicate(timeout=PATIENCE_S)
    assert program.returncode == 0
    assert (f"has sections for {section.strip('/')}, none for /probe: name one 'probe' or '/**'" in errors) == told
    assert ("gain = 0.25" in errors) != told


def test_nested_namespaces_are_sections_too(tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text("train1:\n  probe: {ros__parameters: {gain: 1.0}}\n  other: {ros__parameters: {}}\n")
    assert [one.name for one in sections(str(file))] == ["train1/probe", "train1/other"]
    assert unheeded(["--params-file", str(file)], "/train1/probe") == []
    (warning,) = unheeded(["-p", "a:=1", "--params-file", str(file)], "/train2/probe")
    assert "has sections for train1/probe, train1/other, none for /train2/probe" in warning


def test_arguments_without_ros_args_are_refused(start: Start) -> None:
    code, complaints = end(start("-p", "gain:=0"))
    assert code == BAD_INPUT
    assert "unrecognized arguments: -p gain:=0" in complaints[-1]
    assert "--ros-args -p NAME:=VALUE" in complaints[0]


def test_help_shows_the_parameters(start: Start) -> None:
    program = start("--help")
    shown, errors = program.communicate(timeout=PATIENCE_S)
    assert (program.returncode, errors) == (0, "")
    assert "A node that says what it does." in shown
    assert "gain (default: 0.5): a gain; a value from 0 to 1 dB" in shown


def test_a_full_disk_is_one_line_and_code_1(start: Start) -> None:
    assert end(start(TASK="fill the disk")) == (FAILED, ["probe: input/output: No space left on device"])


def test_own_and_ros_arguments_are_told_apart() -> None:
    args = ["--output", "x", "--ros-args", "-p", "a:=1", "--", "--json", "-", "--ros-args", "-r", "a:=b"]
    own, ros = runtime.split_ros_arguments(args)
    assert own == ["--output", "x", "--json", "-"]
    assert ros == ["--ros-args", "-p", "a:=1", "--", "--ros-args", "-r", "a:=b"]


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
