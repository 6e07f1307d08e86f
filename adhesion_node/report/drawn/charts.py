# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.

"""The charts of a run over time, the same in its picture and on its page: lines and ranges."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...core.physics.train import KMH, Train
from ..found.distances import FIXED_MU, distances, true_way
from ..read.run import Run
from ..read.series import NONE, Series

NOTHING = 1e-6
"""A chart whose values differ by less is one of zeros: its axis would have the same number at every tick."""

LABELS = {"known": "known, nothing claimed", "atleast": "at least, the brake limits", "identified": "identified"}
"""What μ̂ is where it is more than a prior."""


class Line(NamedTuple):
    """A line of a chart; its kind says how it is drawn.

    What μ̂ is, `kind_of` tells: "identified", "atleast", the lower end of an open interval, "known", "prior"; besides
    "truth", "bound", "fixed", and "nominal" for what follows from μ̂ whatever that is.
    """

    label: str
    kind: str
    series: Series


class Chart(NamedTuple):
    """Lines over time, without those that were not recorded; `digits` are the decimals that matter."""

    title: str
    digits: int
    lines: list[Line]

    @property
    def range(self) -> tuple[float, float]:
        """From the lowest value, or 0, to the highest; a bound near 0 is far from all that it may be compared with."""
        others = [line.series.values for line in self.lines if line.kind != "bound"]
        far = 2.0 * np.nanmax(np.abs(np.concatenate([[0.0], *others])))
        values = np.concatenate([[0.0], *(np.clip(line.series.values, -far, far) for line in self.lines)])
        low, high = 1.08 * float(np.nanmin(values)), 1.08 * float(np.nanmax(values))
        return (low, high) if high - low > NOTHING else (0.0, 1.0)


def charts(run: Run, target_kmh: float, train: Train) -> Iterator[Chart]:
    """Yield adhesion, speed, forces, braking distance, and what is saved of it while the train brakes.

    One after the other, as a day's lines are long.
    """
    planned = distances(run, target_kmh * KMH, train)
    at, seen = run.speed.t_ns, run.learnt
    worst, to_target = f"fixed worst case {FIXED_MU}", f"Braking distance to {target_kmh:.0f} km/h"
    bound = "lower bound" if run.confidence is None else f"lower bound, {run.confidence:.0%} confidence"
    yield _chart(
        *("Adhesion coefficient", 5),
        Line(worst, "fixed", Series(at, np.full(at.size, FIXED_MU))),
        Line("true", "truth", run.true_mu),
        Line(bound, "bound", run.mu_lower),
        *_told(run, "{}", prior="prior, not identified"),
    )
    yield _chart(
        *("Speed, km/h", 2),
        Line("true", "truth", run.true_speed.map(lambda mps: mps / KMH)),
        Line("estimated", "nominal", run.speed.map(lambda mps: mps / KMH)),
    )
    yield _chart(
        *("Forces, kN", 1),
        Line("brake B", "fixed", run.pressure.map(lambda pa: train.brake_force(pa) / 1e3)),
        Line("adhesion F, true", "truth", run.true_mu.map(lambda mu: train.adhesion_force(mu) / 1e3)),
        *(
            line._replace(series=line.series.map(lambda mu: train.adhesion_force(mu) / 1e3))
            for line in _told(run, "adhesion F, {}")
        ),
    )
    yield _chart(
        *(f"{to_target}, m", 1),
        Line(worst, "fixed", Series(at, planned.fixed)),
        Line("true", "truth", true_way(run, target_kmh * KMH)),
        Line("safe curve", "bound", Series(at, planned.longest)),
        Line("nominal curve, by μ̂", "nominal", Series(at, planned.identified)),
    )
    yield _chart(
        *(f"{to_target} saved, m", 1),
        Line(worst, "fixed", Series(at, np.zeros(at.size))),
        Line("at least, by the safe curve", "bound", Series(at[seen], planned.saved_at_least[seen])),
        Line("by μ̂, where it is known", "nominal", Series(at[seen], planned.saved[seen])),
    )


def _chart(title: str, digits: int, *lines: Line) -> Chart:
    return Chart(title, digits, [line for line in lines if line.series.t_ns.size])


def _told(run: Run, form: str, **further: str) -> Iterator[Line]:
    """μ̂ as a line of each kind: a gap where another one holds, none where it never does."""
    for kind, label in {**further, **{kind: form.format(label) for kind, label in LABELS.items()}}.items():
        holds = run.kinds.values == kind
        series = run.mu._replace(values=np.where(holds, run.mu.values, np.nan))
        yield Line(label, kind, series if holds.any() else NONE)
