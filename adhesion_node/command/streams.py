# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Standard streams: those that were closed before the program began, as by `>&-`, and what a terminal is told.

Python has None in the place of a closed one.
"""

import os
import sys
from typing import TextIO

from .written import naming

STREAMS = ("stdin", "stdout", "stderr")
"""By their numbers."""

CONTROLS = {number: f"\\x{number:02x}" for number in (*range(32), *range(127, 160)) if chr(number) not in "\t\n"}
"""What a terminal obeys instead of showing it, as a name in a file may hold it, and how it is shown."""


def open_closed_streams() -> None:
    """Let what goes to a closed stream vanish, and what comes from one be empty; else do nothing."""
    closed = [name for name in STREAMS if getattr(sys, name) is None]
    if not closed:
        return
    # else a file that is opened gets the number of the stream, and what a library or a child says goes into it
    while (nowhere := os.open(os.devnull, os.O_RDWR)) < len(STREAMS):
        os.set_inheritable(nowhere, True)
    for name in closed:
        mode = "r" if name == "stdin" else "w"
        setattr(sys, name, os.fdopen(nowhere, mode, encoding="utf-8", errors="backslashreplace", closefd=False))


def show_controls() -> None:
    """Escape from now on what a terminal would obey, and let an error of a stream name it."""
    for stream, name in ((sys.stdout, "standard output"), (sys.stderr, "standard error")):
        if "write" not in vars(stream):
            _show_controls(stream, name)


def _show_controls(stream: TextIO, name: str) -> None:
    plain, empty = stream.write, stream.flush

    def write(text: str) -> int:
        with naming(name):
            return plain(text.translate(CONTROLS))

    def flush() -> None:
        with naming(name):
            empty()

    stream.write, stream.flush = write, flush  # type: ignore[method-assign]
