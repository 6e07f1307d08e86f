# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a run shows, in numbers: how the adhesion was identified and what braking distance that saves."""

import math
from functools import lru_cache
from typing import Any

import numpy as np

from ...core import Config, Regime
from ...core.physics.train import KMH
from ...run.results.score import CONVERGED_AFTER_MPS, Point, Truth, mean_relative_error_percent
from ...run.results.seen import Seen
from ..read.numbers import dropped
from ..read.run import Run
from ..read.series import in_rows
from .braking_row import bound_kept, row_of
from .brakings import brakings, rises
from .distances import distances, true_way
from .events import BRAKES, text_changes

AT_FIRST = ("identified_at_kmh", "mu", "mu_lower", "fixed_m", "saved_m", "saved_at_least_m")
"""Findings at the first estimate that counts as identified: speed, adhesion, braking distances."""


def first_identified(run: Run) -> int | None:
    """Index of the first estimate of an adhesion that limits, after 30 km/h of braking; None where there is none."""
    speeds = np.abs(run.speed.values)
    slow = speeds < np.maximum.accumulate(speeds) - CONVERGED_AFTER_MPS
    shown = np.flatnonzero(slow & (run.regimes_at(run.speed.t_ns) == Regime.ADHESION_LIMITED.name))
    return int(shown[0]) if shown.size else None


@lru_cache
def findings(run: Run, config: Config, target_kmh: float) -> dict[str, Any]:
    """Return the findings by name; None where the run cannot tell.

    Those at the first identified estimate are of one moment; `brakings` has a row for each braking.
    """
    speeds = np.abs(run.speed.values) / KMH
    planned, target_mps = distances(run, target_kmh * KMH, config.train), target_kmh * KMH
    true_m, parts = true_way(run, target_mps), brakings(run)
    kept = np.concatenate([np.array([], bool), *(bound_kept(run, part.first, part.last) for part in parts)])
    start_ns, end_ns = int(run.speed.t_ns[0]), int(run.speed.t_ns[-1])
    found: dict[str, Any] = {
        "seconds": float(run.seconds(run.speed.t_ns)[-1]),
        "from_kmh": float(speeds.max()),
        "to_kmh": float(speeds[-1]),
        "mean_relative_error_percent": _error(run, config),
        "target_kmh": target_kmh,
        **dict.fromkeys(AT_FIRST),
        "dropped": dropped(run.counts),
        "why": why_not(run),
        "brakings": [row_of(run, part, planned, true_m, target_mps) for part in parts],
        "bound_kept_percent": 100.0 * float(kept.mean()) if kept.size else None,
        "bound_compared": int(kept.size),
        "changes_s": run.seconds(np.array(rises(run.changes, start_ns, end_ns), dtype=np.int64)).tolist(),
        "interventions": [
            {"s": float(run.seconds(np.array([t_ns]))[0]), "level": level}
            for t_ns, level in text_changes(run.levels)
            if level in BRAKES and t_ns >= start_ns
        ],
    }
    at = first_identified(run)
    if at is not None:
        time = run.speed.t_ns[at : at + 1]
        identified = (speeds[at], run.mu.at(time)[0], run.mu_lower.at(time)[0])
        lengths = (planned.fixed[at], planned.saved[at], planned.saved_at_least[at])
        found |= {name: float(value) for name, value in zip(AT_FIRST, (*identified, *lengths), strict=True)}
    return found


@lru_cache
def why_not(run: Run) -> str | None:
    """Why nothing is identified; None where something is."""
    seen, times = Seen(), run.speed.t_ns
    pressure = run.pressure.at(times) if run.pressure.t_ns.size else np.full(times.shape, np.nan)
    columns = times, run.regimes_at(times), run.mu.at(times), run.mu_lower.at(times), run.speed.values, pressure
    for t_ns, regime, mu, bound, speed, pressure_pa in in_rows(*columns):
        seen.note(t_ns, regime, mu, bound, speed, None if math.isnan(pressure_pa) else pressure_pa)
    return seen.why_not()


def _error(run: Run, config: Config) -> float | None:
    """The score of an offline replay; None where the truth does not tell it."""
    if not run.true_mu.t_ns.size:
        return None
    pressure_pa = run.pressure.by_time()
    mu, speed, limited = (series.by_time() for series in (run.true_mu, run.true_speed, run.true_limited))
    truth = Truth(mu, speed, pressure_pa, limited)
    return mean_relative_error_percent(config, truth, [Point(*row) for row in run.mu.by_time().items()])
