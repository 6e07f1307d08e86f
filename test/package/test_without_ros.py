# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Every program where there is no ROS: --help and completion, one line with both remedies, offline work as ever."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT, made_once
from forked import Ended, ended
from test_package import NODES, console_scripts

from adhesion_node.bag import typestore
from adhesion_node.command.without_ros import is_of_ros

BLOCKED = """
import re, sys
from importlib.abc import MetaPathFinder

class NoRos(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if re.fullmatch(r"rclpy|[a-z_]+_(msgs|srvs|interfaces)", name.partition(".")[0]):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, NoRos())
"""

SHARED = "import adhesion_node.report.__main__, adhesion_node.study.__main__, adhesion_node.tools.brakings.__main__"
"""What needs no ROS, and most of what the others import."""

ARGUMENTS = {"recorder": ["--output", "there"], "replay": [str(ROOT / "bags" / "tunnel_entry")]}
CALLS = [
    *([program, "--help"] for program in sorted(console_scripts())),
    *([program, *ARGUMENTS.get(program, [])] for program in sorted({*NODES, "demo"})),
]


def call_all(folder: Path) -> None:
    found = ended([(call, {}) for call in CALLS], folder / "calls", f"{BLOCKED}\n{SHARED}")
    assert not (folder / "calls" / "there").exists()
    (folder / "ended.json").write_text(json.dumps(found), encoding="utf-8")


@pytest.fixture(scope="module")
def without_ros(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Ended]:
    """How each of `CALLS` ends, by its words."""
    file = made_once(tmp_path_factory, "without_ros", call_all) / "ended.json"
    found = [Ended(*each) for each in json.loads(file.read_text(encoding="utf-8"))]
    return {" ".join(call): each for call, each in zip(CALLS, found, strict=True)}


@pytest.mark.parametrize("program", sorted(console_scripts()))
def test_help_needs_no_ros(program: str, without_ros: dict[str, Ended]) -> None:
    shown = without_ros[f"{program} --help"]
    assert (shown.returncode, shown.stderr) == (0, "")
    assert shown.stdout.startswith(f"usage: {program}")
    assert "\nexamples:\n" in shown.stdout


@pytest.mark.parametrize("program", sorted({*NODES, "demo"}))
def test_what_needs_ros_says_how_to_get_it_in_one_line(program: str, without_ros: dict[str, Ended]) -> None:
    told = without_ros[" ".join([program, *ARGUMENTS.get(program, [])])]
    assert (told.returncode, told.stdout) == (2, "")
    assert told.stderr.count("\n") == 1
    assert told.stderr.startswith(f"{program}: rclpy is missing: ")
    assert "source /opt/ros/jazzy/setup.bash" in told.stderr
    assert "pip install '.[ros]'" in told.stderr


def test_the_messages_of_ros_are_told_from_those_of_others() -> None:
    assert all(is_of_ros(name.partition("/")[0]) for name in typestore().fielddefs)
    assert not is_of_ros("my_msgs")


def test_an_offline_replay_needs_none(tmp_path: Path) -> None:
    out = tmp_path / "results.csv"
    call = ["replay", str(ROOT / "bags" / "tunnel_entry"), "--offline", "--out", str(out)]
    (told,) = ended([(call, {})], tmp_path / "calls", BLOCKED)
    assert told.returncode == 0, told.stderr
    assert "digest" in told.stdout
    assert len(out.read_text(encoding="utf-8").splitlines()) > 100


def test_the_tests_say_what_they_need_in_one_line() -> None:
    code = (
        f"{BLOCKED}\nimport pytest\nsys.exit(pytest.main(['-p', 'no:cacheprovider', 'test/core/test_prediction.py']))"
    )
    told = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert told.returncode == 4
    said = "ERROR: rclpy is missing, without which no test runs: source /opt/ros/jazzy/setup.bash"
    assert told.stderr.strip().startswith(said)
    assert told.stderr.strip().count("\n") == 0
