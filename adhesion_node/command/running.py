# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""Runs the tasks that the cache lacks, with a progress bar; the numbers do not depend on where they are computed.

A task is a pure function of its fields and of the code, which name its file in the cache. So a study that was killed
goes on with the tasks that are missing, and a change of the code, of a setting or of numpy finds no stale numbers.
"""

import argparse
import hashlib
import os
import socket
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from functools import cache as once
from pathlib import Path
from typing import Any, NamedTuple, Protocol
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from . import engines
from .checks import at_least, refuse
from .signals import stop_on_signals

Arrays = Mapping[str, NDArray[Any]]
"""A task's result by name."""

CACHE = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")) / "adhesion_node"
"""Where finished runs are kept unless another folder is named; below "~" where no home is known."""

PACKAGES = Path(__file__).parents[2]
"""The folder that holds the packages."""

SOURCES = ("adhesion_node/**/*.py", "sim_node/**/*.py")
"""Where the numbers of a task come from, below `PACKAGES`."""

PROGRESS_S = 5.0
"""Time between two signs of life."""

LISTEN_S = 0.5
"""Longest time until a Ctrl-C or SIGTERM is minded."""


class Task(Protocol):
    """Some work; its `repr` names every field that its result depends on."""

    @property
    def name(self) -> str:
        """Readable beginning of the file's name."""

    @property
    def weight(self) -> float:
        """How much work it is beside the other tasks of its call."""

    def compute(self) -> Arrays:
        """Do the work."""


class Running(NamedTuple):
    """Where tasks are computed and kept."""

    cache: Path
    workers: int = 1
    scheduler: str | None = None
    """Address of a Dask scheduler; takes the place of the workers."""


def add_running_options(parser: argparse.ArgumentParser) -> None:
    """Options of every program that runs tasks; `running` reads them."""
    parser.add_argument("--workers", type=int, help="processes (default: one per core)")
    parser.add_argument(
        "--scheduler", metavar="ADDRESS", help="compute on the Dask cluster of tcp://HOST:PORT instead (extra cluster)"
    )
    parser.add_argument(
        "--cache",
        type=Path,
        metavar="DIR",
        help=f"where finished runs are kept, so that a killed call goes on (default: {CACHE})",
    )


def running(options: argparse.Namespace) -> Running:
    """Read the options of `add_running_options`. Raises ValueError naming a bad one."""
    at_least(options, workers=1)
    if options.cache is None and CACHE.parts[0] == "~":
        raise ValueError("cache: no home folder is known to keep finished runs in: name one with --cache DIR")
    if options.scheduler:
        refuse(options, ["workers"], "the cluster of --scheduler has its own: leave the one or the other out")
    return Running(options.cache or CACHE, options.workers or os.cpu_count() or 1, options.scheduler)


def run_all(wanted: Sequence[Task], where: Running, *, as_given: bool = False) -> Iterator[Arrays]:
    """Yield the results of all tasks in order; compute those that the cache lacks, heavy ones first or `as_given`."""
    by_file = {file_name(task): task for task in wanted}
    missing = [task for file, task in by_file.items() if not _is_kept(where.cache / file)]
    if missing:
        _require_room(where.cache)
        _compute_all(missing if as_given else sorted(missing, key=lambda task: -task.weight), where)
    for task in wanted:
        yield load(task, where.cache)


def _require_room(cache: Path) -> None:
    """Raise ValueError where finished runs cannot be kept."""
    try:
        cache.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=cache).close()
    except OSError as error:
        remedy = "name a place for finished runs with --cache"
        raise ValueError(f"cache = {cache}: {error.strerror}: {remedy}") from error


def _compute_all(missing: Sequence[Task], where: Running) -> None:
    """Compute tasks into the cache, and draw the bar on standard error, by weights; short work stays silent."""
    workers = min(where.workers, len(missing))
    engine = engines.cluster(where.scheduler) if where.scheduler else engines.processes(workers)
    # a signal is noted, not raised anywhere: within a lock of the executor it would be lost, or hold the lock
    with stop_on_signals(leaving=False) as stop, engine as executor:
        futures = {executor.submit(_compute, task, file_name(task)): task for task in missing}
        started, finished, total = time.monotonic(), 0.0, sum(task.weight for task in missing)
        due = started + PROGRESS_S
        while futures:
            for future in wait(futures, min(max(due - time.monotonic(), 0.0), LISTEN_S), FIRST_COMPLETED).done:
                task = futures.pop(future)
                save(task, future.result(), where.cache)
                finished += task.weight
            if stop.requested:
                raise KeyboardInterrupt
            if time.monotonic() >= due:
                due = time.monotonic() + PROGRESS_S
                _draw_bar(finished / total, time.monotonic() - started)


def _draw_bar(share: float, spent_s: float) -> None:
    left = f"{spent_s / share - spent_s:.0f} s left" if share else f"{spent_s:.0f} s gone"
    print(f"[{'#' * round(30 * share):<30}] {share:4.0%}, {left}", file=sys.stderr)


def _compute(task: Task, file: str) -> Arrays:
    """Compute a task where its numbers will be those of `file`."""
    if file_name(task) != file:
        raise RuntimeError(f"{socket.gethostname()} has another version of this package or of numpy")
    return task.compute()


def file_name(task: Task) -> str:
    """Name of the task's file in the cache."""
    text = f"{task!r} {np.__version__} {_code(PACKAGES)}"
    return f"{task.name}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.npz"


def _is_kept(file: Path) -> bool:
    """Whether a run is there; one that is cut, as by a power cut, is not."""
    try:
        with file.open("rb") as stream, np.load(stream):
            return True
    except (OSError, EOFError, ValueError, BadZipFile):
        return False


def load(task: Task, cache: Path) -> dict[str, NDArray[Any]]:
    """Read a task's result from the cache."""
    with np.load(cache / file_name(task)) as stored:
        return dict(stored)


def save(task: Task, result: Arrays, cache: Path) -> None:
    """Write a task's file; it appears whole or not at all."""
    file = cache / file_name(task)
    arrays: dict[str, Any] = dict(result)
    unfinished = file.with_suffix(f".{os.getpid()}")
    with unfinished.open("wb") as stream:
        np.savez_compressed(stream, **arrays)
        os.fsync(stream.fileno())
    unfinished.replace(file)


@once
def _code(packages: Path) -> str:
    """Digest of the sources."""
    sources = [source for pattern in SOURCES for source in sorted(packages.glob(pattern))]
    return hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()
