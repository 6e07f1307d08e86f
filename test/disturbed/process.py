# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A program of the package as a process that is killed and started again."""

from __future__ import annotations

import signal
import subprocess
import time
from collections import defaultdict
from pathlib import Path

from start_stop import start

WARM_S = 20.0
"""Memory counts from so long after a start on."""


class Process:
    """A program of the package that may be killed and started again; what it says goes to a file."""

    def __init__(self, name: str, folder: Path, *arguments: str) -> None:
        self.name, self.arguments, self._folder, self._starts = name, arguments, folder, 0
        self.memory_mb: dict[int, list[float]] = defaultdict(list)
        self.begun_s: list[float] = []
        """When its lives began."""
        self.begin()

    def begin(self, *more: str) -> None:
        self._starts += 1
        self.begun_s.append(time.time())
        self.log = self._folder / f"{self.name}_{self._starts}.log"
        with self.log.open("w") as said:
            self.program = start(self.name, *self.arguments, *more, said=said)
        self.since_s = time.monotonic()

    def send(self, number: signal.Signals) -> None:
        self.program.send_signal(number)

    def kill(self) -> None:
        self.program.kill()
        self.program.wait()

    def end(self) -> str:
        """End as an operator would; say what was wrong with it."""
        self.send(signal.SIGCONT)
        self.send(signal.SIGINT)
        try:
            code = self.program.wait(30.0)
        except subprocess.TimeoutExpired:
            self.kill()
            return f"{self.name} did not end"
        return f"{self.name} ended with {code}" if code else ""

    @property
    def traceback(self) -> bool:
        return any("Traceback" in log.read_text() for log in self._folder.glob(f"{self.name}_*.log"))

    def measure(self) -> None:
        """Note the resident memory of a process that has found its size."""
        if self.program.poll() is None and time.monotonic() - self.since_s > WARM_S:
            status = Path(f"/proc/{self.program.pid}/status").read_text()
            size = next(line for line in status.splitlines() if line.startswith("VmRSS"))
            self.memory_mb[self.program.pid].append(int(size.split()[1]) / 1024.0)

    @property
    def grown_mb(self) -> float:
        """Most that one of its lives has grown by."""
        return max((max(sizes) - sizes[0] for sizes in self.memory_mb.values()), default=0.0)
