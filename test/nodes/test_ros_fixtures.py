# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The shared fixtures themselves: messages pass, nothing outside is heard, waiting is bounded."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from conftest import ROOT, SpinUntil
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64


def _talk(context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil) -> list[float]:
    """Publish 1, 2, 3 from one node to another once they have found each other; return what arrived."""
    talker, listener = Node("talker", context=context), Node("listener", context=context)
    executor.add_node(talker)
    executor.add_node(listener)
    heard: list[float] = []

    def hear(message: Float64) -> None:
        heard.append(message.data)

    listener.create_subscription(Float64, "value", hear, 10)
    publisher = talker.create_publisher(Float64, "value", 10)
    spin_until(executor, lambda: publisher.get_subscription_count() == 1)
    for value in (1.0, 2.0, 3.0):
        publisher.publish(Float64(data=value))
    spin_until(executor, lambda: len(heard) == 3)
    return heard


@pytest.mark.parametrize("run", [1, 2])
def test_messages_pass_within_a_fresh_context(
    run: int, context: Context, executor: SingleThreadedExecutor, spin_until: SpinUntil
) -> None:
    assert _talk(context, executor, spin_until) == [1.0, 2.0, 3.0]
    nodes = set(next(iter(executor.get_nodes())).get_node_names())
    assert nodes == {"talker", "listener"}, "nodes of another test or of another program are seen"


def test_waiting_is_bounded(executor: SingleThreadedExecutor, spin_until: SpinUntil) -> None:
    with pytest.raises(AssertionError, match=r"still waiting after 0\.2 s"):
        spin_until(executor, lambda: False, timeout_s=0.2)


def test_ros_keeps_to_itself() -> None:
    assert 1 <= int(os.environ["ROS_DOMAIN_ID"]) <= 100


def test_no_other_test_process_gets_the_domain_of_this_one() -> None:
    """Not even one that runs at the same time, as those of pytest-xdist do."""
    code = "import conftest; print(conftest._claim_domain())"
    path = os.pathsep.join([str(ROOT), str(ROOT / "test")])
    other = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=True
    )
    assert other.stdout.strip() != os.environ["ROS_DOMAIN_ID"]
    assert os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert Path(os.environ["ROS_LOG_DIR"]).is_relative_to(tempfile.gettempdir())


def test_started_programs_use_the_tree(tmp_path: Path) -> None:
    code = "import adhesion_node; print(adhesion_node.__file__)"
    shown = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert Path(shown.stdout.strip()) == ROOT / "adhesion_node" / "__init__.py"
