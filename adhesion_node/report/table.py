# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0

"""A small table of a recorded run: what was identified at a few speeds, and the braking distances that follow."""

from collections.abc import Iterator

import numpy as np

from ..core.physics.train import CRH3, KMH, Train
from .findings import distances
from .run import FIXED_MU, Run

ROWS = 6
"""Rows at most, evenly spread over the speeds of the braking."""

HEADER = (
    "                adhesion coefficient        braking distance to {target:.0f} km/h, m\n"
    "     km/h   true identified  at least    true identified  at least  fixed {fixed}"
)

FORMS = ("{:.0f}", "{:.4f}", "{:.4f}", "{:.4f}", "{:.0f}", "{:.0f}", "{:.0f}", "{:.0f}")
WIDTHS = (9, 7, 11, 10, 8, 11, 10, 10)
"""How the columns are written: speed, the true, the identified and the least adhesion, the distances by each, fixed."""


def rows(run: Run, target_kmh: float, train: Train = CRH3, absent: str = "") -> Iterator[list[str]]:
    """Yield rows as texts, from 10 km/h below the highest speed before down to 10 km/h above the target.

    `absent` stands for the truth where the recording lacks it.
    """
    speeds, target_mps = run.speed.values, target_kmh * KMH
    shown = np.flatnonzero((speeds < np.maximum.accumulate(speeds) - 10.0 * KMH) & (speeds > target_mps + 10.0 * KMH))
    if shown.size > ROWS:
        shown = shown[np.linspace(0, shown.size - 1, ROWS).round().astype(int)]
    mu, lower = run.mu.at(run.speed.t_ns), run.mu_lower.at(run.speed.t_ns)
    planned = distances(run, target_mps, train)
    for i in shown:
        true_mu, true_m = _truth(run, int(run.speed.t_ns[i]), target_mps)
        lengths = (float(column[i]) for column in (planned.identified, planned.longest, planned.fixed))
        row = (float(speeds[i]) / KMH, true_mu, float(mu[i]), float(lower[i]), true_m, *lengths)
        yield [absent if value is None else form.format(value) for form, value in zip(FORMS, row, strict=True)]


def table(run: Run, target_kmh: float, train: Train = CRH3) -> str:
    """The table as text; columns of the truth stay empty where the recording holds none."""
    lines = (map(str.rjust, row, WIDTHS) for row in rows(run, target_kmh, train))
    return "\n".join([HEADER.format(target=target_kmh, fixed=FIXED_MU), *map("".join, lines)])


def _truth(run: Run, t_ns: int, target_mps: float) -> tuple[float | None, float | None]:
    """True adhesion at a time, and the distance that the train then went until it had the target speed."""
    now = np.array([t_ns])
    slow = np.flatnonzero(run.true_speed.values <= target_mps)
    if not run.true_mu.t_ns.size or not slow.size:
        return None, None
    left = run.true_position.values[slow[0]] - run.true_position.at(now)[0]
    return float(run.true_mu.at(now)[0]), float(left)
