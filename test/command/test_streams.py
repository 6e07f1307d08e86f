# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A program whose standard streams are closed from the start."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

SAYS = """
import argparse, os, subprocess, sys
from adhesion_node.command.options import run_tool

def work(_):
    with open(sys.argv[1], "w") as file:
        print("result")
        print("note", file=sys.stderr)
        subprocess.run(["echo", "of a child"], check=True)
        file.write(f"read: {sys.stdin.read()!r}")
    return 0

sys.exit(run_tool(argparse.ArgumentParser("tool"), work, []))
"""


def with_closed(streams: str, *call: str) -> tuple[int, str, str]:
    """Exit code and what came out of a call whose `streams` a shell has closed."""
    shell = ["sh", "-c", f'exec "$@" {streams}', "sh", sys.executable, *call]
    ended = subprocess.run(
        shell, capture_output=True, text=True, timeout=60.0, cwd=ROOT, check=False, stdin=subprocess.DEVNULL
    )
    return ended.returncode, ended.stdout, ended.stderr


@pytest.mark.parametrize("streams", [">&-", "2>&-", "<&-", ">&- 2>&-", "<&- >&-", "<&- >&- 2>&-"])
def test_what_is_said_goes_nowhere_else(streams: str, tmp_path: Path) -> None:
    """Neither to the other stream nor into a file that is opened meanwhile."""
    file = tmp_path / "written"
    code, out, err = with_closed(streams, "-c", SAYS, str(file))
    assert code == 0
    assert sorted(out.splitlines()) == ([] if " >&-" in f" {streams}" else ["of a child", "result"])
    assert err == ("" if "2>&-" in streams else "note\n")
    assert file.read_text() == "read: ''"


@pytest.mark.parametrize("program", ["train", "estimator"])
def test_every_program_ends_without_a_traceback(program: str) -> None:
    code = f"import sys; from adhesion_node.main import {program}; sys.exit({program}())"
    assert with_closed(">&-", "-c", code, "--version") == (0, "", "")


def test_an_interruption_is_not_taken_for_a_result() -> None:
    code = (
        "import signal, sys, adhesion_node.main as main\n"
        "main._main_of = lambda _: signal.raise_signal(signal.SIGINT)\n"
        "sys.exit(main.train())"
    )
    assert with_closed("2>&-", "-c", code) == (1, "", "")
