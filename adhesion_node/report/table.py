"""A small table of a recorded run: what was identified at a few speeds, and the braking distances that follow."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..core.train import CRH3, KMH, Train
from .run import FIXED_MU, Run, distance_to_target

ROWS = 6
"""Rows at most, evenly spread over the speeds of the braking."""

HEADER = (
    "                adhesion coefficient        braking distance to {target:.0f} km/h, m\n"
    "     km/h   true identified  at least    true identified  at least  fixed {fixed}"
)


def table(run: Run, target_kmh: float, train: Train = CRH3) -> str:
    """The table as text; columns of the truth stay empty where the recording holds none."""
    lines = [HEADER.format(target=target_kmh, fixed=FIXED_MU)]
    return "\n".join([*lines, *_rows(run, target_kmh * KMH, train)])


def _rows(run: Run, target_mps: float, train: Train) -> Iterator[str]:
    braking = run.speed.values < run.speed.values.max() - 10.0 * KMH
    shown = np.flatnonzero(braking & (run.speed.values > target_mps + 10.0 * KMH))
    if shown.size > ROWS:
        shown = shown[np.linspace(0, shown.size - 1, ROWS).round().astype(int)]
    mu, lower = run.mu.at(run.speed.t_ns), run.mu_lower.at(run.speed.t_ns)
    distances = [distance_to_target(run, value, target_mps, train) for value in (mu, lower, FIXED_MU)]
    for i in shown:
        true_mu, left = _truth(run, int(run.speed.t_ns[i]), target_mps)
        planned = "".join(f"{column[i]:10.0f}" for column in distances)
        yield f"{run.speed.values[i] / KMH:9.0f} {true_mu:>6} {mu[i]:10.4f} {lower[i]:9.4f} {left:>7} {planned}"


def _truth(run: Run, t_ns: int, target_mps: float) -> tuple[str, str]:
    """True adhesion at a time, and the distance that the train then went until it had the target speed."""
    slow = np.flatnonzero(run.true_speed.values <= target_mps)
    if not run.true_mu.t_ns.size or not slow.size:
        return "", ""
    now = np.array([t_ns])
    left = run.true_position.values[slow[0]] - run.true_position.at(now)[0]
    return f"{run.true_mu.at(now)[0]:.4f}", f"{left:.0f}"
