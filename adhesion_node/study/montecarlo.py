"""Monte-Carlo runs on all cores, a chunk of seeds at a time; finished chunks stay in a cache.

A chunk is a pure function of its fields and of the code, both of which name its file. So the numbers do not depend
on the number of workers, and a study that was killed goes on with the chunks that are missing.
"""

from __future__ import annotations

import argparse
import hashlib
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from functools import cache as once
from multiprocessing.pool import IMapIterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_node import scenario as simulator

from ..core import Config
from .methods import METHODS, STARTS, Lane
from .runs import FIRST_SEED, simulate

CHUNK = 40
"""Seeds in a chunk: with five starts 200 runs side by side, which a processor's cache still holds."""

PROGRESS_S = 5.0
"""Time between two signs of life."""


class Chunk(NamedTuple):
    """Some runs of a scenario with one method, from every start; the last four fields are the estimator's."""

    scenario: str
    method: str
    sigma_m: float
    first_seed: int
    seeds: int
    window: int = 50
    step: int = 10
    particles: int = 20
    iterations: int = 50

    @property
    def config(self) -> Config:
        """The estimator's configuration, `start_mu` left open."""
        return Config(window=self.window, step=self.step, particles=self.particles, iterations=self.iterations)

    @property
    def weight(self) -> float:
        """How much work it is: the paper's method takes about six times as long as a Kalman filter."""
        return self.seeds * (6.0 if self.method == "particle_em" else 1.0)

    def file(self, folder: Path) -> Path:
        """Where the cache keeps this chunk; another name for every change of the code or of numpy."""
        text = f"{tuple(self)} {STARTS} {np.__version__} {_code()}"
        digest = hashlib.sha256(text.encode()).hexdigest()[:16]
        return folder / f"{self.scenario}-{self.method}-{self.first_seed}-{digest}.npz"


class Result(NamedTuple):
    """A chunk's rows: those of seed i from start j stand at index i * len(STARTS) + j."""

    chunk: Chunk
    rows: list[NDArray[np.void]]
    seconds: float
    """Computing time, in one process."""
    window_ms: NDArray[np.float64]


def add_running_options(parser: argparse.ArgumentParser) -> None:
    """Options of every study that runs chunks."""
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes (default: one per core)")
    parser.add_argument(
        "--cache",
        type=Path,
        metavar="DIR",
        default=Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "adhesion_node",
        help="where finished runs are kept, so that a killed study goes on (default %(default)s)",
    )


def chunks(scenario: str, method: str, sigma_m: float, runs: int, chunk: int = CHUNK) -> list[Chunk]:
    """Divide `runs` runs of a scenario into chunks."""
    return [
        Chunk(scenario, method, sigma_m, FIRST_SEED + first, min(chunk, runs - first))
        for first in range(0, runs, chunk)
    ]


def compute(chunk: Chunk) -> Result:
    """Simulate and estimate every run of a chunk."""
    started = time.perf_counter()
    lanes = [
        Lane(seed, start, simulated)
        for seed in range(chunk.first_seed, chunk.first_seed + chunk.seeds)
        for simulated in (simulate(chunk.scenario, seed, chunk.sigma_m),)
        for start in STARTS
    ]
    outcome = METHODS[chunk.method](chunk.config, lanes)
    return Result(chunk, outcome.rows, time.perf_counter() - started, np.array(outcome.window_ms))


def run_all(wanted: Sequence[Chunk], cache: Path, workers: int) -> Iterator[Result]:
    """Yield the results of all chunks in order, computing those that the cache lacks."""
    cache.mkdir(parents=True, exist_ok=True)
    missing = [chunk for chunk in wanted if not chunk.file(cache).exists()]
    if missing:
        with multiprocessing.get_context("spawn").Pool(min(workers, len(missing)), _be_a_worker) as pool:
            tasks = [(chunk, str(chunk.file(cache))) for chunk in missing]
            _report_progress(pool.imap_unordered(_compute_into, tasks), sum(chunk.weight for chunk in missing))
    for chunk in wanted:
        yield load(chunk, cache)


def load(chunk: Chunk, cache: Path) -> Result:
    """Read a chunk from the cache."""
    with np.load(chunk.file(cache)) as stored:
        rows = np.split(stored["rows"], stored["ends"][:-1])
        return Result(chunk, rows, float(stored["seconds"]), stored["window_ms"])


def save(result: Result, file: Path) -> None:
    """Write a chunk's file; it appears whole or not at all."""
    unfinished = file.with_suffix(f".{os.getpid()}")
    with unfinished.open("wb") as stream:
        np.savez_compressed(
            stream,
            rows=np.concatenate(result.rows),
            ends=np.cumsum([len(rows) for rows in result.rows]),
            seconds=np.array(result.seconds),
            window_ms=result.window_ms,
        )
    unfinished.replace(file)


def _compute_into(task: tuple[Chunk, str]) -> float:
    chunk, file = task
    save(compute(chunk), Path(file))
    return chunk.weight


def _be_a_worker() -> None:
    """Leave Ctrl-C to the parent, and the machine usable."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(5)


def _report_progress(done: IMapIterator[float], total: float) -> None:
    """Draw the bar on standard error, by the chunks' weights, until every chunk is done; short work stays silent."""
    started, finished = time.monotonic(), 0.0
    due = started + PROGRESS_S
    while finished < total:
        try:
            finished += done.next(timeout=max(due - time.monotonic(), 0.0))
        except multiprocessing.TimeoutError:
            due = time.monotonic() + PROGRESS_S
            spent, share = due - started, finished / total
            left = f"{spent / share - spent:.0f} s left" if share else f"{spent:.0f} s gone"
            print(f"[{'#' * round(30 * share):<30}] {share:4.0%}, {left}", file=sys.stderr)


@once
def _code() -> str:
    """Digest of the sources that a chunk's numbers come from."""
    here = Path(__file__).parent
    folders = (here.parent / "core", Path(simulator.__file__).parent)
    sources = [source for folder in folders for source in sorted(folder.glob("*.py"))]
    sources += [
        here / f"{name}.py" for name in ("batch", "batch_filter", "batch_particles", "lockstep", "methods", "runs")
    ]
    return hashlib.sha256(b"".join(source.read_bytes() for source in sources)).hexdigest()
