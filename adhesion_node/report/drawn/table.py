# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""A small table of a recorded run: what was identified at a few speeds, and the braking distances that follow."""

from collections.abc import Iterator, Sequence
from typing import TypeVar

import numpy as np

from ...core.physics.train import CRH3, KMH, Train
from ...run.results.seen import is_known
from ..found.distances import FIXED_MU, distances
from ..found.findings import why_not
from ..read.run import Run

Column = TypeVar("Column")

ROWS = 6
"""Rows at most, evenly spread over the speeds of the braking."""

HEADER = (
    "                adhesion coefficient        braking distance to {target:.0f} km/h, m\n"
    "     km/h   true identified  at least    true identified  at least  fixed {fixed}"
)

HEADER_WITHOUT_TRUTH = (
    "        adhesion coefficient braking distance to {target:.0f} km/h, m\n"
    "     km/h identified  at least identified  at least  fixed {fixed}"
)

TRUTH = (1, 4)
"""Columns that only a simulation has."""

LEAST_USED = 5e-5
"""A true adhesion that the table would write as 0.0000 is none."""

NO_ROWS = "No rows: the train did not slow down by 10 km/h while it was faster than the target by as much."

FORMS = ("{:.0f}", "{:.4f}", "{:.4f}", "{:.4f}", "{:.0f}", "{:.0f}", "{:.0f}", "{:.0f}")
WIDTHS = (9, 7, 11, 10, 8, 11, 10, 10)
"""How the columns are written: speed, the true, the identified and the least adhesion, the distances by each, fixed."""


def rows(run: Run, target_kmh: float, train: Train = CRH3, absent: str = "–") -> Iterator[list[str]]:
    """Yield rows as texts, from 10 km/h below the highest speed before down to 10 km/h above the target.

    `absent` stands for what is not known: the truth at its end or while the train uses none of it, and an adhesion that
    is only believed.
    Without any truth its columns are left out.
    """
    speeds, target_mps = np.abs(run.speed.values), target_kmh * KMH
    within = np.flatnonzero((speeds < np.maximum.accumulate(speeds) - 10.0 * KMH) & (speeds > target_mps + 10.0 * KMH))
    if within.size > ROWS:
        within = within[np.linspace(0, within.size - 1, ROWS).round().astype(int)]
    mu, lower = run.mu.at(run.speed.t_ns), run.mu_lower.at(run.speed.t_ns)
    planned, is_anything_known = distances(run, target_mps, train), why_not(run) is None
    regimes = run.regimes_at(run.speed.t_ns)
    for i in within:
        true_mu, true_m = _truth(run, int(run.speed.t_ns[i]), target_mps)
        nominal, longest, fixed = (float(column[i]) for column in (planned.identified, planned.longest, planned.fixed))
        is_one = is_anything_known and is_known(mu[i], lower[i], regimes[i])
        identified = (float(mu[i]), nominal) if is_one else (None, None)
        row = (float(speeds[i]) / KMH, true_mu, identified[0], float(lower[i]), true_m, identified[1], longest, fixed)
        texts = (absent if value is None else form.format(value) for form, value in zip(FORMS, row, strict=True))
        yield shown(run, list(texts))


def shown(run: Run, columns: Sequence[Column]) -> list[Column]:
    """Those of the columns for which the run has something to show."""
    return [one for i, one in enumerate(columns) if run.true_mu.t_ns.size or i not in TRUTH]


def table(run: Run, target_kmh: float, train: Train = CRH3) -> str:
    """The table as text."""
    widths = shown(run, WIDTHS)
    lines = ["".join(map(str.rjust, row, widths)) for row in rows(run, target_kmh, train)]
    header = HEADER if run.true_mu.t_ns.size else HEADER_WITHOUT_TRUTH
    return "\n".join([header.format(target=target_kmh, fixed=FIXED_MU), *lines]) if lines else NO_ROWS


def _truth(run: Run, t_ns: int, target_mps: float) -> tuple[float | None, float | None]:
    """True adhesion at a time, and the distance that the train then went until it had the target speed."""
    now = np.array([t_ns])
    slow = np.flatnonzero(run.true_speed.values <= target_mps)
    if not run.true_mu.t_ns.size or not slow.size:
        return None, None
    left = run.true_position.values[slow[0]] - run.true_position.at(now)[0]
    used = float(run.true_mu.at(now)[0])  # of a train that coasts none
    return used if used > LEAST_USED else None, float(left)
