# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Start a node, send it signals at a random moment, and look at what it leaves behind.

    python test/start_stop.py 100       # so many tries; exit code 1 when one of them was not clean

The moments lie between the first line of the program, before it imports anything heavy, and well into its work.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO

ROOT = Path(__file__).resolve().parent.parent
PRIVATE = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH")
"""What the wheels' bootstrap leaves behind; a child would take itself for set up already."""

LATEST_S = 4.0
END_S = 90.0

BURSTS = ((signal.SIGINT,), (signal.SIGTERM,), (signal.SIGINT, signal.SIGINT), (signal.SIGTERM, signal.SIGINT))
NODES = ("estimator", "recorder", "atp_monitor", "simulator", "creep_estimator", "live")


@dataclass(frozen=True, slots=True)
class Ending:
    """How a try ended; `fault` is empty when it was clean."""

    node: str
    delay_s: float
    burst: str
    fault: str


def start(node: str, *arguments: str, said: int | IO[str] = subprocess.PIPE) -> subprocess.Popen[str]:
    """Start a node and wait for its first line, which comes before its imports; `said` is where its log goes."""
    code = f"import sys; from adhesion_node.main import {node}; print('up', flush=True); sys.exit({node}())"
    environment = {name: value for name, value in os.environ.items() if name not in PRIVATE}
    environment["PYTHONPATH"] = str(ROOT)
    program = subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=said,
        text=True,
    )
    assert program.stdout is not None
    program.stdout.readline()
    return program


def attempt(rng: random.Random, folder: Path) -> Ending:
    """Make one try."""
    node, burst = rng.choice(NODES), rng.choice(BURSTS)
    delay_s = rng.uniform(0.005, LATEST_S)
    bag = folder / f"bag_{rng.getrandbits(40):x}"
    own = {"recorder": ("--output", str(bag)), "live": ("--port", "0")}
    program = start(node, *own.get(node, ()))
    time.sleep(delay_s)  # the moment itself is what is tried
    for number in burst:
        program.send_signal(number)
        time.sleep(rng.uniform(0.0, 0.05))
    try:
        _, said = program.communicate(timeout=END_S)
    except subprocess.TimeoutExpired:
        program.kill()
        return Ending(node, delay_s, names(burst), f"still running after {END_S:g} s")
    finally:
        program.kill()
        program.wait()
    return Ending(node, delay_s, names(burst), fault_of(program.returncode, said, bag))


def fault_of(code: int, said: str, bag: Path) -> str:
    """Say what is wrong with an ending; nothing where it is clean."""
    if code != 0:
        return f"exit code {code}: {said[-300:]}"
    complaints = [line for line in said.splitlines() if not line.startswith("[")]  # the log begins every line so
    if complaints:
        return f"said {complaints}"
    if bag.exists() and not (bag / "metadata.yaml").is_file():
        return f"{bag.name} has no metadata.yaml"
    return ""


def names(burst: tuple[signal.Signals, ...]) -> str:
    """Return the names of signals."""
    return "+".join(number.name for number in burst)


def tries(count: int, seed: int) -> list[Ending]:
    """Make so many tries, on every core one at a time, beside a simulator that keeps them busy."""
    moments = [random.Random(f"{seed} {number}") for number in range(count)]
    with tempfile.TemporaryDirectory() as folder:
        busy = start("simulator", "--ros-args", "-p", "scenario:=long_braking", "-p", "exit_at_end:=false")
        try:
            with ThreadPoolExecutor(os.cpu_count()) as pool:
                return list(pool.map(partial(attempt, folder=Path(folder)), moments))
        finally:
            busy.kill()
            busy.communicate()


def main(arguments: list[str]) -> int:
    """Make the tries and print the endings that were not clean."""
    count = int(arguments[0]) if arguments else 100
    endings = tries(count, seed=1)
    faults = [ending for ending in endings if ending.fault]
    for ending in faults:
        print(ending)
    print(f"{count} tries, {len(faults)} not clean")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
