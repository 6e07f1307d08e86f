# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""`step` on the way that live node and replay share: latency in steady braking, headroom at 100 Hz, memory."""

import time
from collections.abc import Iterable
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ..command.options import progress
from ..core.config import Config
from ..core.intake.samples import PositionSample, PressureSample
from ..run.pipeline import Pipeline
from .scene import journey
from .timing import figures

CONFIG = replace(Config(), window=50, step=5)

STEADY_S = 5.0
"""After the brake is applied: a full window at 10 Hz."""

FILLED_SHARE = 0.2
"""Part of a long run after which everything that is to be allocated has been."""


def latency(rate_hz: float, rounds: int, seed: int, estimate_s: float = CONFIG.estimate_s) -> dict[str, Any]:
    """What a sample takes in steady braking, and how many of them a second of CPU would bear."""
    config = replace(CONFIG, estimate_s=estimate_s)
    journeys = (journey(rate_hz, np.random.default_rng([seed, turn])) for turn in range(rounds))
    wall, cpu = zip(*(took for samples in journeys for took in _in_steady_braking(config, samples)), strict=True)
    per_second = 1.0 / float(np.mean(cpu))
    return {
        "rate_hz": rate_hz,
        "estimate_s": estimate_s,
        **figures(wall),
        "cpu_p99_ms": figures(cpu)["p99_ms"],
        "samples_per_cpu_second": per_second,
        "headroom": per_second / rate_hz,
        "core_percent": 100.0 * rate_hz / per_second,
    }


def _in_steady_braking(
    config: Config, samples: Iterable[tuple[PressureSample, PositionSample]]
) -> list[tuple[float, float]]:
    """Seconds by the clock and of the processor for each sample of the first braking, from `STEADY_S` on to its end."""
    pipeline, steady_ns, took = Pipeline(config, seed=1), None, list[tuple[float, float]]()
    for pressure, position in samples:
        braked = pressure.pressure_pa > 0.0
        if braked and steady_ns is None:
            steady_ns = pressure.t_ns + round(STEADY_S * 1e9)
        if steady_ns is not None and not braked:
            break
        wall, cpu = time.perf_counter(), time.process_time()
        pipeline.push(pressure)
        pipeline.push(position)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        if steady_ns is not None and pressure.t_ns >= steady_ns:
            took.append((wall, cpu))
    return took


def memory(minutes: float, rate_hz: float, seed: int) -> dict[str, Any]:
    """Resident memory over a long journey of cruising and braking."""
    total = round(60.0 * minutes * rate_hz)
    pipeline, filled_mb = Pipeline(CONFIG, seed=1), 0.0
    samples = islice(journey(rate_hz, np.random.default_rng(seed)), total)
    for count, pair in enumerate(progress(samples, "samples", total)):
        if count == int(FILLED_SHARE * total):
            filled_mb = resident_mb()
        for sample in pair:
            pipeline.push(sample)
    end_mb = resident_mb()
    return {
        "minutes": minutes,
        "windows": pipeline.windows,
        "filled_mb": filled_mb,
        "end_mb": end_mb,
        "growth_mb": end_mb - filled_mb,
    }


def resident_mb(of: str = "VmRSS") -> float:
    """Resident memory of this process as Linux tells it, MB; of "VmHWM" the most that it ever was."""
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines())
    return float(status[of].split()[0]) / 1024.0
