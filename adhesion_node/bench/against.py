# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The default method beside that of another revision, which is checked out for the time of the measurement.

Both follow the same measurements, in turns, each in a process of its own, through the public `init` and `step`.

Three ratios, as the methods differ in when they work: a method of windows updates what it believes of the adhesion with
each of its estimates, every L measurements; the bank with every measurement, and tells an estimate every `estimate_s`.
"""

import json
import math
import os
import subprocess
import sys
import tarfile
from collections.abc import Sequence
from io import BytesIO
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..command.options import progress
from .scene import SIGMA_M, journey

ROOT = Path(__file__).resolve().parents[2]

SECONDS = 120.0
"""Of a journey that cruises for 20 s and then brakes."""

FOLLOW = """
import json, sys, time
from adhesion_node.core import Config, Measurement, init, step
config = Config()
rows = [Measurement(t_ns, place, variance, pressure) for t_ns, place, variance, pressure in json.load(sys.stdin)]
for _ in range(2):  # once to warm up
    state, took, updates, estimates = init(config, 1), 0.0, 0, 0
    for row in rows:
        started = time.process_time()
        before, (state, estimate) = getattr(state, "memory", None), step(config, state, row)
        if row.brake_pressure_pa:
            took += time.process_time() - started
            estimates += estimate is not None
            updates += estimate is not None if before is None else state.memory.bank is not before.bank
print(json.dumps([1e3 * took, sum(row.brake_pressure_pa > 0.0 for row in rows), updates, estimates]))
"""
"""Processor time, ms, of the measurements under the brake; their number, and those of updates and of estimates."""

PER = ("measurement", "update", "estimate")


def compare(revision: str, rounds: int, rate_hz: float, seed: int) -> list[dict[str, Any]]:
    """Rows of the table: this tree and the revision. Raises ValueError where that is not to be had."""
    samples = list(islice(journey(rate_hz, np.random.default_rng(seed)), round(SECONDS * rate_hz)))
    given = json.dumps([(at.t_ns, at.position_m, SIGMA_M**2, braked.pressure_pa) for braked, at in samples])
    with TemporaryDirectory(prefix="adhesion_bench_") as folder:
        _check_out(revision, folder)
        trees = {"this tree": str(ROOT), revision: folder}
        found: dict[str, list[Sequence[float]]] = {name: [] for name in trees}
        for _ in progress(range(rounds), "rounds", rounds):
            for name, tree in trees.items():
                found[name].append(_followed(tree, given))
    medians = {name: np.median(rows, axis=0) for name, rows in found.items()}
    ours = _per(*medians["this tree"])
    rows = []
    for name, (took, *counts) in medians.items():
        per = _per(took, *counts)
        ms = {f"ms_per_{what}": each for what, each in zip(PER, per, strict=True)}
        ratios = {f"ratio_{what}": each / own for what, each, own in zip(PER, per, ours, strict=True)}
        rows.append({"revision": name, "rounds": rounds, "updates": int(counts[1]), **ms, **ratios})
    return rows


def _per(took_ms: float, *counts: float) -> list[float]:
    """ms for each of what was counted; NaN where there was none."""
    return [float(took_ms / count) if count else math.nan for count in counts]


def _check_out(revision: str, folder: str) -> None:
    packed = subprocess.run(["git", "-C", str(ROOT), "archive", revision], capture_output=True, check=False)
    if packed.returncode:
        why = packed.stderr.decode().strip().splitlines()[-1]
        raise ValueError(f"against = {revision!r}: {why}; give a revision, and run bench in a clone")
    with tarfile.open(fileobj=BytesIO(packed.stdout)) as archive:
        archive.extractall(folder, filter="data")


def _followed(tree: str, given: str) -> Sequence[float]:
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    run = subprocess.run(
        [sys.executable, "-c", FOLLOW],
        input=given,
        cwd=tree,  # of `python -c` it is the first place that modules are looked for
        env={**os.environ, **one_thread, "PYTHONPATH": tree},
        capture_output=True,
        text=True,
        check=False,
    )
    if run.returncode:
        raise ValueError(f"against: {tree} does not run here: {run.stderr.strip().splitlines()[-1]}")
    result: Sequence[float] = json.loads(run.stdout)
    return result
