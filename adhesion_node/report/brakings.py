# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A run split into its brakings, and what each of them shows: one row for each, as a report lists them."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core import Regime
from ..core.physics.train import KMH, Array
from ..run.score import CONVERGED_AFTER_MPS
from .run import Distances, Run
from .series import Series, Times

BRAKED_PA, RELEASED_NS = 20e3, 3_000_000_000
"""From this pressure on the brake works; it is released once it does not for so long, longer than a dump lasts."""

LEAST_LOST_MPS = 3.0 * KMH
"""What slows down less is no braking of which anything could be told."""

SLOWS_NS, SLOWS_MPS = 3_000_000_000, 0.6
"""Without a recorded pressure a train brakes that has lost so much speed in so long: no resistance does that."""


class Braking(NamedTuple):
    """From when to when the brake worked, and which estimates are of it: indices from `first` to `last`."""

    start_ns: int
    end_ns: int
    first: int
    last: int


def brakings(run: Run) -> list[Braking]:
    """Return the brakings in their order."""
    times, found = run.speed.t_ns, []
    braked_ns = _braked(run)
    parts = np.split(braked_ns, np.flatnonzero(np.diff(braked_ns) > RELEASED_NS) + 1)
    for part in parts if braked_ns.size else ():
        own = np.flatnonzero((times >= part[0]) & (times <= part[-1]))
        if own.size > 1 and np.ptp(np.abs(run.speed.values[own])) > LEAST_LOST_MPS:
            found.append(Braking(int(part[0]), int(part[-1]), int(own[0]), int(own[-1])))
    return found


def _braked(run: Run) -> Times:
    """The times at which the brake worked."""
    if run.pressure.t_ns.size:
        return np.asarray(run.pressure.t_ns[run.pressure.values >= BRAKED_PA])
    speed = run.speed.map(np.abs)
    slows = speed.at(speed.t_ns - SLOWS_NS) - speed.values > SLOWS_MPS
    return np.asarray(speed.t_ns[slows])


def exactly(series: Series, t_ns: Times) -> Array:
    """Values at those very times; NaN where there is none."""
    known = series.by_time()
    return np.array([float(known.get(t, np.nan)) for t in t_ns.tolist()])


def regimes_at(run: Run, t_ns: Times) -> NDArray[np.str_]:
    """Regimes of the estimates of those times by name; "" where none is recorded."""
    known = run.regime.by_time()
    return np.array([str(known.get(t, "")) for t in t_ns.tolist()])


def bound_kept(run: Run, first: int, last: int) -> NDArray[np.bool_]:
    """Whether the bound was no higher than the true adhesion, at those of these estimates that have both."""
    times = run.speed.t_ns[first : last + 1]
    if not run.true_mu.t_ns.size:
        return np.array([], dtype=bool)
    lower, true = exactly(run.mu_lower, times), run.true_mu.at(times)
    known = np.isfinite(lower) & np.isfinite(true)
    return np.asarray(lower[known] <= true[known] + 1e-9)


def rises(series: Series, start_ns: int, end_ns: int) -> list[int]:
    """Times within which a counter has risen."""
    counts = np.array([int(value) if str(value).isdigit() else 0 for value in series.values])
    times = series.t_ns[1:][np.diff(counts) > 0]
    return [int(t) for t in times if start_ns <= t <= end_ns]


def row_of(run: Run, braking: Braking, planned: Distances, true_m: Series, target_mps: float) -> dict[str, Any]:
    """What a braking shows; None for what it cannot tell.

    `saved_at_least_m` is what all bounds from the first identified estimate to the end of the braking leave of the way
    that the fixed worst case needs from there; where the true way is known, no more than that leaves.
    """
    own = slice(braking.first, braking.last + 1)
    times, speeds = run.speed.t_ns[own], np.abs(run.speed.values[own])
    regime, mu = regimes_at(run, times), exactly(run.mu, times)
    adhesion, brake = (
        (regime == each.name) & np.isfinite(mu) for each in (Regime.ADHESION_LIMITED, Regime.BRAKE_LIMITED)
    )
    kept, lower = bound_kept(run, braking.first, braking.last), exactly(run.mu_lower, times)
    row: dict[str, Any] = {
        "start_s": float(run.seconds(times)[0]),
        "end_s": float(run.seconds(times)[-1]),
        "place_m": float(run.position.values[braking.first]),
        "from_kmh": float(speeds[0] / KMH),
        "to_kmh": float(speeds[-1] / KMH),
        "adhesion_share": float(adhesion.mean()),
        "brake_share": float(brake.mean()),
        "mu_low": float(mu[adhesion].min()) if adhesion.any() else None,
        "mu_high": float(mu[adhesion].max()) if adhesion.any() else None,
        "mu_at_least": float(mu[brake].max()) if brake.any() else None,
        "mu_lower": float(lower[-1]) if np.isfinite(lower[-1]) else None,
        "bound_kept_percent": 100.0 * float(kept.mean()) if kept.size else None,
        "changes_s": run.seconds(np.array(rises(run.changes, int(times[0]), int(times[-1])), dtype=np.int64)).tolist(),
        **dict.fromkeys(("identified_at_kmh", "fixed_m", "saved_at_least_m")),
    }
    shown = np.flatnonzero(adhesion & (speeds < speeds[0] - CONVERGED_AFTER_MPS) & (speeds > target_mps))
    if shown.size:
        first = int(shown[0])
        place = np.abs(run.position.values[own] - run.position.values[own][first])
        needed = (place + planned.longest[own])[first:][speeds[first:] > target_mps]
        true_way = exactly(true_m, times[first : first + 1])[0]
        row |= {
            "identified_at_kmh": float(speeds[first] / KMH),
            "fixed_m": float(planned.fixed[own][first]),
            "saved_at_least_m": float(planned.fixed[own][first] - np.nanmax([*needed, true_way])),
        }
    return row
