# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What every program has: a version, an end by Ctrl-C without a traceback, and a hint to where parameters go."""

from __future__ import annotations

import importlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from types import ModuleType

import pytest
from conftest import ROOT
from test_package import console_scripts

from adhesion_node import main
from adhesion_node.tools.demo import line

TOOLS = {"import_csv", "brakings", "recover", "demo", "report", "study", "bench", "train"}


@pytest.mark.parametrize("program", sorted(console_scripts()))
def test_the_version_is_told(program: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", [f"/usr/bin/{program}", "--version"])
    module, function = console_scripts()[program]
    with pytest.raises(SystemExit) as ended:
        getattr(importlib.import_module(module), function)()
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith(f"{program}, adhesion_node ")


@pytest.fixture
def handlers() -> Iterator[None]:
    """The signals' handlers are afterwards as they were before."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("handlers")
@pytest.mark.parametrize("program", sorted(TOOLS & console_scripts().keys()))
def test_a_ctrl_c_while_it_still_imports_leaves_one_line(
    program: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The signal comes at the moment at which the import of the tool begins."""

    def interrupted(name: str) -> ModuleType:
        signal.raise_signal(signal.SIGINT)
        return importlib.import_module(name)

    monkeypatch.setattr(main, "import_module", interrupted)
    monkeypatch.setattr(sys, "argv", [program])
    assert getattr(main, program)() == 1
    assert capsys.readouterr() == ("", f"{program}: interrupted\n")


def test_a_program_that_is_interrupted_in_its_import_ends_with_1() -> None:
    code = (
        "import os, signal, sys, adhesion_node.main as main\n"
        "real = main.import_module\n"
        "def interrupted(name):\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    return real(name)\n"
        "main.import_module = interrupted\n"
        "sys.exit(main.train())"
    )
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60.0, cwd=ROOT, check=False
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (1, "", "train: interrupted\n")


@pytest.mark.parametrize(
    ("program", "given", "hint"),
    [
        ("simulator", ["--scenario", "leaves"], "--ros-args -p scenario:=leaves"),
        ("estimator", ["--start-mu=0.1"], "--ros-args -p start_mu:=0.1"),
        ("atp_monitor", ["--target_speed_kmh", "100"], "--ros-args -p target_speed_kmh:=100"),
    ],
)
def test_a_parameter_given_as_an_option_is_told_where_it_goes(
    program: str, given: list[str], hint: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [f"/usr/bin/{program}", *given])
    module, function = console_scripts()[program]
    with pytest.raises(SystemExit) as ended:
        getattr(importlib.import_module(module), function)()
    assert ended.value.code == 2
    assert capsys.readouterr().err.rstrip().endswith(f"a node takes its parameters from ROS: {hint}")


NODES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("estimator", "creep_estimator", "atp_monitor", "simulator", "slip_simulator", "live"), ()),
    "recorder": ("--output", "nowhere"),
    "replay": (str(ROOT / "bags" / "tunnel_entry"),),
}
"""With what they need to start."""


@pytest.mark.parametrize("program", NODES)
def test_what_is_wrong_at_the_start_of_a_node_is_said_under_its_name(
    program: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["/a/launcher", *NODES[program], "--ros-args", "-p", "use_sim_time:=1"])
    module, function = console_scripts()[program]
    assert getattr(importlib.import_module(module), function)() == 2
    said = f"{program}: use_sim_time = 1: give a value of type bool (true or false)\n"
    assert capsys.readouterr() == ("", said)


def test_lines_on_one_machine_have_domains_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two that nobody else asks for."""
    first = 1000 + 2 * os.getpid()
    monkeypatch.setattr(line, "DOMAINS", (first, first + 1))
    assert os.environ["ROS_DOMAIN_ID"], "that of the tests"
    with line.own_domain() as told:
        assert told is None
    monkeypatch.delenv("ROS_DOMAIN_ID")
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE")
    with line.own_domain() as one, line.own_domain() as other:
        assert (one, other) == (first, first + 1)
        assert os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    with line.own_domain() as again:
        assert again == one, "free again"


def test_an_import_leaves_the_signals_as_they_are() -> None:
    """Of a suite in the background SIGINT is ignored, and that of a terminal is Python's own."""
    code = (
        "import signal, sys\n"
        "for handler in signal.default_int_handler, signal.SIG_IGN:\n"
        "    signal.signal(signal.SIGINT, handler)\n"
        "    import adhesion_node.main\n"
        "    assert signal.getsignal(signal.SIGINT) is handler\n"
        "    del sys.modules['adhesion_node.main']"
    )
    subprocess.run([sys.executable, "-c", code], timeout=60.0, cwd=ROOT, check=True)
