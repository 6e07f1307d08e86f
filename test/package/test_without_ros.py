# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""Every program where there is no ROS: --help and completion, one line with both remedies, offline work as ever."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT
from test_package import NODES, console_scripts

BLOCKED = """
import re, sys
from importlib import import_module
from importlib.abc import MetaPathFinder

class NoRos(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if re.fullmatch(r"rclpy|[a-z_]+_(msgs|srvs|interfaces)", name.partition(".")[0]):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, NoRos())
module, function, *sys.argv = sys.argv[1:]
sys.exit(getattr(import_module(module), function)())
"""


def without_ros(program: str, *args: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", BLOCKED, "adhesion_node.main", program, program, *args]
    return subprocess.run(command, capture_output=True, text=True, timeout=60.0, check=False)


@pytest.mark.parametrize("program", sorted(console_scripts()))
def test_help_needs_no_ros(program: str) -> None:
    shown = without_ros(program, "--help")
    assert (shown.returncode, shown.stderr) == (0, "")
    assert shown.stdout.startswith(f"usage: {program}")
    assert "\nexamples:\n" in shown.stdout


ARGUMENTS = {"recorder": ["--output", "there"], "replay": [str(ROOT / "bags" / "tunnel_entry")]}


@pytest.mark.parametrize("program", sorted({*NODES, "demo"}))
def test_what_needs_ros_says_how_to_get_it_in_one_line(program: str) -> None:
    ended = without_ros(program, *ARGUMENTS.get(program, []))
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr.count("\n") == 1
    assert ended.stderr.startswith("rclpy is missing: ")
    assert "source /opt/ros/jazzy/setup.bash" in ended.stderr
    assert "pip install '.[ros]'" in ended.stderr
    assert not Path("there").exists()


def test_an_offline_replay_needs_none(tmp_path: Path) -> None:
    out = tmp_path / "results.csv"
    ended = without_ros("replay", str(ROOT / "bags" / "tunnel_entry"), "--offline", "--out", str(out))
    assert ended.returncode == 0, ended.stderr
    assert "digest" in ended.stdout
    assert len(out.read_text(encoding="utf-8").splitlines()) > 100
