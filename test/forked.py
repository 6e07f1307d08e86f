# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Calls of programs, each in a process of its own: forks of one interpreter, which imports once what they share."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

NURSERY = """
import json, os, sys, traceback
{first}
from adhesion_node import main
codes = []
for number, (argv, environment) in enumerate(json.load(sys.stdin)):
    child = os.fork()
    if child == 0:
        for stream in (1, 2):
            os.dup2(os.open(f"{{number}}.{{stream}}", os.O_WRONLY | os.O_CREAT), stream)
        os.environ.update(environment)
        sys.argv = argv
        try:
            code = getattr(main, argv[0])()
        except SystemExit as end:
            code = end.code or 0
        except BaseException:
            traceback.print_exc()
            code = 1
        sys.stdout.flush()
        os._exit(code)  # without taking apart all that is imported
    codes.append(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
print(json.dumps(codes))
"""

TIMEOUT_S = 300.0
"""Of all calls together, on a busy machine."""

Call = tuple[Sequence[str], Mapping[str, str]]
"""A command line, and what its environment has besides."""


class Ended(NamedTuple):
    """How a call ended and what it said."""

    returncode: int
    stdout: str
    stderr: str


def ended(calls: Sequence[Call], folder: Path, first: str = "") -> list[Ended]:
    """Run programs by their entries, one after the other in a new `folder`.

    `first` is run before the first fork: it imports what they share, or takes care that something is not there.
    """
    folder.mkdir()
    command = [sys.executable, "-c", NURSERY.format(first=first)]
    told = subprocess.run(
        command, input=json.dumps(calls), stdout=subprocess.PIPE, text=True, cwd=folder, timeout=TIMEOUT_S, check=True
    )
    said = [[(folder / f"{n}.{stream}").read_text(encoding="utf-8") for stream in (1, 2)] for n in range(len(calls))]
    return [Ended(code, *texts) for code, texts in zip(json.loads(told.stdout), said, strict=True)]
