# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Several trains in one process as `doc/ros_bringup.md` shows them: each is heard, and a signal ends all."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import messages
import pytest
from conftest import PATIENCE_S, SpinUntil
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from adhesion_node.nodes.ros import qos
from adhesion_node.wire.topics import BRAKE_PRESSURE, MU, POSITION

PAGE = Path(__file__).parents[3] / "doc" / "ros_bringup.md"


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, -signal.SIGTERM)])
def test_trains_of_one_process_are_followed_until_a_signal(
    number: signal.Signals,
    code: int,
    executor: SingleThreadedExecutor,
    spin_until: SpinUntil,
    started: list[subprocess.Popen[str]],
) -> None:
    (example,) = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    driver = Node("driver", context=executor.context)
    executor.add_node(driver)
    told = set[str]()
    trains = ("train1", "train2")
    for train in trains:
        qos.subscribe(driver, MU._replace(name=f"{train}/{MU.name}"), lambda _, train=train: told.add(train))
    outputs = [
        qos.advertise(driver, topic._replace(name=f"{train}/{topic.name}"))
        for train in trains
        for topic in (BRAKE_PRESSURE, POSITION)
    ]
    program = subprocess.Popen([sys.executable, "-c", example], stderr=subprocess.PIPE, text=True)
    started.append(program)
    spin_until(executor, lambda: all(output.get_subscription_count() for output in outputs))
    ticks = iter(range(100_000))

    def drives() -> bool:
        tick = next(ticks)
        for pressure, position in zip(outputs[::2], outputs[1::2], strict=True):
            pressure.publish(messages.brake_pressure(10**9 + tick * 10**8, 101_325.0, 0.0))
            position.publish(messages.position(10**9 + tick * 10**8, 4.0 * tick, 0.5))
        return told == set(trains)

    spin_until(executor, drives)
    program.send_signal(number)
    _, errors = program.communicate(timeout=PATIENCE_S)
    assert "Traceback" not in errors
    assert program.returncode == code
