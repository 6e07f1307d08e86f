# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""What a run shows, in numbers: how the adhesion was identified and what braking distance that saves."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..core import Config, Regime
from ..core.physics.train import KMH, Array, Train
from ..run.score import CONVERGED_AFTER_MPS, Point, Truth, mean_relative_error_percent
from ..run.seen import Seen
from .run import FIXED_MU, Run, distance_to_target
from .series import NONE, Series

BRAKED_PA, RELEASED_NS = 20e3, 3_000_000_000
"""From this pressure on the brake works; it is released once it does not for so long, longer than a dump lasts."""

AT_FIRST = ("identified_at_kmh", "mu", "mu_lower", "fixed_m", "saved_m", "saved_at_least_m")
"""Findings at the first estimate that counts as identified: speed, adhesion, braking distances."""


class Distances(NamedTuple):
    """Braking distances, m, at every estimate; arrays of the estimates' shape."""

    fixed: Array
    """By the fixed worst case, on a level track."""
    identified: Array
    """By the nominal curves."""
    longest: Array
    """By the safe curves: not exceeded, with the confidence of the bound."""

    @property
    def saved(self) -> Array:
        """Saved by the identified adhesion against the fixed one; negative where it is lower."""
        return self.fixed - self.identified

    @property
    def saved_at_least(self) -> Array:
        """Saved at least, with the confidence of the bound."""
        return self.fixed - self.longest


def distances(run: Run, target_mps: float, train: Train) -> Distances:
    """Braking distances from the speed at each estimate to the target speed."""
    times = run.speed.t_ns
    return Distances(
        fixed=distance_to_target(run, FIXED_MU, target_mps, train),
        identified=distance_to_target(run, run.mu.at(times), target_mps, train, run.nominal),
        longest=distance_to_target(run, run.mu_lower.at(times), target_mps, train, run.safe),
    )


def true_way(run: Run, target_mps: float) -> Series:
    """Way, m, that the train truly went from each moment of its last braking until it had the target speed.

    Empty where the recording holds no truth or the train did not get there.
    """
    slow = np.flatnonzero(run.true_speed.values <= target_mps)
    if not slow.size:
        return NONE
    t_ns, place = run.true_position
    braked_ns = run.pressure.t_ns[(run.pressure.values >= BRAKED_PA) & (run.pressure.t_ns < t_ns[slow[0]])]
    if not braked_ns.size:
        return NONE
    releases = np.flatnonzero(np.diff(braked_ns) > RELEASED_NS)
    during = (t_ns >= braked_ns[releases[-1] + 1 if releases.size else 0]) & (np.arange(t_ns.size) <= slow[0])
    return Series(t_ns[during], place[slow[0]] - place[during])


def first_identified(run: Run) -> int | None:
    """Index of the first estimate of an adhesion that limits, after 30 km/h of braking; None where there is none."""
    regimes = run.regime.by_time()
    speeds = np.abs(run.speed.values)
    slow = speeds < np.maximum.accumulate(speeds) - CONVERGED_AFTER_MPS
    shown = (i for i in np.flatnonzero(slow) if regimes.get(int(run.speed.t_ns[i])) == Regime.ADHESION_LIMITED.name)
    return next((int(i) for i in shown), None)


def findings(run: Run, config: Config, target_kmh: float) -> dict[str, Any]:
    """Return the findings by name; None where the run cannot tell."""
    speeds = np.abs(run.speed.values) / KMH
    found: dict[str, Any] = {
        "seconds": float(run.seconds(run.speed.t_ns)[-1]),
        "from_kmh": float(speeds.max()),
        "to_kmh": float(speeds[-1]),
        "mean_relative_error_percent": _error(run, config),
        "target_kmh": target_kmh,
        **dict.fromkeys(AT_FIRST),
        "dropped": dropped(run.counts),
        "why": why_not(run),
    }
    at = first_identified(run)
    if at is not None:
        planned = distances(run, target_kmh * KMH, config.train)
        time = run.speed.t_ns[at : at + 1]
        identified = (speeds[at], run.mu.at(time)[0], run.mu_lower.at(time)[0])
        lengths = (planned.fixed[at], planned.saved[at], planned.saved_at_least[at])
        found |= {name: float(value) for name, value in zip(AT_FIRST, (*identified, *lengths), strict=True)}
    return found


def why_not(run: Run) -> str | None:
    """Why nothing is identified; None where something is."""
    seen, regimes, times = Seen(), run.regime.by_time(), run.speed.t_ns
    pressure = run.pressure.at(times) if run.pressure.t_ns.size else np.full(times.shape, np.nan)
    columns = times, run.mu.at(times), run.mu_lower.at(times), run.speed.values, pressure
    for t_ns, mu, bound, speed, pressure_pa in zip(*(column.tolist() for column in columns), strict=True):
        known_pa = None if np.isnan(pressure_pa) else pressure_pa
        seen.note(t_ns, regimes.get(t_ns, ""), mu, bound, speed, known_pa)
    return seen.why_not()


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
    pressure_pa = run.pressure.by_time()
    truth = Truth(mu=run.true_mu.by_time(), speed_mps=run.true_speed.by_time(), pressure_pa=pressure_pa)
    return mean_relative_error_percent(config, truth, [Point(*row) for row in run.mu.by_time().items()])
