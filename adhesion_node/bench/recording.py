# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A long recording through the offline replay: its time, what reading alone takes of it, and its memory."""

import time
from array import array
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..bag import BagReader, BagWriter
from ..bag.types import encode
from ..command.options import progress
from ..core.config import Config
from ..run.offline import Recorded, messages, predictions
from ..run.pipeline import Pipeline
from ..wire.codecs import ATMOSPHERE_PA, NOMINAL
from ..wire.topics import BRAKE_PRESSURE, POSITION
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
            for _ in messages(reader, selection):
                pass
            reading_s = time.process_time() - started
            pipeline, filled = Pipeline(Config(), seed), list[float]()
            wall, started = time.perf_counter(), time.process_time()
            recorded = _watched(messages(reader, selection), 2 * total, filled)
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


def _write(bag: Path, total: int, rate_hz: float, seed: int) -> None:
    with BagWriter(bag) as writer:
        samples = islice(journey(rate_hz, np.random.default_rng(seed)), total)
        for pressure, at in progress(samples, "positions written", total):
            absolute = encode(BRAKE_PRESSURE, pressure.t_ns, (pressure.pressure_pa + ATMOSPHERE_PA,))
            writer.write(BRAKE_PRESSURE.name, BRAKE_PRESSURE.type, absolute, pressure.t_ns)
            place = encode(POSITION, at.t_ns, (at.position_m,), at.variance_m2)
            writer.write(POSITION.name, POSITION.type, place, at.t_ns)
