# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A signal that ends a tool, at work or before it minds it: one line and its code; of a node not yet begun, nothing."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

from adhesion_node.command.signals import stop_on_signals

INTERRUPTED = """
import signal, sys
from adhesion_node import main

module = sys.argv[1]

class CtrlC:
    def find_spec(self, name, *_):
        if name == module:
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, CtrlC())
program = getattr(main, sys.argv[2])
del sys.argv[:2]
sys.exit(program())
"""
"""A program that gets a Ctrl-C as the import of a module begins."""


WRITING = """
import argparse, signal, sys
from adhesion_node.command.options import run_tool
from adhesion_node.command.written import whole

def work(_):
    with whole(sys.argv[1]):
        signal.raise_signal(int(sys.argv[2]))
    return 0

signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background it may be ignored
code = run_tool(argparse.ArgumentParser("tool"), work, [])
assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
sys.exit(code)
"""
"""A tool that gets a signal while it writes a file."""


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 1), (signal.SIGTERM, 143)])
def test_a_signal_leaves_no_unfinished_file(number: int, code: int, tmp_path: Path) -> None:
    """SIGTERM left a file that ends in .part."""
    call = [sys.executable, "-c", WRITING, str(tmp_path / "rows.csv"), str(int(number))]
    ended = subprocess.run(call, capture_output=True, text=True, timeout=60.0, cwd=ROOT, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (code, "", "tool: interrupted\n")
    assert list(tmp_path.iterdir()) == []


def test_behind_a_study_that_was_interrupted_signals_are_what_they_were() -> None:
    """Of a program that goes on, as a notebook does, they would be ignored for good."""
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with stop_on_signals(leaving=False) as stop:
        signal.raise_signal(signal.SIGINT)
    assert stop.requested
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before


@pytest.mark.parametrize(
    ("command", "module", "code"),
    [
        (["study", "distances"], "adhesion_node.study.__main__", 1),
        (["study", "distances"], "adhesion_node.study.xie.distances", 1),
        (["replay", "a_bag", "--offline"], "adhesion_node.nodes.replay", 1),
        (["replay", "a_bag"], "adhesion_node.nodes.replay", 0),
        (["replay", "a_bag"], "adhesion_node.nodes.ros.runtime", 0),
    ],
)
def test_a_ctrl_c_while_a_module_is_imported(command: list[str], module: str, code: int) -> None:
    call = [sys.executable, "-c", INTERRUPTED, module, *command]
    ended = subprocess.run(call, capture_output=True, text=True, timeout=60.0, cwd=ROOT, check=False)
    said = f"{command[0]}: interrupted\n" if code else ""
    assert (ended.returncode, ended.stdout, ended.stderr) == (code, "", said)


EARLY = """
import signal, sys
from types import SimpleNamespace
from adhesion_node import main

signal.signal(signal.SIGINT, signal.default_int_handler)  # in the background it may be ignored
main.import_module = lambda _: SimpleNamespace(main=lambda: signal.raise_signal(signal.SIGINT))
sys.exit(main.train())
"""
"""A tool that gets a Ctrl-C as its own main begins."""


def test_a_ctrl_c_between_the_import_and_the_work() -> None:
    call = [sys.executable, "-c", EARLY]
    ended = subprocess.run(call, capture_output=True, text=True, timeout=60.0, cwd=ROOT, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (1, "", "train: interrupted\n")
