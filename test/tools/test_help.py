# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""--help and completion of every program, as a newcomer and a shell ask for them."""

from __future__ import annotations

import argparse
import importlib
import re
import runpy
import subprocess
import sys

import pytest
from conftest import ROOT
from forked import ended
from test_package import console_scripts

from adhesion_node.command.options import help_texts
from adhesion_node.study.__main__ import STUDIES, main

MAIN = (ROOT / "adhesion_node" / "main.py").read_text(encoding="utf-8")
MODULES = {"replay": "adhesion_node.nodes.replay"} | dict(re.findall(r'^(\w+) = _\w+\("(.*)"\)$', MAIN, re.MULTILINE))
"""Of the programs."""


@pytest.mark.parametrize(
    ("program", "args"),
    [*((program, ()) for program in sorted(console_scripts())), *(("study", (name,)) for name in STUDIES)],
)
def test_help_says_the_purpose_and_gives_examples(
    program: str, args: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [f"/usr/bin/{program}", *args, "--help"])
    module, function = console_scripts()[program]
    with pytest.raises(SystemExit) as ended:
        getattr(importlib.import_module(module), function)()
    shown, errors = capsys.readouterr()
    assert (ended.value.code, errors) == (0, "")
    called = " ".join((program, *args))
    usage, purpose = shown.split("\n\n")[:2]
    assert usage.startswith(f"usage: {called}")
    assert purpose.endswith(".")
    examples = shown.split("\nexamples:\n")[1].splitlines()
    assert examples
    assert all(line.startswith(f"  {called}") for line in examples)
    assert all(told.startswith("default: ") for told in re.findall(r"\bdefault\b.*", options_of(shown)))


@pytest.mark.parametrize(("program", "module"), MODULES.items())
def test_python_m_runs_the_program(
    program: str, module: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A program that began and ended without a word looked as if it had done its work."""
    monkeypatch.setattr(sys, "argv", [module, "--help"])
    monkeypatch.delitem(sys.modules, module, raising=False)
    with pytest.raises(SystemExit) as ended:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith(f"usage: {program} ")


@pytest.mark.parametrize("program", ["import_csv", "replay", "estimator"])
def test_a_python_without_docstrings_runs_the_program(program: str) -> None:
    """Every tool ended in a traceback, also without --help; a node's help was that of a base class of Python's."""
    command = [sys.executable, "-OO", "-m", MODULES[program], "--help"]
    shown = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert shown.startswith(f"usage: {program} ")
    assert "ABC" not in shown


def options_of(shown: str) -> str:
    """The part of a help that lists options or parameters, as one line."""
    return " ".join(shown.partition("\noptions:")[2].partition("\nexamples:")[0].split())


def test_the_default_of_an_option_is_told_in_one_way(capsys: pytest.CaptureFixture[str]) -> None:
    parser = argparse.ArgumentParser("tool", **help_texts("Does it."))
    parser.add_argument("--share", type=float, default=100.0, help="in per cent, 50 %% for one")
    parser.add_argument("--folder", default="here", help="where to (default: here, numbered)")
    parser.add_argument("--name", default="", help="of it")
    parser.add_argument("--all", action="store_true", help="of them")
    parser.add_argument("--set", action="append", default=[], help="a setting")
    parser.print_help()
    told = options_of(capsys.readouterr().out)
    assert "in per cent, 50 % for one (default: 100)" in told
    assert told.count("default") == 2


def test_what_a_study_does_not_know_is_answered_with_its_own_usage(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["creep", "--seeds", "0"])
    err = capsys.readouterr().err
    assert ended.value.code == 2
    assert err.startswith("usage: study creep ")
    assert err.endswith("study creep: error: unrecognized arguments: --seeds 0\n")


COMPLETED = [
    ("study ", set(STUDIES)),
    ("study creep --r", {"--runs"}),
    ("demo --scenario tunnel_e", {"tunnel_entry", "tunnel_exit"}),
    ("replay my_run --off", {"--offline"}),
    ("recorder --out", {"--output"}),
    ("recover my_run --out", {"--output"}),
    ("import_csv log.csv --pressure-", {"--pressure-unit", "--pressure-kind"}),
    ("brakings my_run --sched", {"--scheduler"}),
    ("train --est", {"--estimate"}),
    ("report my_run --tar", {"--target"}),
    ("live --po", {"--port"}),
    ("bench --r", {"--rounds"}),
    ("estimator --ros-args -p train.m", {"train.mass_kg:="}),
    ("atp_monitor --ros-args -p target_", {"target_position_m:=", "target_speed_kmh:="}),
    ("creep_estimator --ros-args -p axle", {"axles:=", "axle_load_kg:="}),
    ("slip_simulator --ros-args -p scen", {"scenario:="}),
    ("simulator --params", {"--params-file"}),
]
"""Command line up to the <TAB>, and what must be among the offers."""


@pytest.fixture(scope="module")
def offers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    """What a shell would offer behind each line."""
    folder = tmp_path_factory.mktemp("offers")
    answers = {line: folder / str(number) for number, (line, _) in enumerate(COMPLETED)}
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n"}
    calls = [
        (
            line.split()[:1],
            {**asked, "_ARGCOMPLETE_STDOUT_FILENAME": str(answer), "COMP_LINE": line, "COMP_POINT": str(len(line))},
        )
        for line, answer in answers.items()
    ]
    shared = (
        "import adhesion_node.study.__main__, adhesion_node.tools.brakings.__main__, adhesion_node.tools.demo.__main__"
    )
    assert [call.returncode for call in ended(calls, folder / "calls", shared)] == [0] * len(calls)
    return {line: {word.strip() for word in answer.read_text().splitlines()} for line, answer in answers.items()}


def test_a_study_is_loaded_where_it_is_asked_for() -> None:
    """A worker process loads the main module, too."""
    told = "import sys, adhesion_node.study.__main__; print(*(name for name in sys.modules if 'node' in name))"
    loaded = subprocess.run([sys.executable, "-c", told], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    ours = {name for name in loaded.split() if name.startswith(("adhesion_node.", "sim_node"))}
    assert {name for name in ours if ".command" not in name} == {"adhesion_node.study", "adhesion_node.study.__main__"}


@pytest.mark.parametrize(("line", "expected"), COMPLETED)
def test_a_shell_completes_what_a_program_takes(line: str, expected: set[str], offers: dict[str, set[str]]) -> None:
    assert offers[line] >= expected
    assert all(word.startswith(line.rsplit(" ", 1)[1]) for word in offers[line])


def test_the_documented_command_completes_every_program() -> None:
    page = (ROOT / "doc" / "install.md").read_text(encoding="utf-8")
    command = re.search(r'^eval "\$\(register-python-argcomplete ([^)]*)\)"$', page, re.MULTILINE)
    assert command is not None
    named = command[1].replace("\\\n", " ").split()
    assert sorted(named) == sorted(console_scripts())
    assert {line.partition(" ")[0] for line, _ in COMPLETED} == console_scripts().keys()
