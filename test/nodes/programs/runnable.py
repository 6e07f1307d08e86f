# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A node as a program that says what it does, and how it ends."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from typing import IO

import pytest
from conftest import PATIENCE_S

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
