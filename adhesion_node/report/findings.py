# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""What a run shows, in numbers: how the adhesion was identified and what braking distance that saves."""

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from ..core import Config, Regime
from ..core.atp.supervision import Level
from ..core.physics.train import KMH, Train
from ..run.score import CONVERGED_AFTER_MPS, Point, Truth, mean_relative_error_percent
from ..run.seen import Seen
from .brakings import RELEASED_NS, bound_kept, brakings, rises, row_of
from .run import FIXED_MU, Distances, Run, distance_to_target
from .series import NONE, Series

BRAKES = (Level.SERVICE_BRAKE.name, Level.EMERGENCY_BRAKE.name)
"""Levels at which the ATP monitor brakes."""

AT_FIRST = ("identified_at_kmh", "mu", "mu_lower", "fixed_m", "saved_m", "saved_at_least_m")
"""Findings at the first estimate that counts as identified: speed, adhesion, braking distances."""


@lru_cache
def distances(run: Run, target_mps: float, train: Train) -> Distances:
    """Braking distances from the speed at each estimate to the target speed."""
    times = run.speed.t_ns
    return Distances(
        fixed=distance_to_target(run, FIXED_MU, target_mps, train),
        identified=distance_to_target(run, run.mu.at(times), target_mps, train, run.nominal),
        longest=distance_to_target(run, run.mu_lower.at(times), target_mps, train, run.safe),
    )


@lru_cache
def true_way(run: Run, target_mps: float) -> Series:
    """Way, m, that the train truly went from each moment of a braking until it had the target speed.

    Empty where the recording holds no truth or brake pressure, or the train never got there.
    """
    t_ns, place = run.true_position
    slow = run.true_speed.values <= target_mps
    if not (slow.any() and run.pressure.t_ns.size):
        return NONE
    parts = []
    for braking in brakings(run):
        begun = np.flatnonzero(t_ns >= braking.start_ns)
        reached = begun[slow[begun]]
        if reached.size and t_ns[reached[0]] <= braking.end_ns + RELEASED_NS:
            during = begun[begun <= reached[0]]
            parts.append((t_ns[during], np.abs(place[reached[0]] - place[during])))
    return Series(*(np.concatenate(column) for column in zip(*parts, strict=True))) if parts else NONE


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
    for t_ns, regime, mu, bound, speed, pressure_pa in zip(*(column.tolist() for column in columns), strict=True):
        seen.note(t_ns, regime, mu, bound, speed, None if math.isnan(pressure_pa) else pressure_pa)
    return seen.why_not()


def text_changes(series: Series) -> list[tuple[int, str]]:
    """Times and texts at which a series of texts changes, the first included; "" is left out."""
    rows = zip(series.t_ns.tolist(), map(str, series.values), ["", *map(str, series.values)], strict=False)
    return [(t_ns, text) for t_ns, text, before in rows if text not in ("", before)]


def dropped(counts: Mapping[str, str]) -> dict[str, int]:
    """Messages that were not used, by reason.

    >>> dropped({"windows": "65", "dropped.LATE": "2"})
    {'LATE': 2}
    """
    return {key.removeprefix("dropped."): int(value) for key, value in counts.items() if key.startswith("dropped.")}


def listed(counts: Mapping[str, int]) -> str:
    """Counts by reason in words.

    >>> listed({"LATE": 2, "OLD": 1})
    '2 LATE, 1 OLD'
    """
    return ", ".join(f"{count} {reason}" for reason, count in counts.items())


def _error(run: Run, config: Config) -> float | None:
    """The score of an offline replay; None where the recording holds no truth of the estimates' stamps."""
    if not run.true_mu.t_ns.size:
        return None
    pressure_pa = run.pressure.by_time()
    truth = Truth(mu=run.true_mu.by_time(), speed_mps=run.true_speed.by_time(), pressure_pa=pressure_pa)
    return mean_relative_error_percent(config, truth, [Point(*row) for row in run.mu.by_time().items()])
