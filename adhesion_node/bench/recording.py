# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A long recording through the offline replay and the report: time, what reading or estimating takes of it, memory."""

import time
from array import array
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..bag import BagReader, BagWriter
from ..bag.types import encode, new, serialize
from ..command.options import progress
from ..core import Prediction
from ..core.config import Config
from ..core.estimator import warm_up
from ..run.offline import Recorded, messages, predictions
from ..run.pipeline import Pipeline
from ..run.results.rows import row_of
from ..wire.line import ATMOSPHERE_PA, NOMINAL
from ..wire.messages.results import Status
from ..wire.topics import BRAKE_PRESSURE, DIAGNOSTICS, POSITION, RESULTS
from .scene import journey
from .step import FILLED_SHARE, resident_mb


def replay(hours: float, rate_hz: float, seed: int) -> dict[str, Any]:
    """Seconds of clock and processor, and memory, of a replay of positions and pressures of so many hours."""
    total = round(3600.0 * hours * rate_hz)
    with TemporaryDirectory(prefix="adhesion_bench_") as folder:
        bag = Path(folder) / "bag"
        _write(bag, total, rate_hz, seed)
        with BagReader(bag) as reader:
            selection = {name: name for name in reader.topics}
            started = time.process_time()
            for _ in messages(reader, selection, NOMINAL):
                pass
            reading_s = time.process_time() - started
            pipeline, filled = Pipeline(Config(), seed), list[float]()
            warm_up(Config())  # machine code is loaded once, however long a recording is
            wall, started = time.perf_counter(), time.process_time()
            recorded = _watched(messages(reader, selection, NOMINAL), 2 * total, filled)
            for _ in predictions(pipeline, None, recorded, NOMINAL, array("d")):
                pass
            took_s, wall_s = time.process_time() - started, time.perf_counter() - wall
    return {
        "hours": hours,
        "positions": pipeline.measurements,
        "seconds": wall_s,
        "cpu_seconds": took_s,
        "cpu_seconds_per_10h": took_s * 10.0 / hours,
        "of_it_reading": reading_s / took_s,
        "growth_mb": resident_mb() - filled[0],
    }


def _watched(recorded: Iterator[Recorded], total: int, filled: list[float]) -> Iterator[Recorded]:
    """Pass on, and note the memory once everything that is to be allocated has been."""
    for count, one in enumerate(progress(recorded, "messages", total)):
        if count == int(FILLED_SHARE * total):
            filled.append(resident_mb())
        yield one


def report(hours: float, rate_hz: float, seed: int) -> list[dict[str, Any]]:
    """Processor time and peak memory of the report of such a recording, with the estimator's results and without."""
    total, rows, estimating_s = round(3600.0 * hours * rate_hz), list[dict[str, Any]](), 0.0
    with TemporaryDirectory(prefix="adhesion_bench_") as folder:
        for holds, pipeline in (("results", Pipeline(Config(), seed)), ("sensors", None)):
            bag = Path(folder) / holds
            took_s = _write(bag, total, rate_hz, seed, pipeline)
            with ProcessPoolExecutor(1, get_context("spawn")) as alone:
                cpu_s, peak_mb = alone.submit(_reported, bag, Path(folder) / f"{holds}_report").result()
            beside_s = cpu_s - estimating_s
            estimating_s += took_s
            rows.append(
                {
                    "holds": holds,
                    "hours": hours,
                    "cpu_seconds": cpu_s,
                    "beside_estimating": beside_s,
                    "peak_mb": peak_mb,
                }
            )
    return rows


def _reported(bag: Path, output: Path) -> tuple[float, float]:
    """Processor time, s, and peak memory, MB, of a process that does nothing else, its imports included."""
    from ..report.__main__ import main

    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        main([str(bag), "--output", str(output)])
    return time.process_time(), resident_mb("VmHWM")


def _write(bag: Path, total: int, rate_hz: float, seed: int, pipeline: Pipeline | None = None) -> float:
    """Record positions and pressures, and what a pipeline makes of them; return how long that takes it, s."""
    took_s = 0.0
    with BagWriter(bag) as writer:
        samples = islice(journey(rate_hz, np.random.default_rng(seed)), total)
        for pressure, at in progress(samples, "positions written", total):
            absolute = encode(BRAKE_PRESSURE, pressure.t_ns, (pressure.pressure_pa + ATMOSPHERE_PA,))
            writer.write(BRAKE_PRESSURE.name, BRAKE_PRESSURE.type, absolute, pressure.t_ns)
            place = encode(POSITION, at.t_ns, (at.position_m,), at.variance_m2)
            writer.write(POSITION.name, POSITION.type, place, at.t_ns)
            if pipeline is not None:
                started = time.process_time()
                made = [*pipeline.push(pressure), *pipeline.push(at)]
                took_s += time.process_time() - started
                _write_results(writer, pipeline, made)
    return took_s


def _write_results(writer: BagWriter, pipeline: Pipeline, made: Iterable[Prediction]) -> None:
    """Record predictions as the node publishes them, all at their stamps."""
    for prediction in made:
        e = prediction.estimate
        told = {"stamp_ns": str(e.t_ns), "window": str(e.window), "changes": str(e.changes)}
        told |= {name: f"{value}" for name, value in row_of(pipeline, prediction).items()}
        status = Status("estimator", 0, e.regime.value, told)
        values = [(topic, (prediction,)) for topic in RESULTS]
        for topic, value in [*values, (DIAGNOSTICS, (e.t_ns, status))]:
            message = topic.build(new, *value)
            if message is not None:
                writer.write(topic.name, topic.type, serialize(message, topic.type), e.t_ns)
