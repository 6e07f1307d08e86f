# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The main job on recorded data: `replay` and `estimator` as two processes through DDS, equal to an offline replay."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from conftest import PATIENCE_S, SpinUntil
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from start_stop import PRIVATE
from test_offline import FAST, FAST_SETTINGS, Sample, samples, write_run

from adhesion_node.nodes import replay
from adhesion_node.nodes.ros import qos
from adhesion_node.wire.topics import BRAKE_PRESSURE, DIAGNOSTICS, POSITION, SPEED

LOSSLESS = [
    argument
    for topic in (POSITION, BRAKE_PRESSURE, SPEED)
    for policy in ("reliability:=reliable", "history:=keep_all")
    for argument in ("-p", f"qos_overrides./{topic.name}.subscription.{policy}")
]
"""Subscribe so that nothing is lost however fast the replay is and however slow a window."""

QUICK = [argument for name, value in FAST.items() for argument in ("-p", f"{name}:={value}")]

START_S = 90.0
"""For a process that loads compiled code on a machine that is busy."""

Program = subprocess.Popen[str]
Start = Callable[..., Program]


@pytest.fixture
def start(started: list[Program]) -> Start:
    """Return a function that starts a program of the package; none outlives the test."""

    def _start(module: str, *arguments: str) -> Program:
        environment = {name: value for name, value in os.environ.items() if name not in PRIVATE}
        code = f"import sys; from adhesion_node.nodes.{module} import main; sys.exit(main())"
        program = subprocess.Popen(
            [sys.executable, "-c", code, *arguments],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(program)
        return program

    return _start


class Operator(Node):
    """Keeps what the estimator says in /diagnostics."""

    def __init__(self, context: Context) -> None:
        super().__init__("operator", context=context)
        self.heard: list[dict[str, str]] = []
        self.levels: list[bytes] = []
        qos.subscribe(self, DIAGNOSTICS, self._hear, qos.RESULT)

    def _hear(self, message: Any) -> None:
        (status,) = message.status
        if status.name != "estimator/adhesion":
            return
        self.levels.append(status.level)
        self.heard.append({pair.key: pair.value for pair in status.values})

    @property
    def accepted(self) -> int:
        """Measurements that the estimator says it has used."""
        return int(self.heard[-1]["accepted"]) if self.heard else 0

    def __repr__(self) -> str:
        return f"{len(self.heard)} messages, the last one {self.heard[-1:]}"


def has_accepted_more(operator: Operator, than: int) -> bool:
    return operator.accepted > than


def released(run_: Sequence[Sample]) -> list[Sample]:
    """Return the run with the brake off in its last sample: the estimator then evaluates its short window at once.

    So the last estimate stands for all that was recorded, at whatever count, and can be waited for.
    """
    truth, reading = run_[-1]
    return [*run_[:-1], (truth, reading._replace(pressure_pa=101_325.0))]


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of 124 samples: cruising, braking, release."""
    path = tmp_path_factory.mktemp("bag") / "run"
    write_run(path, released(samples(16.0, 28.4)))
    return path


@pytest.fixture(scope="module")
def straight(bag: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The result of the offline replay."""
    file = tmp_path_factory.mktemp("offline") / "result.json"
    assert replay.main([str(bag), "--offline", *FAST_SETTINGS, "--json", str(file)]) == 0
    result: dict[str, Any] = json.loads(file.read_text())
    assert (result["measurements"], result["accepted"], result["dropped"]) == (124, 124, {})
    return result


@pytest.mark.parametrize("rate", ["0", "20"])
def test_two_processes_equal_the_offline_replay_to_the_bit(
    rate: str,
    bag: Path,
    straight: dict[str, Any],
    start: Start,
    context: Context,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
) -> None:
    operator = Operator(context)
    executor.add_node(operator)
    estimator = start("estimator", "--ros-args", *QUICK, *LOSSLESS)
    # Its results must find the operator, or the first ones are lost: it speaks once a second.
    spin_until(executor, lambda: operator.heard, START_S)
    player = start("replay", str(bag), "--rate", rate, "--json", "-")
    while (accepted := operator.accepted) < 124:  # however slow the machine is: as long as it goes on
        spin_until(executor, partial(has_accepted_more, operator, accepted), PATIENCE_S if accepted else START_S)
    assert operator.accepted == 124
    spin_until(executor, lambda: player.poll() is not None, PATIENCE_S)
    out, err = player.communicate()
    assert player.returncode == 0, err
    sent = dict.fromkeys(("position", "brake_pressure", "truth/state", "truth/mu"), 124)
    played = json.loads(out)
    assert {name.lstrip("/"): count for name, count in played["messages"].items()} == sent
    assert played["complete"] is True
    assert "may lose messages" not in err

    estimator.send_signal(signal.SIGINT)
    spin_until(executor, lambda: estimator.poll() is not None, PATIENCE_S)
    _, log = estimator.communicate()
    assert estimator.returncode == 0, log
    assert "Traceback" not in log
    assert re.findall(r"digest ([0-9a-f]{64})", log) == [straight["digest"]]
    spin_until(executor, lambda: operator.heard[-1]["digest"] == straight["digest"], PATIENCE_S)
    last = operator.heard[-1]
    assert {key for key in last if key.startswith("dropped.")} == set()
    assert (last["measurements"], last["windows"]) == ("124", str(straight["windows"]))
    assert last["mu"] == f"{straight['mu_final']:.5f}"
    assert last["mu_lower"] == f"{straight['mu_lower_final']:.5f}"
    assert last["regime"] == straight["regime_final"]


def test_an_estimator_that_heard_nothing_ends_cleanly(
    start: Start, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    operator = Operator(context)
    executor.add_node(operator)
    estimator = start("estimator", "--ros-args", *QUICK)
    spin_until(executor, lambda: operator.heard, START_S)
    estimator.send_signal(signal.SIGTERM)
    spin_until(executor, lambda: estimator.poll() is not None, PATIENCE_S)
    _, log = estimator.communicate()
    assert estimator.returncode == 0, log
    assert "0 measurements, 0 windows, dropped none" in log
    assert "Traceback" not in log
    assert {status["accepted"] for status in operator.heard} <= {"0"}  # it may have said that it waits
